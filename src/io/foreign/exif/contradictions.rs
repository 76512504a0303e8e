//! What EXIF and XMP of one image say differently of the same thing: the sign of a height, and the time.

use super::super::Note;
use crate::math::statistics::median;

/// Two heights that differ in their sign alone are equal to that, m: EXIF has a decimal or two, XMP has three.
const SAME_M: f64 = 1.0;
/// Heights that are nearer to zero have no sign that could be wrong, m.
const ZERO_M: f64 = 2.0;
/// Times of one exposure differ by up to that, s: stamps of the receiver are whole seconds, and older by one.
const SAME_S: f64 = 1.6;
/// Zones of the world differ by multiples of that, s: a quarter of an hour.
const ZONE_S: f64 = 900.0;
/// From when GPS time has been ahead of UTC by so many seconds, s since 1970: 2009, 2012, 2015 and 2017.
const AHEAD: [(f64, f64); 4] =
    [(1_230_768_000.0, 15.0), (1_341_100_800.0, 16.0), (1_435_708_800.0, 17.0), (1_483_228_800.0, 18.0)];
/// Images that tell how two clocks differ: one may have been written late.
const FEWEST: usize = 2;

/// What one image says, where it does.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Said {
    /// EXIF, with the sign of its reference, m.
    pub exif_height: Option<f64>,
    /// XMP, m.
    pub xmp_height: Option<f64>,
    /// `GPSDateStamp` and `GPSTimeStamp`, s since 1970.
    pub gps_s: Option<f64>,
    /// `DateTimeOriginal`, s since 1970 by the camera's clock.
    pub clock_s: Option<f64>,
    /// From UTC to that clock, s.
    pub offset_s: Option<f64>,
    /// `UTCAtExposure`, s since 1970.
    pub utc_s: Option<f64>,
}

/// Contradictions, one sentence each.
pub(super) fn notes(said: &[Said]) -> Vec<Note> {
    let mut notes = Vec::new();
    let is_turned = |one: &&Said| {
        let pair = one.exif_height.zip(one.xmp_height);
        pair.is_some_and(|(exif, xmp)| (exif + xmp).abs() < SAME_M && exif.abs() > ZERO_M)
    };
    let turned = said.iter().filter(is_turned).count();
    if turned > 0 {
        notes.push(Note::fact(format!(
            "{turned} images have a height in EXIF (GPSAltitude with GPSAltitudeRef) and the same one with the \
             opposite sign in XMP (AbsoluteAltitude). One of the two is wrong; XMP is taken where it has a position"
        )));
    }
    // The stamp of the receiver should be UTC.
    let stated = |one: &Said| one.utc_s.or(Some(one.clock_s? - one.offset_s?));
    let of_utc: Vec<f64> = said.iter().filter_map(|one| Some(one.gps_s? - stated(one)?)).collect();
    let of_clock: Vec<f64> = said.iter().filter_map(|one| Some(one.gps_s? - one.clock_s?)).collect();
    let epoch = said.iter().find_map(|one| one.gps_s);
    notes.extend(epoch.and_then(|epoch| times(&of_utc, &of_clock, ahead(epoch))));
    notes
}

/// Seconds that GPS time is ahead of UTC at a time.
fn ahead(epoch: f64) -> f64 {
    AHEAD.iter().rev().find(|(since, _)| epoch >= *since).map_or(14.0, |(_, seconds)| *seconds)
}

/// `of_utc`: the receiver's stamps less the times that are UTC by what the files say, s; `of_clock`: less a clock of a
/// zone that may be any.
fn times(of_utc: &[f64], of_clock: &[f64], ahead: f64) -> Option<Note> {
    let (differences, is_utc) = if of_utc.len() >= FEWEST { (of_utc, true) } else { (of_clock, false) };
    if differences.len() < FEWEST {
        return None;
    }
    let middle = median(differences);
    let count = differences.iter().filter(|own| (**own - middle).abs() <= SAME_S).count();
    // Clocks that drift, and images of several days, are another matter.
    if 2 * count <= differences.len() {
        return None;
    }
    let zones = ZONE_S * (middle / ZONE_S).round();
    let rest = middle - zones;
    let leap = (rest.abs() - ahead).abs() <= SAME_S;
    let other = if is_utc { "the time of exposure in UTC" } else { "DateTimeOriginal, whole hours aside," };
    match (leap, is_utc && zones != 0.0 && rest.abs() <= SAME_S) {
        (true, _) => Some(Note::fact(format!(
            "{count} images: GPSTimeStamp and {other} are {:.0} s apart, as GPS time and UTC are. One of the two is \
             probably GPS time, which is {ahead:.0} s ahead; times here are those of DateTimeOriginal",
            rest.abs()
        ))),
        (false, true) => Some(Note::fact(format!(
            "{count} images: GPSTimeStamp and {other} are {} h apart. The clock was set to another zone than \
             OffsetTimeOriginal, or one of the two is local time; times here are those of DateTimeOriginal",
            zones.abs() / 3600.0
        ))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOON: f64 = 1_700_000_000.0;

    fn said(count: usize, one: impl Fn(f64) -> Said) -> Vec<String> {
        let all: Vec<Said> = (0..count).map(|k| one(NOON + 2.5 * k as f64)).collect();
        notes(&all).into_iter().map(|note| note.text).collect()
    }

    #[test]
    fn heights_of_opposite_sign_are_said_and_different_ones_are_not() {
        let heights = |exif: f64, xmp: f64| {
            said(3, move |_| Said { exif_height: Some(exif), xmp_height: Some(xmp), ..Said::default() })
        };
        assert!(heights(-120.3, 120.34)[0].starts_with("3 images have a height in EXIF"));
        for (exif, xmp) in [(120.3, 120.3), (20.0, -27.0), (120.0, 165.0), (-1.0, 1.0)] {
            assert!(heights(exif, xmp).is_empty(), "{exif} {xmp}");
        }
    }

    #[test]
    fn leap_seconds_between_stamp_and_clock() {
        let clock = |by: f64, offset: Option<f64>| {
            said(5, move |utc| Said {
                gps_s: Some(utc.floor()),
                clock_s: Some(utc + by),
                offset_s: offset,
                ..Said::default()
            })
        };
        for (by, offset) in [(18.0, Some(0.0)), (7218.2, Some(7200.0)), (7217.9, None), (-18.0, None)] {
            let notes = clock(by, offset);
            assert_eq!(notes.len(), 1, "{by}");
            assert!(notes[0].contains("probably GPS time, which is 18 s ahead"), "{notes:?}");
        }
        for (by, offset) in [(0.3, Some(0.0)), (7200.4, Some(7200.0)), (7200.0, None), (43.0, None), (300.0, Some(0.0))]
        {
            assert!(clock(by, offset).is_empty(), "{by}");
        }
    }

    #[test]
    fn whole_hours_are_said_where_the_zone_is_stated() {
        let one = |utc: f64| Said {
            gps_s: Some(utc.floor()),
            clock_s: Some(utc + 7200.0),
            offset_s: Some(3600.0),
            ..Said::default()
        };
        let notes = said(4, one);
        assert!(notes.len() == 1 && notes[0].contains("are 1 h apart"), "{notes:?}");
        assert!(said(1, one).is_empty(), "one image tells nothing");
    }

    #[test]
    fn gps_time_was_less_ahead_before() {
        assert_eq!([1.45e9, 1.4e9, 1.25e9, 1e9].map(ahead), [17.0, 16.0, 15.0, 14.0]);
    }
}
