//! Comparison of two cameras of one sensor as vector fields over it, instead of coefficient by coefficient: different
//! coefficients can describe nearly the same camera.
//!
//! A camera maps a viewing ray (direction in the camera frame) to an image point `q`. At every grid point `q` of the
//! sensor:
//!
//! * **Whole camera** ([`Part::WholeCamera`]): the ray of `q` under camera A is found by undistorting; the vector is
//!   the image point of this ray under camera B minus `q`. It holds focal length, principal point and distortion
//!   together and is what a user of A instead of B does wrong in the image. This is the study's "variation of camera
//!   distortion correction": its homothety of 0.005 changes it by up to 15 px, which the distortion part alone cannot.
//! * **Whole camera up to a rotation** ([`Part::WholeCameraUpToRotation`]): the same after the one rotation of all rays
//!   that makes the sum of squared vectors least. A block absorbs a rotation in its poses without any consequence, so
//!   this is what remains.
//! * **Distortion part** ([`Part::Distortion`]): the correction of an image point is `c(q) = q - ideal(q)`, distorted
//!   minus ideal; the vector is `c_B(q) - c_A(q)`. Focal length does not enter, and the principal point only through
//!   the centre of distortion's own coordinates.
//!
//! The grid has the centres of `columns x rows` equal cells of the sensor. Standard deviations are with `n - 1`.

use crate::camera::{Interior, fraser, undistort::undistort};
use crate::math::rotation::{exp, log, skew};
use crate::math::statistics::{mean, rms, std};
use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// The rotation has converged at a step below this, rad: 1e-9 px at the study's focal length.
const CONVERGED_RAD: f64 = 1e-13;
/// Gauss-Newton iterations; three to five are needed.
const MAX_ITERATIONS: usize = 50;

/// Points over the sensor: centres of equal cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Cells across.
    pub columns: u32,
    /// Cells down.
    pub rows: u32,
}

impl Default for Grid {
    /// 64 x 48: cells of 80 px on the study's sensor.
    fn default() -> Self {
        Self { columns: 64, rows: 48 }
    }
}

impl Grid {
    /// Cell centres (px) on a sensor of `size` (px), row by row.
    pub fn points(&self, size: [f64; 2]) -> impl Iterator<Item = [f64; 2]> + use<> {
        let Self { columns, rows } = *self;
        let at = |i: u32, count: u32, length: f64| (f64::from(i) + 0.5) / f64::from(count) * length;
        (0..rows)
            .flat_map(move |row| (0..columns).map(move |column| [at(column, columns, size[0]), at(row, rows, size[1])]))
    }
}

/// What is compared: see the module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// Image point of the same ray, B minus A.
    WholeCamera,
    /// The same after the best rotation of the rays.
    WholeCameraUpToRotation,
    /// Distortion correction at the same image point, B minus A.
    Distortion,
}

/// One vector of the field.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FieldVector {
    /// Image point, px.
    pub at: [f64; 2],
    /// B minus A there, px.
    pub d: [f64; 2],
}

/// Lengths of the vectors, px.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FieldStatistics {
    /// Number of vectors.
    pub n: usize,
    /// Least.
    pub min: f64,
    /// Greatest.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Standard deviation about the mean, with `n - 1`.
    pub std: f64,
    /// Root mean square.
    pub rms: f64,
}

/// The difference of two cameras.
#[derive(Debug, Clone, PartialEq)]
pub struct DistortionField {
    /// What was compared.
    pub part: Part,
    /// The vectors, row by row.
    pub vectors: Vec<FieldVector>,
    /// Grid points where A has no ray or B no image of it: left out of the vectors.
    pub undefined: usize,
    /// The rotation (vector, rad) that takes rays of A to B; zero where none was estimated.
    pub rotation: Vector3<f64>,
    /// Statistics of the lengths.
    pub statistics: FieldStatistics,
}

