//! Colours and markers that a colour-blind reader can tell apart.
//!
//! The palette is that of Okabe and Ito (Color Universal Design, 2008). Series also differ by marker, signs by
//! direction, significance by a mark: no figure speaks by colour alone.

/// Blue: the first series, and everything below zero.
pub const BLUE: &str = "#0072B2";
/// Vermillion: everything above zero, and what calls for attention.
pub const VERMILLION: &str = "#D55E00";
/// Bluish green.
pub const GREEN: &str = "#009E73";
/// Orange.
pub const ORANGE: &str = "#E69F00";
/// Sky blue.
pub const SKY: &str = "#56B4E9";
/// Reddish purple.
pub const PURPLE: &str = "#CC79A7";
/// Magenta: what somebody chose on the page of the laboratory, and nothing else.
pub const CHOSEN: &str = "#C2007A";
/// Text and axes.
pub const INK: &str = "#222222";
/// Secondary text and what is not significant.
pub const GREY: &str = "#767676";
/// Grid lines.
pub const FAINT: &str = "#E3E3E3";
/// Cells without a value.
pub const MISSING: &str = "#C9C9C9";

const SERIES: [&str; 7] = [BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, INK];

/// Colour of the i-th series or flight; repeats after seven, when the marker tells the repeats apart.
pub fn series_colour(i: usize) -> &'static str {
    SERIES[i % SERIES.len()]
}

/// Shape of a data point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// Filled circle.
    Circle,
    /// Filled square.
    Square,
    /// Filled triangle, point up.
    Triangle,
    /// Filled square standing on a corner.
    Diamond,
    /// Filled triangle, point down.
    Wedge,
    /// Upright cross.
    Plus,
}

/// Marker of the i-th series or flight. Six shapes against seven colours: 42 series before a pair repeats.
pub fn series_marker(i: usize) -> Marker {
    use Marker::*;
    [Circle, Square, Triangle, Diamond, Wedge, Plus][i % 6]
}

/// Colour of a signed value `t` in -1..=1: blue below zero, near white at zero, vermillion above. Beyond the ends the
/// end colour is used; the colour bar says so.
pub fn diverging(t: f64) -> String {
    blend(&[[0, 80, 125], [86, 160, 204], [247, 247, 247], [238, 154, 92], [179, 71, 0]], (t + 1.0) / 2.0)
}

/// Colour of a magnitude `t` in 0..=1, light to dark blue, so that it also prints in grey.
pub fn sequential(t: f64) -> String {
    blend(&[[247, 251, 255], [198, 219, 239], [107, 174, 214], [33, 113, 181], [8, 48, 107]], t)
}

/// Whether text on this colour should be white.
pub(super) fn is_dark(hex: &str) -> bool {
    let channel = |k: usize| hex.get(k..k + 2).and_then(|h| u8::from_str_radix(h, 16).ok()).map_or(255.0, f64::from);
    0.299 * channel(1) + 0.587 * channel(3) + 0.114 * channel(5) < 140.0
}

fn blend(stops: &[[u8; 3]], t: f64) -> String {
    let last = stops.len() - 1;
    let at = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) } * last as f64;
    let k = (at as usize).min(last - 1);
    let w = at - k as f64;
    let mix = |c: usize| (f64::from(stops[k][c]) * (1.0 - w) + f64::from(stops[k + 1][c]) * w).round() as u8;
    format!("#{:02X}{:02X}{:02X}", mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_scales_meet_their_ends() {
        assert_eq!(diverging(-1.0), "#00507D");
        assert_eq!(diverging(0.0), "#F7F7F7");
        assert_eq!(diverging(1.0), "#B34700");
        assert_eq!(diverging(7.0), diverging(1.0));
        assert_eq!(sequential(1.0), "#08306B");
        assert!(is_dark(&sequential(1.0)) && !is_dark(&sequential(0.0)));
    }

    #[test]
    fn first_42_series_differ_in_colour_or_marker() {
        let all: Vec<_> = (0..42).map(|i| (series_colour(i), series_marker(i))).collect();
        for (i, a) in all.iter().enumerate() {
            assert!(!all[..i].contains(a), "series {i} repeats");
        }
    }
}
