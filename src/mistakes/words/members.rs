//! Members of a group.

use super::super::Mistake;
use super::super::survey::Subject;
use super::super::undo::{as_check, shifted_back, without_positions};
use super::common::{AXES, list, mistake, with};
use crate::block::edit::{Change, Edit};
use nalgebra::Vector3;

/// GNSS positions that do not fit.
pub fn wrong_positions(names: Vec<String>, worst: f64, drop: f64, ln_p: f64) -> Mistake {
    let sentence = match names.as_slice() {
        [name] => format!("GNSS positions: that of {name} does not fit the images, by {worst:.2} m."),
        _ => {
            format!("GNSS positions: {} do not fit the images, by up to {worst:.2} m ({}).", names.len(), list(&names))
        }
    };
    let remedy =
        "Leave these positions out, or look at the fix of the receiver there (gnss_x, gnss_y, gnss_z of images.csv).";
    let mend = without_positions(&names);
    let found = mistake("wrong-position", "gnss", names, drop, ln_p, [sentence, remedy.into()]).undone_by(mend);
    with(found, worst, None, "m")
}

/// A flight of which all positions are off.
pub fn flight_offset(
    flight: &str,
    images: Vec<String>,
    shift: &Vector3<f64>,
    sigma: f64,
    drop: f64,
    ln_p: f64,
) -> Mistake {
    let sentence = format!(
        "GNSS positions of flight {flight} are off by {:.2}, {:.2}, {:.2} m (x, y, z) against the other flights, which \
         the images connect.",
        shift.x, shift.y, shift.z
    );
    let remedy = "Look at base station, height system and antenna height of this flight; where only two flights are \
                  compared, it may be the other one.";
    let mend = shifted_back(Subject::Gnss, shift).into_iter().map(|edit| edit.of("flight", &[flight.into()])).collect();
    let found = mistake("flight-offset", "gnss", images, drop, ln_p, [sentence, remedy.into()]).undone_by(mend);
    with(found, shift.norm(), Some(sigma), "m")
}

/// A point of which one coordinate is wrong.
pub fn wrong_coordinate(
    subject: Subject,
    name: &str,
    axis: usize,
    value: f64,
    sigma: f64,
    drop: f64,
    ln_p: f64,
) -> Mistake {
    let sentence = format!(
        "{}: {} of {name} is off by {value:.3} m; its other coordinates fit the images.",
        subject.words(),
        AXES[axis]
    );
    let remedy = format!("Look at this coordinate in the field book ({}).", subject.place());
    let mend = as_check(subject, name);
    let found =
        mistake("wrong-coordinate", subject.key(), vec![name.into()], drop, ln_p, [sentence, remedy]).undone_by(mend);
    with(found, value, Some(sigma), "m")
}

/// A point that does not fit at all.
pub fn wrong_position(subject: Subject, name: &str, misfit: &Vector3<f64>, drop: f64, ln_p: f64) -> Mistake {
    let sentence = format!(
        "{}: {name} does not fit the images, by {:.3}, {:.3}, {:.3} m (x, y, z).",
        subject.words(),
        misfit.x,
        misfit.y,
        misfit.z
    );
    let remedy = format!(
        "Look at its coordinates ({}), and whether its marks are on another point (marks.csv).",
        subject.place()
    );
    let mend = as_check(subject, name);
    let found =
        mistake("wrong-position", subject.key(), vec![name.into()], drop, ln_p, [sentence, remedy]).undone_by(mend);
    with(found, misfit.norm(), None, "m")
}

/// Two points that are exchanged.
pub fn exchanged(subject: Subject, names: [&String; 2], drop: f64, ln_p: f64) -> Mistake {
    let [a, b] = names;
    let sentence =
        format!("{}: {a} and {b} are exchanged; each fits the images at the place of the other.", subject.words());
    let remedy = "Exchange their names, in control.csv or in marks.csv, whichever list is wrong.";
    let values = [a.clone(), b.clone()];
    let mend = vec![Edit::all("control.csv", Change::ExchangeValues { column: "point".into(), values })];
    mistake("exchanged", subject.key(), vec![a.clone(), b.clone()], drop, ln_p, [sentence, remedy.into()])
        .undone_by(mend)
}

/// Two images with each other's measurements.
pub fn exchanged_images(names: [&str; 2], drop: f64, ln_p: f64) -> Mistake {
    let [a, b] = names;
    let sentence = format!(
        "Images {a} and {b}: their measurements are exchanged; those of each fit at the place of the other. Their rows \
         in images.csv may be exchanged instead."
    );
    let remedy = "Exchange the two names, in ties.csv and marks.csv or in images.csv.";
    let values = names.map(String::from);
    let edit = |file: &str| Edit::all(file, Change::ExchangeValues { column: "image".into(), values: values.clone() });
    let mend = vec![edit("ties.csv"), edit("marks.csv")];
    mistake("exchanged", "images", values.to_vec(), drop, ln_p, [sentence, remedy.into()]).undone_by(mend)
}
