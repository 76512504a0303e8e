//! The conventions of a whole block compete: under the right one rays meet, by an order of magnitude better than as
//! recorded, and under no other.

use super::alternatives::{Alternative, alternatives};
use super::cause::{Cause, Table};
use super::focal;
use super::meet::{Misfit, misfit};
use super::same::same_rays;
use super::scene::Scene;
use crate::mistakes::BEYOND;

/// As recorded, rays must miss by more than that, rad: orientations of a flight controller are good to one degree, and
/// positions to a metre or two from a hundred, which is one degree as well.
const APPROXIMATE: f64 = 0.02;
/// Where rays meet to within that, px, poses come from an adjustment, and nothing is approximate: matching by machine
/// is good to one pixel.
const ADJUSTED_PX: f64 = 3.0;
/// Alternatives within this factor of the best are as good: the medians of a few hundred points differ by less.
const AS_GOOD: f64 = 2.0;

/// Rays that miss by less than that share of the spread of measurements (half a pixel of a thousand) meet: nothing
/// can be ten times better.
const MEET: f64 = 5e-4;

/// A convention that is wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Which.
    pub alternative: Alternative,
    /// How well rays meet as recorded.
    pub own: Misfit,
    /// And without the mistake.
    pub undone: Misfit,
    /// Alternatives that rays cannot tell from it.
    pub rivals: Vec<Alternative>,
}

/// An alternative with what it does.
struct Tried {
    alternative: Alternative,
    scene: Scene,
    misfit: Misfit,
    /// By how many times rays meet better.
    times: f64,
}

impl Tried {
    fn new(alternative: Alternative, scene: &Scene, own: &Misfit) -> Option<Self> {
        let undone = alternative.undone(scene)?;
        let misfit = misfit(&undone)?;
        let times = if alternative.is_unit { own.times_by_share(&misfit) } else { own.times(&misfit) };
        Some(Self { alternative, scene: undone, misfit, times })
    }

    /// Is the improvement beyond what approximate poses and a lens that is known roughly explain?
    fn is_mistake(&self, own: &Misfit) -> bool {
        let is_focal = matches!(self.alternative.causes[..], [Cause::Lens(super::lens::Lens::Focal(_))]);
        let beyond = if is_focal { focal::BEYOND } else { BEYOND };
        // Of coordinates in another unit the angle says nothing.
        let is_far = self.alternative.is_unit || own.angle > APPROXIMATE || self.misfit.px < ADJUSTED_PX;
        self.times > beyond && is_far
    }
}

/// The convention of a scene that is wrong; `None` where rays meet as recorded, where no alternative lets them meet,
/// and where two different ones do.
pub fn judge(scene: &Scene, table: Table) -> Option<Found> {
    let own = misfit(scene).filter(|own| own.share > MEET)?;
    let mut tried: Vec<Tried> = alternatives(scene, table)
        .into_iter()
        .filter_map(|alternative| Tried::new(alternative, scene, &own))
        .filter(|tried| tried.times > 1.0)
        .collect();
    if table == Table::Ties {
        tried.extend(focal::estimated(scene, &own).and_then(|one| Tried::new(one, scene, &own)));
    }
    let best = tried.iter().map(|one| one.times).fold(0.0, f64::max);
    // Still the most common first.
    let good: Vec<Tried> = tried.into_iter().filter(|one| one.times * AS_GOOD >= best).collect();
    let (first, others) = good.split_first()?;
    if !first.is_mistake(&own) || others.iter().any(|other| !same_rays(&first.scene, &other.scene)) {
        return None;
    }
    Some(Found {
        alternative: first.alternative.clone(),
        own,
        undone: first.misfit,
        rivals: others.iter().map(|other| other.alternative.clone()).collect(),
    })
}
