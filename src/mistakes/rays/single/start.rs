//! Where an image starts: its approximate pose, taken into the network by its neighbours.

use super::super::scene::Scene;
use super::network::Known;
use crate::block::Pose;

/// Neighbours that are asked.
const NEIGHBOURS: usize = 3;

/// Good images that see most of the points of an image, the best first.
pub fn neighbours(scene: &Scene, known: &Known, view: usize) -> Vec<usize> {
    let mut common = vec![0_usize; scene.views.len()];
    for sights in scene.points.iter().filter(|sights| sights.iter().any(|sight| sight.view == view)) {
        sights.iter().for_each(|sight| common[sight.view] += 1);
    }
    let is_neighbour = |other: &usize| *other != view && !known.bad[*other] && common[*other] > 0;
    let mut others: Vec<usize> = (0..scene.views.len()).filter(is_neighbour).collect();
    others.sort_by_key(|other| std::cmp::Reverse(common[*other]));
    others.truncate(NEIGHBOURS);
    others
}

/// The approximate pose of an image in the network, as a neighbour sees it: the network may be turned and shifted
/// against the approximations.
pub fn brought(scene: &Scene, approximate: &[Pose], view: usize, neighbour: usize) -> Pose {
    let (of, by) = (&approximate[view], &approximate[neighbour]);
    let network = &scene.views[neighbour].pose;
    // World of the approximations from that of the network.
    let turn = by.rotation.inverse() * network.rotation;
    Pose { rotation: of.rotation * turn, centre: network.centre + turn.inverse() * (of.centre - by.centre) }
}

/// The same by all neighbours.
pub fn starts(scene: &Scene, approximate: &[Pose], known: &Known, view: usize) -> Vec<Pose> {
    let by = neighbours(scene, known, view).into_iter();
    by.map(|neighbour| brought(scene, approximate, view, neighbour)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::super::made;
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    #[test]
    fn a_turned_network_takes_the_approximations_along() {
        let scene = made::scene();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.2, 1.5));
        let shift = Vector3::new(5.0, 6.0, 7.0);
        let approximate: Vec<Pose> = scene
            .views
            .iter()
            .map(|v| Pose { rotation: v.pose.rotation * turn.inverse(), centre: turn * v.pose.centre + shift })
            .collect();
        let found = brought(&scene, &approximate, 4, 9);
        assert!((found.centre - scene.views[4].pose.centre).norm() < 1e-9);
        assert!(found.rotation.angle_to(&scene.views[4].pose.rotation) < 1e-9);
    }
}
