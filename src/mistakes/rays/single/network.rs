//! A network of images whose rays meet: where each point lies by most of its rays, and images whose measurements do
//! not fit there.

use super::super::meet::{error, intersect};
use super::super::scene::{Scene, Sight};
use super::resect::Row;
use crate::math::statistics::median;
use crate::mistakes::BEYOND;
use nalgebra::Vector3;

/// Two rays intersected, of a point at most: of five rays these are all.
const MOST_PAIRS: usize = 10;
/// Rays below which nothing says which of them is wrong.
const FEWEST_RAYS: usize = 3;
/// Other images that must see a point where it lies before a measurement of it counts: one other ray meets the
/// examined one wherever that leads, so that the place follows the measurement.
const WITNESSES: usize = 2;
/// Error that counts as wrong without knowing the usual one, as a share of the sensor: what is larger costs no more.
const CAP: f64 = 0.02;
/// Measurements below which an image is not judged.
pub const FEWEST_ROWS: usize = 12;
/// A measurement fits within so many usual errors: of Rayleigh-distributed errors one in a hundred million does not.
pub const FITS: f64 = 5.0;
/// Usual errors below that are as good, px: nobody measures better.
const LEAST_USUAL_PX: f64 = 0.2;

/// What the rays of a network say.
pub struct Known {
    /// Place of each point by most of its rays.
    pub places: Vec<Option<Vector3<f64>>>,
    /// The usual error, px.
    pub usual: f64,
    /// Which images do not fit.
    pub bad: Vec<bool>,
}

/// What the rays of a network say without `suspects`, images that are known not to fit. `None` where there is nothing
/// to judge by.
pub fn known(scene: &Scene, suspects: &[usize]) -> Option<Known> {
    let all = |_: usize| true;
    let places: Vec<_> = scene.points.iter().map(|sights| place_of_most(scene, sights, &all, FEWEST_RAYS)).collect();
    let mut errors = vec![Vec::new(); scene.views.len()];
    for (sights, place) in scene.points.iter().zip(&places) {
        let Some(place) = place else { continue };
        sights.iter().for_each(|sight| errors[sight.view].push(error(scene, sight, place)));
    }
    let every: Vec<f64> = errors.iter().flatten().copied().collect();
    let usual = Some(median(&every)).filter(|usual| usual.is_finite())?.max(LEAST_USUAL_PX);
    let is_bad = |errors: &Vec<f64>| {
        let beyond = errors.iter().filter(|error| **error > BEYOND * usual).count();
        errors.len() >= FEWEST_ROWS && 2 * beyond > errors.len()
    };
    let bad: Vec<bool> = errors.iter().enumerate().map(|(view, own)| suspects.contains(&view) || is_bad(own)).collect();
    let good = |view: usize| !bad[view];
    let limit = FITS * usual;
    let again = |sights: &Vec<Sight>| {
        let place = place_of_most(scene, sights, &good, 2)?;
        let is_met = sights.iter().filter(|sight| good(sight.view)).filter(|s| error(scene, s, &place) < limit).count();
        (is_met >= 2).then_some(place)
    };
    let places = scene.points.iter().map(again).collect();
    Some(Known { places, usual, bad })
}

/// Rows of an image: its measurements of points that [`WITNESSES`] other images, none of them suspect, see where they
/// lie.
pub fn rows(scene: &Scene, known: &Known, view: usize, suspects: &[usize]) -> Vec<Row> {
    let limit = FITS * known.usual;
    let may = |sight: &&Sight| sight.view != view && !known.bad[sight.view] && !suspects.contains(&sight.view);
    let is_witnessed = |sights: &[Sight], place: &Vector3<f64>| {
        let met = sights.iter().filter(may).filter(|sight| error(scene, sight, place) < limit);
        let mut images: Vec<usize> = met.map(|sight| sight.view).collect();
        images.sort_unstable();
        images.dedup();
        images.len() >= WITNESSES
    };
    let mut rows = Vec::new();
    for (sights, place) in scene.points.iter().zip(&known.places) {
        let Some(place) = place else { continue };
        let own: Vec<&Sight> = sights.iter().filter(|sight| sight.view == view).collect();
        if !own.is_empty() && is_witnessed(sights, place) {
            rows.extend(own.into_iter().map(|sight| Row { place: *place, xy: sight.xy }));
        }
    }
    rows
}

/// The place where two rays meet that lies nearest to all of them; a wrong ray costs the same everywhere.
fn place_of_most(scene: &Scene, sights: &[Sight], may: &dyn Fn(usize) -> bool, fewest: usize) -> Option<Vector3<f64>> {
    let used: Vec<Sight> = sights.iter().filter(|sight| may(sight.view)).copied().collect();
    if used.len() < fewest.max(2) {
        return None;
    }
    let cost = |place: &Vector3<f64>| -> f64 {
        used.iter().map(|sight| error(scene, sight, place).min(CAP * scene.diagonal(sight))).sum()
    };
    let pairs: Vec<[Sight; 2]> =
        (0..used.len()).flat_map(|a| (0..a).map(move |b| (a, b))).map(|(a, b)| [used[a], used[b]]).collect();
    let step = pairs.len().div_ceil(MOST_PAIRS).max(1);
    let all = intersect(scene, &used).into_iter();
    let of_pairs = pairs.iter().step_by(step).filter_map(|pair| intersect(scene, pair));
    let best = all.chain(of_pairs).map(|place| (cost(&place), place)).min_by(|(a, _), (b, _)| a.total_cmp(b));
    let (least, place) = best?;
    // The rays that meet there, together.
    let near = used.iter().filter(|sight| error(scene, sight, &place) < CAP * scene.diagonal(sight));
    let near: Vec<Sight> = near.copied().collect();
    let together = intersect(scene, &near).filter(|together| cost(together) < least);
    Some(together.unwrap_or(place))
}

#[cfg(test)]
mod tests {
    use super::super::super::made;
    use super::*;

    const VIEW: usize = 7;

    #[test]
    fn a_measurement_counts_beside_two_other_rays_alone() {
        let scene = made::scene();
        let all = rows(&scene, &known(&scene, &[]).expect("points"), VIEW, &[]).len();
        assert!(all >= FEWEST_ROWS, "{all}");
        // Points of the image keep one other ray each: they follow the image, whatever it measures.
        let mut pairs = scene.clone();
        for sights in pairs.points.iter_mut().filter(|sights| sights.iter().any(|sight| sight.view == VIEW)) {
            let other = sights.iter().find(|sight| sight.view != VIEW).copied();
            sights.retain(|sight| sight.view == VIEW);
            sights.extend(other);
        }
        assert_eq!(rows(&pairs, &known(&pairs, &[]).expect("points"), VIEW, &[]), []);
        // Of suspects none is a witness.
        let others: Vec<usize> = (0..scene.views.len()).filter(|view| *view != VIEW).collect();
        assert_eq!(rows(&scene, &known(&scene, &[]).expect("points"), VIEW, &others), []);
    }
}
