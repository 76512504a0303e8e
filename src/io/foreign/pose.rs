//! Poses in other programs' forms.

use crate::block::Pose;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// A rotation matrix in a file may differ by this much from a true one in any element: eight decimals and a little
/// rounding. It is then taken for the nearest rotation, which moves an image point of a camera of 10 000 px by less
/// than a hundredth of a pixel.
const ORTHOGONALITY: f64 = 1e-6;

/// The pose of `X_cam = R X + t`.
pub fn from_translation(rotation: UnitQuaternion<f64>, translation: &Vector3<f64>) -> Pose {
    Pose { rotation, centre: -(rotation.inverse() * translation) }
}

/// `t` of `X_cam = R X + t`.
pub fn translation(pose: &Pose) -> Vector3<f64> {
    -(pose.rotation * pose.centre)
}

/// The rotation of a quaternion of any length; `None` for the length zero, and for what is no number.
pub fn from_quaternion([w, x, y, z]: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    let quaternion = Quaternion::new(w, x, y, z);
    let length = quaternion.norm();
    (length.is_finite() && length > f64::MIN_POSITIVE).then(|| UnitQuaternion::new_normalize(quaternion))
}

/// Components `w, x, y, z`, of the one of the two quaternions of a rotation that has `w >= 0`.
pub fn quaternion(rotation: &UnitQuaternion<f64>) -> [f64; 4] {
    let [x, y, z, w] = rotation.coords.into();
    if w < 0.0 { [-w, -x, -y, -z] } else { [w, x, y, z] }
}

/// The rotation of a matrix; `None` for one that mirrors, stretches or is no number.
pub fn from_matrix(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let error = (matrix * matrix.transpose() - Matrix3::identity()).abs().max();
    if !(error <= ORTHOGONALITY && matrix.determinant() > 0.0) {
        return None;
    }
    let mut rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*matrix));
    rotation.renormalize();
    Some(rotation)
}

/// Of a camera with y up that looks along -z, as in Bundler: half a turn about x takes its axes to ours and back.
pub fn half_turn_about_x(rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0)) * rotation
}

/// The rotation, world to our camera axes, of the angles (rad) of a camera with y up that looks along -z: `Rx(omega)
/// Ry(phi) Rz(kappa)` takes its axes to the world.
pub fn from_omega_phi_kappa([omega, phi, kappa]: [f64; 3]) -> UnitQuaternion<f64> {
    let about = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
    let world_from_cam =
        about(Vector3::x_axis(), omega) * about(Vector3::y_axis(), phi) * about(Vector3::z_axis(), kappa);
    half_turn_about_x(&world_from_cam.inverse())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn translation_and_centre_are_two_forms_of_one_pose() {
        let rotation = from_quaternion([0.4, -1.0, 2.0, 0.5]).unwrap();
        let t = Vector3::new(3.0, -2.0, 7.0);
        let pose = from_translation(rotation, &t);
        let point = Vector3::new(0.3, 40.0, -8.0);
        assert_relative_eq!(pose.cam_from_world(&point), rotation * point + t, epsilon = 1e-13);
        assert_relative_eq!(translation(&pose), t, epsilon = 1e-14);
    }

    #[test]
    fn only_rotations_are_taken_for_rotations() {
        let rotation = from_quaternion([0.4, -1.0, 2.0, 0.5]).unwrap();
        let matrix = rotation.to_rotation_matrix().into_inner();
        assert_relative_eq!(from_matrix(&matrix).unwrap().angle_to(&rotation), 0.0, epsilon = 1e-7);
        assert!(from_matrix(&-matrix).is_none());
        assert!(from_matrix(&(matrix * 1.001)).is_none());
        assert!(from_matrix(&matrix.map(|_| f64::NAN)).is_none());
        assert!(from_quaternion([0.0; 4]).is_none() && from_quaternion([f64::NAN; 4]).is_none());
    }

    #[test]
    fn half_a_turn_about_x_takes_y_up_to_y_down() {
        let rotation = from_quaternion([0.4, -1.0, 2.0, 0.5]).unwrap();
        let point = Vector3::new(0.3, 40.0, -8.0);
        let [ours, theirs] = [half_turn_about_x(&rotation) * point, rotation * point];
        assert_relative_eq!(ours, Vector3::new(theirs.x, -theirs.y, -theirs.z), epsilon = 1e-13);
    }
}
