//! Alternatives that the rays of tie points cannot tell apart: their rays are the same, or mirror images of each
//! other as a whole.

use super::meet::direction;
use super::scene::Scene;
use crate::math::statistics::median;
use nalgebra::{Matrix3, Vector3};

/// Directions are the same up to that, rad, and centres up to this share of their extent: the principal point lies off
/// the centre of the sensor by a hundredth of its side, which is all that many conventions differ by.
const SAME: f64 = 0.02;
/// Rays that are compared, spread over the block.
const COMPARED: usize = 200;

/// Rays of a scene: some of its measurements, and the centres of all images.
struct Rays {
    directions: Vec<Vector3<f64>>,
    centres: Vec<Vector3<f64>>,
    extent: f64,
}

impl Rays {
    fn of(scene: &Scene) -> Self {
        let step = scene.sights().count().div_ceil(COMPARED).max(1);
        // A ray that does not exist is like no other.
        let lost = Vector3::repeat(f64::INFINITY);
        let directions = scene.sights().step_by(step).map(|sight| direction(scene, sight).unwrap_or(lost)).collect();
        let middle = [0, 1, 2].map(|axis| median(&scene.views.iter().map(|v| v.pose.centre[axis]).collect::<Vec<_>>()));
        let centres: Vec<Vector3<f64>> =
            scene.views.iter().map(|view| view.pose.centre - Vector3::from(middle)).collect();
        let extent = median(&centres.iter().map(|centre| centre.norm()).collect::<Vec<_>>());
        Self { directions, centres, extent }
    }

    /// Are they those of `other` after a change of axes?
    fn are(&self, other: &Self, axes: &Matrix3<f64>) -> bool {
        let apart = |own: &[Vector3<f64>], others: &[Vector3<f64>]| -> f64 {
            let lengths: Vec<f64> = own.iter().zip(others).map(|(a, b)| (axes * a - b).norm()).collect();
            // Rays that neither has.
            median(&lengths.into_iter().map(|length| if length.is_nan() { 0.0 } else { length }).collect::<Vec<_>>())
        };
        apart(&self.directions, &other.directions) < SAME
            && apart(&self.centres, &other.centres) <= SAME * self.extent.max(other.extent)
    }
}

/// Do two scenes of the same measurements have the same rays, but for an exchange and a reversal of axes of the world?
pub fn same_rays(one: &Scene, other: &Scene) -> bool {
    let (one, other) = (Rays::of(one), Rays::of(other));
    changes_of_axes().iter().any(|axes| one.are(&other, axes))
}

/// All changes of the three axes, reflections included.
fn changes_of_axes() -> Vec<Matrix3<f64>> {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut all = Vec::with_capacity(48);
    for order in orders {
        for signs in 0..8 {
            let sign = |axis: usize| if signs >> axis & 1 == 1 { -1.0 } else { 1.0 };
            all.push(Matrix3::from_fn(|row, column| if order[row] == column { sign(row) } else { 0.0 }));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::super::cause::Cause;
    use super::super::coordinates::Coordinates;
    use super::super::made;
    use super::super::orientation::Orientation;
    use super::*;

    fn changed(scene: &Scene, causes: &[Cause]) -> Scene {
        let mut changed = scene.clone();
        causes.iter().for_each(|cause| cause.undo(&mut changed).expect("a change"));
        changed
    }

    #[test]
    fn two_reflections_are_a_turn_of_the_camera() {
        let scene = made::scene();
        let [up, mirrored] = [Coordinates::YUp, Coordinates::Mirrored].map(Cause::Coordinates);
        let turn = Cause::Orientation(Orientation::Axes { backwards: false, quarters: 2 });
        assert!(same_rays(&changed(&scene, &[up, mirrored]), &changed(&scene, &[turn])));
        assert!(same_rays(&scene, &changed(&scene, &[turn, turn])));
        assert!(!same_rays(&changed(&scene, &[up]), &changed(&scene, &[mirrored])));
        assert!(!same_rays(&scene, &changed(&scene, &[up])));
    }

    #[test]
    fn a_mirrored_world_is_the_same_to_its_rays() {
        let scene = made::scene();
        let mut mirrored = scene.clone();
        // Mirrored in y: images upside down, rotations and positions mirrored.
        Cause::Coordinates(Coordinates::YUp).undo(&mut mirrored).expect("a change");
        for view in &mut mirrored.views {
            let [x, y, z, w]: [f64; 4] = view.pose.rotation.coords.into();
            let turned = nalgebra::Quaternion::new(w, -x, y, -z);
            view.pose.rotation = nalgebra::UnitQuaternion::new_normalize(turned);
            view.pose.centre.y = -view.pose.centre.y;
        }
        assert!(same_rays(&scene, &mirrored));
    }
}
