//! Rotations and their tangent space, in the one convention of the whole program.
//!
//! A rotation `R` (3x3) takes world to camera. A small change is a vector `w` (rad, camera axes) from the left:
//! `R <- exp([w]x) R`. The rotation vector `r` of `R` has `R = exp([r]x)`, `|r| <= pi`.
//!
//! Source: Solà, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018), eqs. 132-146.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Below this angle (rad) the Taylor series of the Jacobians' coefficients is exact to rounding: the first dropped
/// term is of the order of angle^4 / 1000 < 1e-19.
const SMALL_ANGLE: f64 = 1e-4;

/// The matrix `[v]x` with `[v]x a = v x a`.
pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// Rotation matrix of the rotation vector `r` (rad).
pub fn exp(r: &Vector3<f64>) -> Matrix3<f64> {
    Rotation3::from_scaled_axis(*r).into_inner()
}

/// Rotation vector (rad, length at most pi) of the rotation matrix `rotation`; accurate up to pi because it goes
/// through the quaternion.
pub fn log(rotation: &Matrix3<f64>) -> Vector3<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation)).scaled_axis()
}

/// Left Jacobian `J` of the exponential: `exp(r + dr) = exp([J dr]x) exp(r)` to first order.
pub fn left_jacobian(r: &Vector3<f64>) -> Matrix3<f64> {
    let angle2 = r.norm_squared();
    let angle = angle2.sqrt();
    let (a, b) = if angle < SMALL_ANGLE {
        (0.5 - angle2 / 24.0, 1.0 / 6.0 - angle2 / 120.0)
    } else {
        ((1.0 - angle.cos()) / angle2, (angle - angle.sin()) / (angle2 * angle))
    };
    let k = skew(r);
    Matrix3::identity() + k * a + k * k * b
}

/// Inverse of [`left_jacobian`]; finite for `|r| < 2 pi`.
pub fn left_jacobian_inverse(r: &Vector3<f64>) -> Matrix3<f64> {
    let angle2 = r.norm_squared();
    let angle = angle2.sqrt();
    let c = if angle < SMALL_ANGLE {
        1.0 / 12.0 + angle2 / 720.0
    } else {
        1.0 / angle2 - 0.5 / (angle * (0.5 * angle).tan())
    };
    let k = skew(r);
    Matrix3::identity() - k * 0.5 + k * k * c
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn samples() -> Vec<Vector3<f64>> {
        let near_pi = Vector3::new(1.0, 2.0, -0.5).normalize() * (std::f64::consts::PI - 1e-9);
        vec![
            Vector3::zeros(),
            Vector3::new(1e-6, -2e-6, 3e-6),
            Vector3::new(0.3, -0.2, 1.1),
            Vector3::new(3.1, 0.1, -0.2),
            near_pi,
        ]
    }

    #[test]
    fn log_inverts_exp_up_to_pi() {
        for r in samples() {
            assert_relative_eq!(exp(&log(&exp(&r))), exp(&r), epsilon = 1e-14);
            assert_relative_eq!(log(&exp(&r)).norm(), r.norm(), epsilon = 1e-8);
        }
    }

    #[test]
    fn left_jacobian_is_the_derivative_of_exp() {
        let step = 1e-6;
        for r in samples() {
            for axis in 0..3 {
                let mut dr = Vector3::zeros();
                dr[axis] = step;
                let turn = log(&(exp(&(r + dr)) * exp(&(r - dr)).transpose())) / (2.0 * step);
                assert_relative_eq!(turn, left_jacobian(&r).column(axis).into_owned(), epsilon = 1e-8);
            }
            assert_relative_eq!(left_jacobian(&r) * left_jacobian_inverse(&r), Matrix3::identity(), epsilon = 1e-9);
        }
    }
}
