//! Are the approximate poses in the system of the survey? Another program may leave them in a system of its own, which
//! the adjustment brings there.

use super::tables::Tables;
use crate::math::statistics::median;
use nalgebra::Vector3;

/// Positions that tell it: as many as a similarity needs.
const FEWEST: usize = 3;
/// Share of the extent of a flight by which approximate poses may be off in plan: receivers and start values are good
/// to metres, and a flight is long by a hundred. Poses in a system of their own are off by about half of the extent.
const NEAR: f64 = 0.1;

/// Diagonal of the box that holds places, m.
pub fn extent(places: &[Vector3<f64>]) -> f64 {
    let Some(first) = places.first() else { return 0.0 };
    let (low, high) = places.iter().fold((*first, *first), |(low, high), place| (low.inf(place), high.sup(place)));
    (high - low).norm()
}

/// Do the poses lie in plan where GNSS positions or surveyed points say? Heights are not asked: they may be what is
/// wrong.
pub fn poses(tables: &Tables) -> bool {
    let gnss = tables.images.iter().filter_map(|image| Some((image.gnss?, image.centre)));
    let points = tables.surveyed.iter().filter_map(|point| Some((point.position, point.met?)));
    agree(&gnss.collect::<Vec<_>>()) || agree(&points.collect::<Vec<_>>())
}

/// Do recorded and computed places agree in plan?
fn agree(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> bool {
    if pairs.len() < FEWEST {
        return false;
    }
    let plan = |place: &Vector3<f64>| Vector3::new(place.x, place.y, 0.0);
    let recorded: Vec<Vector3<f64>> = pairs.iter().map(|(recorded, _)| plan(recorded)).collect();
    let off: Vec<f64> = pairs.iter().map(|(recorded, computed)| plan(&(recorded - computed)).norm()).collect();
    median(&off) < NEAR * extent(&recorded)
}

#[cfg(test)]
mod tests {
    use super::super::tables::made;
    use super::*;

    #[test]
    fn poses_near_the_receiver_are_placed_and_others_are_not() {
        let mut tables = made::surveyed(&[]);
        assert!(poses(&tables));
        // Heights of another system change nothing.
        tables.images.iter_mut().for_each(|image| image.centre.z -= 500.0);
        assert!(poses(&tables));
        // A model about its own zero.
        tables.images.iter_mut().for_each(|image| image.centre = 0.02 * image.centre);
        assert!(!poses(&tables));
        tables.images.iter_mut().for_each(|image| image.gnss = None);
        assert!(!poses(&tables));
    }

    #[test]
    fn marks_that_meet_where_they_were_surveyed_place_the_poses() {
        let mut tables = made::surveyed(&[[0.0, 0.0, 0.0], [80.0, 0.0, 1.0], [0.0, 60.0, 2.0]]);
        tables.images.iter_mut().for_each(|image| image.gnss = None);
        assert!(!poses(&tables));
        tables.surveyed.iter_mut().for_each(|point| point.met = Some(point.position + Vector3::new(1.0, 1.0, 90.0)));
        assert!(poses(&tables));
    }
}
