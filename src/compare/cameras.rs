//! Two calibrations of one camera as a field over the sensor: coefficients differ where the cameras hardly do.

use crate::camera::{F, Interior};
use crate::evaluate::distortion_field::{DistortionField, FieldError, Grid, Part, compare_at};
use serde::Serialize;

/// Relative step of the derivative by the focal length.
const STEP: f64 = 1e-6;
/// Relative change of the focal length at which its fit has converged.
const CONVERGED: f64 = 1e-10;
/// Gauss-Newton steps; two or three are needed.
const MOST_STEPS: usize = 20;

/// Lengths of the vectors of a field, px.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lengths {
    /// Root mean square over the sensor.
    pub rms_px: f64,
    /// Greatest.
    pub max_px: f64,
}

impl Lengths {
    fn of(field: &DistortionField) -> Self {
        Self { rms_px: field.statistics.rms, max_px: field.statistics.max }
    }
}

/// How the image point of one viewing ray differs between two calibrations.
#[derive(Debug, Clone, Serialize)]
pub struct CameraDifference {
    /// Camera.
    pub camera: String,
    /// The cameras as they are.
    pub whole: Lengths,
    /// After the rotation of all rays that makes the field least: the orientations of the images absorb one.
    pub after_rotation: Lengths,
    /// After a rotation and a change of the focal length: flying heights absorb most of that.
    pub after_rotation_and_f: Lengths,
    /// The first rotation, mrad about the axes of the camera.
    pub rotation_mrad: [f64; 3],
    /// The change of the focal length, px.
    pub f_px: f64,
    /// The last field: place and difference, px.
    #[serde(skip)]
    pub field: Vec<([f64; 2], [f64; 2])>,
    /// Width and height of the sensor, px.
    #[serde(skip)]
    pub size: [f64; 2],
}

/// Compares the calibration `b` with `a` over a sensor of `size` px.
///
/// # Errors
/// Calibrations that are defined together nowhere on the sensor.
pub fn difference(camera: &str, size: [f64; 2], a: &Interior, b: &Interior) -> Result<CameraDifference, FieldError> {
    let points: Vec<[f64; 2]> = Grid::default().points(size).collect();
    let whole = compare_at(&points, a, b, Part::WholeCamera)?;
    let turned = compare_at(&points, a, b, Part::WholeCameraUpToRotation)?;
    let (f, last) = with_best_f(&points, a, b, turned.clone())?;
    Ok(CameraDifference {
        camera: camera.into(),
        whole: Lengths::of(&whole),
        after_rotation: Lengths::of(&turned),
        after_rotation_and_f: Lengths::of(&last),
        rotation_mrad: turned.rotation.map(|angle| 1e3 * angle).into(),
        f_px: b[F] - f,
        field: last.vectors.iter().map(|vector| (vector.at, vector.d)).collect(),
        size,
    })
}

/// The focal length of `b` with which the field is least, and that field; from the field of `b` as it is.
fn with_best_f(
    points: &[[f64; 2]],
    a: &Interior,
    b: &Interior,
    mut field: DistortionField,
) -> Result<(f64, DistortionField), FieldError> {
    let turned = |f: f64| {
        let mut camera = *b;
        camera[F] = f;
        compare_at(points, a, &camera, Part::WholeCameraUpToRotation)
    };
    let mut f = b[F];
    for _ in 0..MOST_STEPS {
        let stepped = turned(f * (1.0 + STEP))?;
        if stepped.vectors.len() != field.vectors.len() {
            break;
        }
        let (mut normal, mut right) = (0.0, 0.0);
        for (here, there) in field.vectors.iter().zip(&stepped.vectors) {
            for k in 0..2 {
                let by_f = (there.d[k] - here.d[k]) / STEP;
                normal += by_f * by_f;
                right -= by_f * here.d[k];
            }
        }
        let step = right / normal;
        if !step.is_finite() || step.abs() < CONVERGED {
            break;
        }
        f *= 1.0 + step;
        field = turned(f)?;
    }
    Ok((f, field))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{K1, PPX};

    const SIZE: [f64; 2] = [6000.0, 4000.0];

    fn camera() -> Interior {
        let mut camera = [0.0; 12];
        (camera[F], camera[PPX], camera[PPX + 1]) = (7500.0, 3000.0, 2000.0);
        (camera[PPX + 2], camera[PPX + 3], camera[K1]) = (3000.0, 2000.0, -1e-9);
        camera
    }

    #[test]
    fn one_calibration_does_not_differ_from_itself() {
        let same = difference("c", SIZE, &camera(), &camera()).expect("a field");
        assert!(same.whole.max_px < 1e-6 && same.f_px.abs() < 1e-6, "{same:?}");
    }

    #[test]
    fn a_rotation_absorbs_a_shift_and_f_a_scale_and_neither_a_distortion() {
        let mut shifted = camera();
        shifted[PPX] += 3.0;
        shifted[PPX + 2] += 3.0;
        let of = difference("c", SIZE, &camera(), &shifted).expect("a field");
        assert!((of.whole.rms_px - 3.0).abs() < 0.1, "{of:?}");
        // 3 px of 7500 px, about the y axis.
        assert!(of.after_rotation.rms_px < 0.4 && (of.rotation_mrad[1].abs() - 0.4).abs() < 0.05, "{of:?}");

        let mut longer = camera();
        longer[F] += 10.0;
        let of = difference("c", SIZE, &camera(), &longer).expect("a field");
        assert!(of.after_rotation.rms_px > 1.0 && of.after_rotation_and_f.rms_px < 1e-4, "{of:?}");
        assert!((of.f_px - 10.0).abs() < 1e-3, "{of:?}");

        let mut bent = camera();
        bent[K1] *= 1.1;
        let of = difference("c", SIZE, &camera(), &bent).expect("a field");
        assert!(of.after_rotation_and_f.rms_px > 0.2 * of.whole.rms_px, "{of:?}");
        assert!(of.after_rotation_and_f.rms_px <= of.after_rotation.rms_px + 1e-9, "{of:?}");
    }
}
