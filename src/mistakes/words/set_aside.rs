//! What was set aside.

use super::super::Mistake;
use super::super::survey::Count;
use super::common::{list, mistake, with};

fn set_aside(subject: &str, names: Vec<String>, count: usize, text: [String; 2]) -> Mistake {
    let found = mistake("set-aside", subject, names, f64::NAN, f64::NAN, text);
    with(found, count as f64, None, "measurements")
}

/// Control points that lost most of their marks.
pub fn points_set_aside(points: &[Count], of: usize) -> Mistake {
    let names: Vec<String> = points.iter().map(|count| count.name.clone()).collect();
    let (aside, all) = points.iter().fold((0, 0), |(aside, all), count| (aside + count.aside, all + count.all));
    let sentence = format!(
        "Control points: {aside} of {all} marks of {} were set aside, because they do not fit the rest ({} of {of} \
         control points).",
        list(&names),
        names.len()
    );
    let remedy = "Look at coordinates and marks of these points (control.csv, marks.csv). A point without marks takes \
                  no part in the adjustment.";
    set_aside("control", names, aside, [sentence, remedy.into()])
}

/// Images that lost most of their measurements.
pub fn images_set_aside(images: &[Count]) -> Mistake {
    let names: Vec<String> = images.iter().map(|count| count.name.clone()).collect();
    let (aside, all) = images.iter().fold((0, 0), |(aside, all), count| (aside + count.aside, all + count.all));
    let sentence = format!("Images: {aside} of {all} measurements of {} were set aside.", list(&names));
    let remedy = "Check whether these images are mirrored, turned or cropped, belong to another camera, or have a \
                  wrong GNSS position.";
    set_aside("images", names, aside, [sentence, remedy.into()])
}

/// Much of everything was set aside.
pub fn share_set_aside(all: &Count) -> Mistake {
    let percent = 100.0 * all.aside as f64 / all.all as f64;
    let sentence = format!("{} of {} image measurements were set aside ({percent:.0} %).", all.aside, all.all);
    let remedy = "So many outliers have a common cause: look at the calibration, at the list of images, and at how \
                  points were matched.";
    set_aside("ties", Vec::new(), all.aside, [sentence, remedy.into()])
}
