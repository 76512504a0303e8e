//! The common turn of a step, taken exactly.
//!
//! A step is linear in its increments, and a linear turn of a whole block bends its rays by the square of the angle:
//! where positions ask for a turn that the tie points do not feel, steps would have to be small. So the mean turn
//! `omega` of the images' increments is taken out of the step, what is left is added, and the block then turns about
//! its centre as a rigid body:
//!
//! ```text
//! P' = c + Q (P + dP - omega x (P - c) - c),   R' = exp(w + R omega) R Q',   Q = exp(omega)
//! ```
//!
//! To first order that is the linear step.

use crate::problem::{Problem, State};
use nalgebra::{UnitQuaternion, Vector3};

/// See the [module](self).
pub struct Turn {
    omega: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
    centre: Vector3<f64>,
}

impl Turn {
    /// Of images' increments: `increments(i)` the rotation's of image `i`. No turn where an image is held to fix the
    /// datum: it must not move.
    pub fn of_step(problem: &Problem, state: &State, increments: impl Fn(usize) -> Vector3<f64>) -> Self {
        let mut turn = Self { omega: Vector3::zeros(), rotation: UnitQuaternion::identity(), centre: Vector3::zeros() };
        let moving = |image: &usize| problem.pose_free[*image] == [true; 6];
        let images: Vec<usize> = (0..problem.pose_free.len()).filter(moving).collect();
        if problem.datum_defect > 0 || images.is_empty() {
            return turn;
        }
        let count = images.len() as f64;
        for &image in &images {
            let pose = &state.poses[image];
            turn.omega -= pose.rotation.inverse() * increments(image) / count;
            turn.centre += pose.centre / count;
        }
        turn.rotation = UnitQuaternion::from_scaled_axis(turn.omega);
        turn
    }

    /// Where a position comes that moves by `by`.
    pub fn position(&self, position: &Vector3<f64>, by: &Vector3<f64>) -> Vector3<f64> {
        let arm = position - self.centre;
        self.centre + self.rotation * (arm + by - self.omega.cross(&arm))
    }

    /// By what a position moves that comes from `before` to `after`.
    pub fn increment(&self, before: &Vector3<f64>, after: &Vector3<f64>) -> Vector3<f64> {
        let arm = before - self.centre;
        self.rotation.inverse() * (after - self.centre) - arm + self.omega.cross(&arm)
    }

    /// What `R` (camera from world) becomes that turns by `by` (camera axes).
    pub fn attitude(&self, attitude: &UnitQuaternion<f64>, by: &Vector3<f64>) -> UnitQuaternion<f64> {
        let own = UnitQuaternion::from_scaled_axis(by + attitude * self.omega);
        // Normalised each time: an error of the quaternion's length would grow from step to step.
        UnitQuaternion::new_normalize((own * attitude * self.rotation.inverse()).into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_increment_is_what_a_position_moves_by() {
        let omega = Vector3::new(0.01, -0.02, 0.03);
        let turn =
            Turn { omega, rotation: UnitQuaternion::from_scaled_axis(omega), centre: Vector3::new(5.0, 6.0, 7.0) };
        let (before, by) = (Vector3::new(10.0, -4.0, 2.0), Vector3::new(0.3, 0.1, -0.2));
        let found = turn.increment(&before, &turn.position(&before, &by));
        assert!((found - by).norm() < 1e-14, "{found}");
    }
}
