//! Mistakes in sentences, with what to do about them.

use super::Mistake;
use super::pair::{GEOID_M, Relation};
use super::set_aside::Count;
use super::shape::{Change, FOOT};
use super::survey::Subject;
use nalgebra::Vector3;

/// Names that a sentence lists; the list `names` has all.
const LISTED: usize = 5;
const AXES: [&str; 3] = ["x", "y", "z"];

/// What two groups differ by.
pub struct Difference {
    /// In which way.
    pub relation: Relation,
    /// Tested less reference, m.
    pub shift: Vector3<f64>,
    /// Its standard deviations, m.
    pub sigma: Vector3<f64>,
    /// Fall of the sum of squares without it.
    pub drop: f64,
    /// `ln p` of that.
    pub ln_p: f64,
}

fn mistake(kind: &str, subject: &str, names: Vec<String>, drop: f64, ln_p: f64, text: [String; 2]) -> Mistake {
    let [sentence, remedy] = text;
    let (kind, subject) = (kind.to_string(), subject.to_string());
    Mistake { kind, subject, names, value: None, sigma: None, unit: None, drop, ln_p, sentence, remedy }
}

fn with(mistake: Mistake, value: f64, sigma: Option<f64>, unit: &str) -> Mistake {
    Mistake { value: Some(value), sigma, unit: Some(unit.into()), ..mistake }
}

fn list(names: &[String]) -> String {
    let shown = names.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(LISTED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

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
            format!("{who}: each image has the position of the image {} in the list; {fit}.", places(by)),
            format!(
                "Pair images and positions anew ({place}); an image without a position, or one too many, shifts a list."
            ),
        ],
        Change::Shifted(by) => [
            format!("{who}: each point has the coordinates of the point {} in the list; {fit}.", places(by)),
            format!("Pair names and coordinates anew ({place})."),
        ],
        Change::None => [String::new(), String::new()],
    };
    let found = mistake(change.kind(subject), subject.key(), Vec::new(), drop, ln_p, [sentence, remedy]);
    match change.value() {
        Some((value, unit)) => with(found, value, None, unit),
        None => found,
    }
}

fn places(by: isize) -> String {
    format!("{} {}", by.unsigned_abs(), if by > 0 { "further on" } else { "before" })
}

fn unit(metres: f64) -> String {
    let factor = 1.0 / metres;
    match metres {
        m if m == FOOT => format!("in feet (a factor of {factor:.4})"),
        m if m == 1.0 / FOOT => format!("too small by {factor:.4}, as metres that were taken for feet and converted"),
        m if m == 1e-3 => "in millimetres".into(),
        m if m == 1e-2 => "in centimetres".into(),
        _ => format!("in a unit of {metres} m"),
    }
}

/// Positions that stand for several places.
pub fn collapsed(subject: Subject, names: Vec<String>, at: &Vector3<f64>, count: usize) -> Mistake {
    let zeros = at.amax() < 1e-6;
    let place = if zeros { "0, 0, 0".into() } else { format!("{:.3}, {:.3}, {:.3}", at.x, at.y, at.z) };
    let sentence = format!(
        "{}: {} stand at one place ({place}), and the images see them at different ones{}.",
        subject.words(),
        if names.is_empty() { format!("all {count}") } else { format!("{count} ({})", list(&names)) },
        if zeros { "; zeros stand for missing values" } else { "" }
    );
    let remedy =
        format!("Leave cells without a value empty; else look for a line that was copied ({}).", subject.place());
    let found = mistake("collapsed", subject.key(), names, f64::NAN, f64::NEG_INFINITY, [sentence, remedy]);
    with(found, count as f64, None, "positions")
}

/// GNSS positions that do not fit.
pub fn wrong_positions(names: Vec<String>, worst: f64, drop: f64, ln_p: f64) -> Mistake {
    let sentence = format!(
        "GNSS positions: {} of {} do not fit the images, by up to {worst:.2} m.",
        if names.len() == 1 { "that".into() } else { format!("{}", names.len()) },
        list(&names)
    );
    let remedy =
        "Leave these positions out, or look at the fix of the receiver there (gnss_x, gnss_y, gnss_z of images.csv).";
    let found = mistake("wrong-position", "gnss", names, drop, ln_p, [sentence, remedy.into()]);
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
        "GNSS positions of flight {flight} are off by {:.2}, {:.2}, {:.2} m (x, y, z) against the other flights, which the images connect.",
        shift.x, shift.y, shift.z
    );
    let remedy = "Look at base station, height system and antenna height of this flight; where only two flights are compared, it may be the other one.";
    let found = mistake("flight-offset", "gnss", images, drop, ln_p, [sentence, remedy.into()]);
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
    let found = mistake("wrong-coordinate", subject.key(), vec![name.into()], drop, ln_p, [sentence, remedy]);
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
    let found = mistake("wrong-position", subject.key(), vec![name.into()], drop, ln_p, [sentence, remedy]);
    with(found, misfit.norm(), None, "m")
}

