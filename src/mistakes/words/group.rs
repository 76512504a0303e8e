//! A whole group.

use super::super::Mistake;
use super::super::clock::{Clock, GPS_AHEAD_OF_UTC};
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
