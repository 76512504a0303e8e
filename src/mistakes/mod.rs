//! What people got wrong: surveyed groups against the shape that the images alone give, and against each other.
//!
//! The images know the shape of the block up to a similarity. A *group* (control points, check points, GNSS positions)
//! that agrees with this shape after a similarity is recorded rightly, as far as its shape goes. One that does not
//! agree, and does after a change that people make by mistake (heights in feet, two axes exchanged, positions of the
//! neighbouring image), has this mistake. Two groups that both have the right shape must give the same similarity;
//! where they do not, the difference is named (a height of the ellipsoid beside one of the geoid, feet beside metres).
//!
//! ```text
//! survey (plain values) ──► collapsed ──► shape of each group ──► its members one by one ──► pairs of groups
//! ```
//!
//! **What separates a mistake from physics.** Rolling shutters, antennas beside the camera or a growing focal length
//! bend a block that ties alone hold, by centimetres to decimetres. This bending is measured in the block itself: it is
//! the misfit that stays beside the best alternative. A mistake is accepted only where it moves coordinates by an order
//! of magnitude more ([`BEYOND`]) than that and than a pixel on the object, and where the fall of the robust sum of
//! squares pays for the number of alternatives ([`price`]). What an effect of the catalogue explains at a plausible
//! size is left to that effect: GNSS positions that are off by metres in any direction are `gnss-shift`. Straight up by
//! what separates ellipsoid and geoid they are a mistake.
//!
//! Everything here works on small plain data and knows neither files nor solvers: `screening` orients the block.

mod align;
mod bend;
mod clock;
mod collapsed;

pub mod estimated_distortion;
mod few;
mod group;
mod judged;
pub mod lost;
pub mod marks;
mod members;
mod pair;
mod parts;
pub mod rays;
mod relation;
pub mod set_aside;
pub mod several_cameras;
mod shape;
mod survey;
mod undo;
pub mod values;
mod words;

pub use bend::surface_terms;
pub use few::are_few;
use pair::Gate;
pub use pair::with_value;
pub use survey::{Focal, Group, Member, Subject, Survey};

pub use crate::block::edit;
use crate::math::null_is_nan;
use edit::Edit;
use judged::{Few, Judged};
use serde::{Deserialize, Serialize};

/// How many times a mistake exceeds what stays unexplained beside it: an order of magnitude.
pub const BEYOND: f64 = 10.0;

/// Rounds of mending in a row. A mistake may hide another one, and seldom two; what four rounds do not end, edits make
/// anew.
pub const MOST_MENDS: usize = 4;

/// For a person, where [`MOST_MENDS`] rounds leave mistakes that can be undone.
pub fn mending_stopped() -> String {
    format!(
        "Mending stopped after {MOST_MENDS} rounds: each brought up another mistake. Look at those that are left \
         before you mend them, too."
    )
}

/// A mistake, in the keys that scripts rely on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mistake {
    /// What is wrong: `height-offset`, `exchanged`, ...
    pub kind: String,
    /// Which measurements: `control`, `check`, `gnss`, `images`, `marks`, `ties`.
    pub subject: String,
    /// Names of the points or images concerned; empty: all.
    pub names: Vec<String>,
    /// Its size, where there is one.
    pub value: Option<f64>,
    /// Standard deviation of `value`; null where the value is known exactly, or there is none.
    #[serde(default)]
    pub sigma: Option<f64>,
    /// Unit of `value`.
    pub unit: Option<String>,
    /// Fall of the robust sum of squares without the mistake.
    #[serde(deserialize_with = "null_is_nan")]
    pub drop: f64,
    /// Natural logarithm of the probability that chance reaches this fall, corrected for the number of alternatives.
    #[serde(deserialize_with = "null_is_nan")]
    pub ln_p: f64,
    /// For a person.
    pub sentence: String,
    /// What to do.
    pub remedy: String,
    /// Edits of the block's files that undo it; empty where a person has to look.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mend: Vec<Edit>,
}

impl Mistake {
    /// A mistake of everything of a subject, found without a test.
    pub fn new(kind: &str, subject: &str, sentence: String, remedy: String) -> Self {
        let (kind, subject) = (kind.to_string(), subject.to_string());
        Self {
            kind,
            subject,
            names: Vec::new(),
            value: None,
            sigma: None,
            unit: None,
            drop: f64::NAN,
            ln_p: f64::NAN,
            sentence,
            remedy,
            mend: Vec::new(),
        }
    }

    /// The same of some alone.
    pub fn of(self, names: Vec<String>) -> Self {
        Self { names, ..self }
    }

    /// The same with a size; `sigma`: none where it is known exactly.
    pub fn sized(self, value: f64, sigma: Option<f64>, unit: &str) -> Self {
        Self { value: Some(value), sigma, unit: Some(unit.into()), ..self }
    }

    /// The same with what a test says.
    pub fn tested(self, drop: f64, ln_p: f64) -> Self {
        Self { drop, ln_p, ..self }
    }

    /// The same with edits that undo it.
    pub fn undone_by(self, mend: Vec<Edit>) -> Self {
        Self { mend, ..self }
    }
}

/// Kinds of mistakes that compete. A mistake is as improbable beforehand as any other one.
pub const KINDS: f64 = 12.0;

/// Fall of the sum of squares that a mistake must reach at a level: `-2 ln(alpha / m / alternatives of its kind)`.
pub fn price(alpha: f64, alternatives: usize) -> f64 {
    -2.0 * (alpha / KINDS / alternatives.max(1) as f64).ln()
}

/// `ln p` of a fall: the level at which it just pays.
pub fn ln_p(drop: f64, alternatives: usize) -> f64 {
    (-0.5 * drop + (KINDS * alternatives.max(1) as f64).ln()).min(0.0)
}

/// Mistakes between surveyed groups that a bent network could make, too: an adjustment without one of the two has to
/// tell.
pub fn doubtful(survey: &Survey, alpha: f64) -> Vec<Mistake> {
    let judged: Vec<Judged> = survey.groups.iter().filter_map(|group| group::judge(group, survey, alpha)).collect();
    pair::judge_all(&judged, &[], survey, alpha, Gate::Doubtful)
}

/// Mistakes of the surveyed groups; none where the survey agrees with the images.
pub fn screen(survey: &Survey, alpha: f64) -> Vec<Mistake> {
    let mut found = Vec::new();
    let (mut judged, mut few, mut small) = (Vec::new(), Vec::new(), Vec::new());
    for group in &survey.groups {
        let (rest, collapsed) = collapsed::without(group, survey);
        found.extend(collapsed);
        few.extend(Few::of(&rest));
        if let Some(one) = group::judge(&rest, survey, alpha) {
            found.extend(one.mistakes.iter().cloned());
            judged.push(one);
        } else {
            small.push(rest);
        }
    }
    if judged.is_empty() {
        found.extend(small.iter().filter_map(|group| few::judge(group, survey)));
    }
    found.extend(members::exchanged_between(&judged, alpha));
    found.extend(pair::judge_all(&judged, &few, survey, alpha, Gate::Certain));
    // An exchange between two groups takes the place of what each of the two points was called alone.
    members::without_repetition(found)
}

#[cfg(test)]
mod tests;