/// Two points that are exchanged.
pub fn exchanged(subject: Subject, names: [&String; 2], drop: f64, ln_p: f64) -> Mistake {
    let [a, b] = names;
    let sentence =
        format!("{}: {a} and {b} are exchanged; each fits the images at the place of the other.", subject.words());
    let remedy = "Exchange their names, in control.csv or in marks.csv, whichever list is wrong.";
    mistake("exchanged", subject.key(), vec![a.clone(), b.clone()], drop, ln_p, [sentence, remedy.into()])
}

/// Heights of two groups. `value` is points less GNSS, or check less control.
pub fn height_offset(one: Subject, other: Subject, difference: &Difference) -> Mistake {
    let (value, sigma) = (difference.shift.z, difference.sigma.z);
    let size = value.abs();
    let [above, below] = if value > 0.0 { [other, one] } else { [one, other] };
    let mut sentence = format!(
        "{} lie {size:.2} m above {}, straight up, while both agree with the images.",
        above.words(),
        lower(below)
    );
    let mut remedy = format!("Look at the heights of both ({}; {}).", one.place(), other.place());
    if (GEOID_M[0]..=GEOID_M[1]).contains(&size) {
        sentence += " That is what ellipsoid and geoid differ by: one of the two has heights above the ellipsoid, the other above the geoid.";
        remedy = format!("Take both to one height system with the undulation of the geoid at this place. {remedy}");
    } else {
        sentence += " The images do not tell which of the two is wrong.";
    }
    let found = mistake("height-offset", other.key(), Vec::new(), difference.drop, difference.ln_p, [sentence, remedy]);
    with(found, value, Some(sigma), "m")
}

fn lower(subject: Subject) -> String {
    match subject {
        Subject::Control => "control points".into(),
        Subject::Check => "check points".into(),
        Subject::Gnss => "GNSS positions".into(),
    }
}

/// Two groups that are off horizontally.
pub fn plan_offset(one: Subject, other: Subject, difference: &Difference) -> Mistake {
    let [x, y, z]: [f64; 3] = difference.shift.into();
    let sentence = format!(
        "{} are off by {x:.3}, {y:.3}, {z:.3} m (x, y, z) against {}, while both agree with the images. The images do not tell which of the two is wrong.",
        other.words(),
        lower(one)
    );
    let remedy = format!("Look at the coordinate system of both ({}).", other.place());
    let found = mistake("plan-offset", other.key(), Vec::new(), difference.drop, difference.ln_p, [sentence, remedy]);
    with(found, difference.shift.norm(), Some(difference.sigma.norm()), "m")
}

/// Two groups in systems of their own.
pub fn other_frame(one: Subject, other: Subject, distance: f64, difference: &Difference) -> Mistake {
    let sentence = format!(
        "{} and {} are in different coordinate systems: they lie {} apart, while both agree with the images.",
        other.words(),
        lower(one),
        if distance >= 1e4 { format!("{:.0} km", distance / 1e3) } else { format!("{distance:.1} m") }
    );
    let remedy = format!("Transform one of the two to the system of the block ({}; {}).", one.place(), other.place());
    let found = mistake("other-frame", other.key(), Vec::new(), difference.drop, difference.ln_p, [sentence, remedy]);
    with(found, distance, None, "m")
}