/// Why two cameras cannot be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FieldError {
    /// Fewer than two grid points at which both cameras are defined.
    #[error("the cameras are both defined at {0} of the grid's points only")]
    Undefined(usize),
    /// No best rotation.
    #[error("no best rotation between the two cameras was found")]
    Rotation,
}

/// Compares camera `b` with camera `a` over a sensor of `size` (width and height, px).
///
/// # Errors
/// [`FieldError`].
pub fn compare(
    size: [f64; 2],
    a: &Interior,
    b: &Interior,
    grid: Grid,
    part: Part,
) -> Result<DistortionField, FieldError> {
    compare_at(&grid.points(size).collect::<Vec<_>>(), a, b, part)
}

/// [`compare`] at image points (px) of one's own choice; its `undefined` counts these.
///
/// # Errors
/// [`FieldError`].
pub fn compare_at(points: &[[f64; 2]], a: &Interior, b: &Interior, part: Part) -> Result<DistortionField, FieldError> {
    let mut rotation = Vector3::zeros();
    let vectors: Vec<FieldVector> = if part == Part::Distortion {
        let difference = |at: [f64; 2]| {
            let (ideal_a, ideal_b) = (undistort(a, at)?, undistort(b, at)?);
            Some(FieldVector { at, d: [ideal_a[0] - ideal_b[0], ideal_a[1] - ideal_b[1]] })
        };
        points.iter().filter_map(|&at| difference(at)).collect()
    } else {
        let rays: Vec<_> = points.iter().filter_map(|&at| Some((at, ray(a, at)?))).collect();
        if part == Part::WholeCameraUpToRotation {
            rotation = best_rotation(b, &rays).ok_or(FieldError::Rotation)?;
        }
        let turn = exp(&rotation);
        let image = |ray: &Vector3<f64>| fraser::project(b, (turn * ray).into());
        rays.iter()
            .filter_map(|(at, ray)| image(ray).map(|xy| FieldVector { at: *at, d: [xy[0] - at[0], xy[1] - at[1]] }))
            .collect()
    };
    if vectors.len() < 2 {
        return Err(FieldError::Undefined(vectors.len()));
    }
    let lengths: Vec<f64> = vectors.iter().map(|vector| vector.d[0].hypot(vector.d[1])).collect();
    let statistics = FieldStatistics {
        n: lengths.len(),
        min: lengths.iter().copied().fold(f64::INFINITY, f64::min),
        max: lengths.iter().copied().fold(0.0, f64::max),
        mean: mean(&lengths),
        std: std(&lengths),
        rms: rms(&lengths),
    };
    Ok(DistortionField { part, undefined: points.len() - vectors.len(), vectors, rotation, statistics })
}

/// Viewing ray (camera frame, `Z = 1`) of an image point.
fn ray(camera: &Interior, at: [f64; 2]) -> Option<Vector3<f64>> {
    let [u, v] = undistort(camera, at)?;
    Some(Vector3::new((u - camera[1]) / camera[0], (v - camera[2]) / camera[0], 1.0))
}

/// Rotation vector of the rays with the least squared vectors, by Gauss-Newton.
fn best_rotation(b: &Interior, rays: &[([f64; 2], Vector3<f64>)]) -> Option<Vector3<f64>> {
    let mut turn = Matrix3::identity();
    for _ in 0..MAX_ITERATIONS {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (at, ray) in rays {
            let turned = turn * ray;
            let Some(projection) = fraser::project_with_derivatives(b, turned.into()) else { continue };
            let by_point = Matrix2x3::from_fn(|i, j| projection.d_camera_point[i][j]);
            let jacobian = by_point * -skew(&turned);
            normal += jacobian.transpose() * jacobian;
            right += jacobian.transpose() * (Vector2::from(*at) - Vector2::from(projection.point));
        }
        let step = normal.cholesky()?.solve(&right);
        turn = exp(&step) * turn;
        if step.norm() < CONVERGED_RAD {
            return Some(log(&turn));
        }
    }
    None
}

#[cfg(test)]
#[path = "distortion_field_tests.rs"]
mod tests;
