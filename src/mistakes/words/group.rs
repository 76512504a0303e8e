//! A whole group.

use super::super::Mistake;
use super::super::clock::{Clock, GPS_AHEAD_OF_UTC};
use super::super::few::Fit;
use super::super::shape::Change;
use super::super::survey::Subject;
use super::super::undo::{edits_of, without_positions};
use super::common::{AXES, list, mistake, rows, unit, with};
use nalgebra::Vector3;

/// A difference of clocks this near is that one, s: cameras record whole seconds.
const NEAR: f64 = 1.0;

/// A change of a whole group.
pub fn changed(subject: Subject, change: Change, drop: f64, ln_p: f64) -> Mistake {
    let who = subject.words();
    let place = subject.place();
    let fit = "once that is undone they fit the shape that the images give";
    let [sentence, remedy] = match change {
        Change::HeightUnit(metres) => [
            format!("{who}: the heights are {}; {fit}.", unit(metres)),
            format!("Convert the heights to metres ({place})."),
        ],
        Change::Exchanged(a, b) => [
            format!("{who}: {} and {} are exchanged; {fit}.", AXES[a], AXES[b]),
            format!("Exchange the two columns ({place})."),
        ],
        Change::Reversed(axis) => [
            format!("{who}: {} has the wrong sign; {fit}.", AXES[axis]),
            format!("Change the sign of this column ({place})."),
        ],
        Change::Degrees(first) => [
            format!(
                "{who} are geographic coordinates in degrees, {} first; coordinates of a block are metres.",
                if first { "latitude" } else { "longitude" }
            ),
            format!("Transform them to the projected system of the block ({place})."),
        ],
        Change::Shifted(by) if subject == Subject::Gnss => [
            format!("{who}: each image has the position of the image {} in the list; {fit}.", rows(by)),
            format!(
                "Pair images and positions again ({place}); an image without a position, or one too many, shifts a \
                 list."
            ),
        ],
        Change::Shifted(by) => [
            format!("{who}: each point has the coordinates of the point {} in the list; {fit}.", rows(by)),
            format!("Pair names and coordinates again ({place})."),
        ],
        Change::Clock(Clock { seconds, .. }) => [
            format!(
                "{who} are those of {:.2} s {} the exposures{}; {fit}.",
                seconds.abs(),
                if seconds > 0.0 { "after" } else { "before" },
                if (seconds.abs() - GPS_AHEAD_OF_UTC).abs() < NEAR {
                    " (GPS time is 18 s ahead of UTC since 2017)"
                } else {
                    ""
                }
            ),
            format!("Take clocks of camera and receiver to one time, and interpolate the positions again ({place})."),
        ],
        Change::None => [String::new(), String::new()],
    };
    let found = mistake(change.kind(subject), subject.key(), Vec::new(), drop, ln_p, [sentence, remedy])
        .undone_by(edits_of(subject, change));
    let sigma = match change {
        Change::Clock(clock) => Some(clock.sigma),
        _ => None,
    };
    match change.value() {
        Some((value, unit)) => with(found, value, sigma, unit),
        None => found,
    }
}

/// What was done, as a part of a sentence.
pub fn in_short(change: Change) -> String {
    match change {
        Change::HeightUnit(metres) => format!("heights {}", unit(metres)),
        Change::Exchanged(a, b) => format!("{} and {} exchanged", AXES[a], AXES[b]),
        Change::Reversed(axis) => format!("{} with the wrong sign", AXES[axis]),
        Change::Degrees(_) => "geographic coordinates in degrees".into(),
        Change::None | Change::Shifted(_) | Change::Clock(_) => String::new(),
    }
}

/// A few points that together contradict the images, and what may be the cause.
pub fn contradicting(subject: Subject, names: Vec<String>, fit: Fit, causes: &[String]) -> Mistake {
    let (who, count, listed) = (subject.words(), names.len(), list(&names));
    let what = match fit {
        Fit::Off(off) => format!("do not have the shape that the images give: {off:.3} m (RMS) are left over"),
        Fit::None => "do not resemble the shape that the images give".into(),
        Fit::UpsideDown => "fit the images upside down alone: the cameras would lie below the ground".into(),
    };
    let sentence = match causes {
        [] => format!("{who}: {listed} {what}. {count} points do not tell which of them is wrong."),
        all => format!(
            "{who}: {listed} {what}. What may be wrong: one point; {}. {count} points do not tell.",
            all.join("; ")
        ),
    };
    let remedy = "Compare control.csv and marks.csv with the list of the survey. A fifth point, or GNSS positions, \
                  would tell what is wrong.";
    let found = mistake("shape", subject.key(), names, f64::NAN, f64::NEG_INFINITY, [sentence, remedy.into()]);
    match fit {
        Fit::Off(off) => with(found, off, None, "m"),
        Fit::None | Fit::UpsideDown => found,
    }
}

/// What somebody or a program meant.
const ZEROS: &str = "zeros stand for missing values";

/// Positions that stand for several places, or for no value.
pub fn collapsed(subject: Subject, names: Vec<String>, at: &Vector3<f64>, count: usize) -> Mistake {
    let zeros = at.amax() < 1e-6;
    let place = if zeros { "0, 0, 0".into() } else { format!("{:.3}, {:.3}, {:.3}", at.x, at.y, at.z) };
    let sentence = match names.as_slice() {
        [name] => {
            format!("{}: {name} is recorded at {place}, and the images see it elsewhere; {ZEROS}.", subject.words())
        }
        _ => format!(
            "{}: {} stand at one place ({place}), and the images see them at different ones{}.",
            subject.words(),
            if names.is_empty() { format!("all {count}") } else { format!("{count} ({})", list(&names)) },
            if zeros { format!("; {ZEROS}") } else { String::new() }
        ),
    };
    let remedy =
        format!("Leave cells without a value empty; else look for a line that was copied ({}).", subject.place());
    let mend = if subject == Subject::Gnss { without_positions(&names) } else { Vec::new() };
    let mend = if names.is_empty() { Vec::new() } else { mend };
    let found =
        mistake("collapsed", subject.key(), names, f64::NAN, f64::NEG_INFINITY, [sentence, remedy]).undone_by(mend);
    with(found, count as f64, None, "positions")
}