/// A group that is recorded in another unit, or with other axes, than the other one.
pub fn recorded_otherwise(one: Subject, other: Subject, difference: &Difference) -> Mistake {
    // Of two lists the one in the smaller unit has the larger numbers: metres are the rule.
    let of_unit = |metres: f64| if metres < 1.0 { (other, one, metres) } else { (one, other, 1.0 / metres) };
    let (kind, subject, value, what, undo) = match difference.relation {
        Relation::Unit(metres) => {
            let (who, against, metres) = of_unit(metres);
            let what = format!("{} are {} against {}", who.words(), unit(metres), lower(against));
            ("scale", who, Some(1.0 / metres), what, "Convert them to metres")
        }
        Relation::HeightUnit(metres) => {
            let (who, against, metres) = of_unit(metres);
            let what = format!("Heights of {} are {} against {}", lower(who), unit(metres), lower(against));
            ("height-scale", who, Some(1.0 / metres), what, "Convert the heights to metres")
        }
        Relation::Exchanged(a, b) => {
            let what = format!("{}: {} and {} are exchanged against {}", other.words(), AXES[a], AXES[b], lower(one));
            ("axes-exchanged", other, None, what, "Exchange the two columns")
        }
        Relation::Reversed(axis) => {
            let what = format!("{}: {} has the wrong sign against {}", other.words(), AXES[axis], lower(one));
            ("axis-reversed", other, None, what, "Change the sign of this column")
        }
        _ => ("other-frame", other, None, format!("{} and {} disagree", other.words(), lower(one)), "Look at both"),
    };
    let text = [format!("{what}."), format!("{undo} ({}).", subject.place())];
    let found = mistake(kind, subject.key(), Vec::new(), difference.drop, difference.ln_p, text);
    match value {
        Some(value) => with(found, value, None, "1"),
        None => found,
    }
}

/// A group of another scale.
pub fn scale(one: Subject, other: Subject, scale: f64, difference: &Difference) -> Mistake {
    let sentence = format!(
        "{} are {scale:.6} times as large as {} ask for, while both agree with the images. No map has such a scale.",
        other.words(),
        lower(one)
    );
    let remedy = format!("Look at the unit and the coordinate system of both ({}; {}).", one.place(), other.place());
    let found = mistake("scale", other.key(), Vec::new(), difference.drop, difference.ln_p, [sentence, remedy]);
    with(found, scale, None, "1")
}

/// A group that is turned.
pub fn rotation(one: Subject, other: Subject, degrees: f64, difference: &Difference) -> Mistake {
    let sentence = format!(
        "{} are turned by {degrees:.3} degrees about the vertical against {}, while both agree with the images.",
        other.words(),
        lower(one)
    );
    let remedy = format!("Look at the coordinate system of both ({}; {}).", one.place(), other.place());
    let found = mistake("rotation", other.key(), Vec::new(), difference.drop, difference.ln_p, [sentence, remedy]);
    with(found, degrees, None, "deg")
}

fn set_aside(subject: &str, names: Vec<String>, count: usize, text: [String; 2]) -> Mistake {
    let found = mistake("set-aside", subject, names, f64::NAN, f64::NAN, text);
    with(found, count as f64, None, "measurements")
}

/// Control points that lost most of their marks.
pub fn points_set_aside(points: &[Count], of: usize) -> Mistake {
    let names: Vec<String> = points.iter().map(|count| count.name.clone()).collect();
    let (aside, all) = points.iter().fold((0, 0), |(aside, all), count| (aside + count.aside, all + count.all));
    let sentence = format!(
        "Control points: {aside} of {all} marks of {} were set aside, because they do not fit the rest ({} of {of} control points).",
        list(&names),
        names.len()
    );
    let remedy = "Look at coordinates and marks of these points (control.csv, marks.csv): with its marks the point, too, was left out.";
    set_aside("control", names, aside, [sentence, remedy.into()])
}

/// Images that lost most of their measurements.
pub fn images_set_aside(images: &[Count]) -> Mistake {
    let names: Vec<String> = images.iter().map(|count| count.name.clone()).collect();
    let (aside, all) = images.iter().fold((0, 0), |(aside, all), count| (aside + count.aside, all + count.all));
    let sentence = format!("Images: {aside} of {all} measurements of {} were set aside.", list(&names));
    let remedy = "Look whether these images are mirrored, turned or cropped, belong to another camera, or have a wrong GNSS position.";
    set_aside("images", names, aside, [sentence, remedy.into()])
}

/// Much of everything was set aside.
pub fn share_set_aside(all: &Count) -> Mistake {
    let percent = 100.0 * all.aside as f64 / all.all as f64;
    let sentence = format!("{} of {} image measurements were set aside ({percent:.0} %).", all.aside, all.all);
    let remedy = "So many outliers are a mistake that all of them share: look at the calibration, at the list of images, and at how points were matched.";
    set_aside("ties", Vec::new(), all.aside, [sentence, remedy.into()])
}
