//! Two groups against each other.

use super::super::Mistake;
use super::super::relation::{Difference, GEOID_M, Relation};
use super::super::shape::Change;
use super::super::survey::Subject;
use super::super::undo::{edits_of, shifted_back};
use super::common::{AXES, lower, mistake, places, unit, with};
use crate::block::edit::{self, Edit};
use nalgebra::Vector3;

/// Heights of two groups. `value` is points less GNSS, or check less control. `focal`: change of the focal length (its
/// share) that would look the same, where the images do not tell it.
pub fn height_offset(one: Subject, other: Subject, difference: &Difference, focal: Option<f64>) -> Mistake {
    let (value, sigma) = (difference.shift.z, difference.sigma.z);
    let size = value.abs();
    let [above, below] = if value > 0.0 { [other, one] } else { [one, other] };
    let mut sentence = format!(
        "{} lie {size:.2} m above {}, straight up, while both agree with the images.",
        above.words(),
        lower(below)
    );
    let mut remedy = format!("Look at the heights of both ({}).", places(one, other));
    if (GEOID_M[0]..=GEOID_M[1]).contains(&size) {
        sentence += " That is what ellipsoid and geoid differ by: one of the two has heights above the ellipsoid, the \
                     other above the geoid.";
        remedy = format!("Take both to one height system with the undulation of the geoid at this place. {remedy}");
    } else {
        sentence += " The images do not tell which of the two is wrong.";
    }
    if let Some(share) = focal {
        sentence += &format!(
            " The images do not tell the focal length; one that is off by {:.1} % would look the same.",
            100.0 * share
        );
    }
    // Results are wanted in the heights of the points.
    let mend = match one {
        Subject::Gnss => shifted_back(one, &Vector3::new(0.0, 0.0, -value)),
        _ => shifted_back(other, &Vector3::new(0.0, 0.0, value)),
    };
    let found = mistake("height-offset", other.key(), Vec::new(), difference.drop, difference.ln_p, [sentence, remedy])
        .undone_by(mend);
    with(found, value, Some(sigma), "m")
}

/// Said where a single point shows a height offset.
const ONE_POINT: &str = "One point alone shows it: a wrong height of that point would look the same.";

/// A height offset that a single point shows: its own height may be wrong.
pub fn of_one_point(offset: Mistake) -> Mistake {
    let sentence = format!("{} {ONE_POINT}", offset.sentence);
    Mistake { sentence, ..offset }
}

/// Does a single point show it?
pub fn is_of_one_point(offset: &Mistake) -> bool {
    offset.sentence.ends_with(ONE_POINT)
}

/// Two groups that are off horizontally.
pub fn plan_offset(one: Subject, other: Subject, difference: &Difference) -> Mistake {
    let [x, y, z]: [f64; 3] = difference.shift.into();
    let sentence = format!(
        "{} are off by {x:.3}, {y:.3}, {z:.3} m (x, y, z) against {}, while both agree with the images. The images do \
         not tell which of the two is wrong.",
        other.words(),
        lower(one)
    );
    let remedy = format!("Look at the coordinate system of both ({}).", other.place());
    // Results are wanted in the system of the points.
    let mend = match one {
        Subject::Gnss => shifted_back(one, &-difference.shift),
        _ => shifted_back(other, &difference.shift),
    };
    let found = mistake("plan-offset", other.key(), Vec::new(), difference.drop, difference.ln_p, [sentence, remedy])
        .undone_by(mend);
    // Of the length.
    let sigma = difference.shift.component_mul(&difference.sigma).norm() / difference.shift.norm();
    with(found, difference.shift.norm(), Some(sigma), "m")
}

/// Two groups in systems of their own.
pub fn other_frame(one: Subject, other: Subject, distance: f64, difference: &Difference) -> Mistake {
    let sentence = format!(
        "{} and {} are in different coordinate systems: they lie {} apart, while both agree with the images.",
        other.words(),
        lower(one),
        if distance >= 1e4 { format!("{:.0} km", distance / 1e3) } else { format!("{distance:.1} m") }
    );
    let remedy = format!("Transform one of the two to the system of the block ({}).", places(one, other));
    let found = mistake("other-frame", other.key(), Vec::new(), difference.drop, difference.ln_p, [sentence, remedy]);
    with(found, distance, None, "m")
}

/// A group that is recorded in another unit, or with other axes, than the other one.
pub fn recorded_otherwise(one: Subject, other: Subject, difference: &Difference) -> Mistake {
    // Of two lists the one in the smaller unit has the larger numbers: metres are the rule.
    let of_unit = |metres: f64| if metres < 1.0 { (other, one, metres) } else { (one, other, 1.0 / metres) };
    let times = |who: Subject, axes: std::ops::Range<usize>, factor: f64| -> Vec<Edit> {
        axes.map(|axis| who.edit(edit::Change::times(who.columns()[axis], factor))).collect()
    };
    let (kind, subject, value, [what, undo], mend) = match difference.relation {
        Relation::Unit(metres) => {
            let (who, against, metres) = of_unit(metres);
            let what = format!("{} are {} against {}", who.words(), unit(metres), lower(against));
            ("scale", who, Some(1.0 / metres), [what, "Convert them to metres".into()], times(who, 0..3, metres))
        }
        Relation::HeightUnit(metres) => {
            let (who, against, metres) = of_unit(metres);
            let what = format!("Heights of {} are {} against {}", lower(who), unit(metres), lower(against));
            let undo = "Convert the heights to metres".into();
            ("height-scale", who, Some(1.0 / metres), [what, undo], times(who, 2..3, metres))
        }
        Relation::Exchanged(a, b) => {
            let what = format!("{}: {} and {} are exchanged against {}", other.words(), AXES[a], AXES[b], lower(one));
            let mend = edits_of(other, Change::Exchanged(a, b));
            ("axes-exchanged", other, None, [what, "Exchange the two columns".into()], mend)
        }
        Relation::Reversed(axis) => {
            let what = format!("{}: {} has the wrong sign against {}", other.words(), AXES[axis], lower(one));
            let mend = edits_of(other, Change::Reversed(axis));
            ("axis-reversed", other, None, [what, "Change the sign of this column".into()], mend)
        }
        _ => {
            let what = format!("{} and {} disagree", other.words(), lower(one));
            ("other-frame", other, None, [what, "Look at both".into()], Vec::new())
        }
    };
    let text = [format!("{what}."), format!("{undo} ({}).", subject.place())];
    let found = mistake(kind, subject.key(), Vec::new(), difference.drop, difference.ln_p, text).undone_by(mend);
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
    let remedy = format!("Look at the unit and the coordinate system of both ({}).", places(one, other));
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
    let remedy = format!("Look at the coordinate system of both ({}).", places(one, other));
    let found = mistake("rotation", other.key(), Vec::new(), difference.drop, difference.ln_p, [sentence, remedy]);
    with(found, degrees, None, "deg")
}

/// A group that is tilted.
pub fn tilt(one: Subject, other: Subject, difference: &Difference) -> Mistake {
    let degrees = difference.tilt.to_degrees();
    let sentence = format!(
        "{} are tilted by {degrees:.3} degrees against {}, while both agree with the images. The images \
         do not tell which of the two is wrong.",
        other.words(),
        lower(one)
    );
    let remedy = format!("Look at the coordinate system and the heights of both ({}).", places(one, other));
    let found = mistake("tilt", other.key(), Vec::new(), difference.drop, difference.ln_p, [sentence, remedy]);
    with(found, degrees, None, "deg")
}
