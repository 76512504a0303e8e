//! Surveyed points against the adjusted block: residuals in object space and their statistics.
//!
//! Each control and check point is intersected from its marks with the adjusted images; where the block has a datum of
//! its own (free adjustment) a similarity estimated from the control points alone takes it into the survey's system. A
//! residual is computed minus surveyed.

use super::intersection::{Intersections, Method, intersect_surveyed};
use super::similarity::{Similarity, SimilarityError, SimilarityFit, target_from_source};
use super::{FailedIntersection, ImageModel};
use crate::block::{Block, PointId, Role};
use crate::math::statistics::{mean, rms, std};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// How the block comes into the survey's system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Alignment {
    /// It is there already (datum by control or GNSS).
    None,
    /// A similarity from the control points, weighted by `1 / sigma^2` of their surveyed coordinates (mean over x, y,
    /// z).
    FromControl,
    /// This one.
    Given(Similarity),
}

/// One surveyed point, compared.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckRow {
    /// Which point.
    pub point: PointId,
    /// Control or check.
    pub role: Role,
    /// Computed minus surveyed, m.
    pub d: Vector3<f64>,
    /// Surveyed coordinates, m.
    pub position: Vector3<f64>,
    /// Covariance of the computed coordinates (m^2) from the image measurements of the point alone.
    pub covariance: Matrix3<f64>,
}

/// Mean or standard deviation of the residuals, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lengths {
    /// Of dx.
    pub x: f64,
    /// Of dy.
    pub y: f64,
    /// Of dz.
    pub z: f64,
    /// Of the length of the horizontal residual: planimetry.
    pub xy: f64,
    /// Of the length of the residual: 3D.
    pub xyz: f64,
    /// Of |dz|: altimetry.
    pub abs_z: f64,
}

/// Root mean squares of the residuals, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RootMeanSquares {
    /// Of dx.
    pub x: f64,
    /// Of dy.
    pub y: f64,
    /// Of dz.
    pub z: f64,
    /// Of the length of the horizontal residual.
    pub xy: f64,
    /// Of the length of the residual.
    pub xyz: f64,
}

/// Statistics of the residuals of one role, with the keys of `summary.json`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Number of points.
    pub n: usize,
    /// Means.
    pub mean_m: Lengths,
    /// Standard deviations about these means, with `n - 1`; `null` for a single point.
    pub std_m: Option<Lengths>,
    /// Root mean squares.
    pub rms_m: RootMeanSquares,
}

impl Statistics {
    /// Of residual vectors (m); `None` of none.
    pub fn of(residuals: impl IntoIterator<Item = Vector3<f64>>) -> Option<Self> {
        let residuals: Vec<_> = residuals.into_iter().collect();
        if residuals.is_empty() {
            return None;
        }
        let list = |f: fn(&Vector3<f64>) -> f64| -> Vec<f64> { residuals.iter().map(f).collect() };
        let (x, y, z) = (list(|d| d.x), list(|d| d.y), list(|d| d.z));
        let (xy, xyz, abs_z) = (list(|d| d.x.hypot(d.y)), list(|d| d.norm()), list(|d| d.z.abs()));
        let lengths =
            |f: fn(&[f64]) -> f64| Lengths { x: f(&x), y: f(&y), z: f(&z), xy: f(&xy), xyz: f(&xyz), abs_z: f(&abs_z) };
        Some(Self {
            n: residuals.len(),
            mean_m: lengths(mean),
            std_m: (residuals.len() > 1).then(|| lengths(std)),
            rms_m: RootMeanSquares { x: rms(&x), y: rms(&y), z: rms(&z), xy: rms(&xy), xyz: rms(&xyz) },
        })
    }
}

/// All surveyed points of a block, compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Survey from block, where there is one.
    pub similarity: Option<Similarity>,
    /// Its estimation, for [`Alignment::FromControl`].
    pub fit: Option<SimilarityFit>,
    /// One row per intersected point, in the order of the points.
    pub rows: Vec<CheckRow>,
    /// Surveyed points that could not be intersected.
    pub failed: Vec<FailedIntersection>,
    /// The intersections, in the system of the adjusted poses, with the residuals of the marks.
    pub intersections: Intersections,
    /// Of the control points.
    pub control: Option<Statistics>,
    /// Of the check points.
    pub check: Option<Statistics>,
}

/// Intersects the surveyed points of `block` with the images of `model`, aligns and compares them.
///
/// Effects of the stages control and frame act before the similarity: the compared coordinates are
/// `alignment(model.surveyed(P))`.
///
/// # Errors
/// [`SimilarityError`] when a similarity from control points is asked for and they do not determine one.
pub fn compare(
    model: &impl ImageModel,
    block: &Block,
    alignment: Alignment,
    method: Method,
) -> Result<Comparison, SimilarityError> {
    let intersections = intersect_surveyed(model, block, method);
    let computed: Vec<_> = intersections.points.iter().map(|point| model.surveyed(&point.position)).collect();
    let fit = match alignment {
        Alignment::FromControl => Some(fit_to_control(block, &intersections, &computed)?),
        Alignment::None | Alignment::Given(_) => None,
    };
    let similarity = match alignment {
        Alignment::None => None,
        Alignment::Given(given) => Some(given),
        Alignment::FromControl => fit.as_ref().map(|fit| fit.similarity),
    };
    let aligned = similarity.unwrap_or_else(Similarity::identity);
    let rows: Vec<_> = intersections
        .points
        .iter()
        .zip(&computed)
        .map(|(intersection, computed)| {
            let surveyed = &block.surveyed[intersection.point.index()];
            CheckRow {
                point: intersection.point,
                role: surveyed.role,
                d: aligned.apply(computed) - surveyed.position,
                position: surveyed.position,
                covariance: aligned.apply_to_covariance(&intersection.covariance),
            }
        })
        .collect();
    let of_role = |role: Role| Statistics::of(rows.iter().filter(|row| row.role == role).map(|row| row.d));
    let (control, check) = (of_role(Role::Control), of_role(Role::Check));
    Ok(Comparison { similarity, fit, rows, failed: intersections.failed.clone(), intersections, control, check })
}

fn fit_to_control(
    block: &Block,
    intersections: &Intersections,
    computed: &[Vector3<f64>],
) -> Result<SimilarityFit, SimilarityError> {
    let (mut source, mut target, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    for (intersection, computed) in intersections.points.iter().zip(computed) {
        let point = &block.surveyed[intersection.point.index()];
        if point.role == Role::Control {
            source.push(*computed);
            target.push(point.position);
            weights.push(similarity_weight(block, intersection.point));
        }
    }
    target_from_source(&source, &target, Some(&weights))
}

/// Weight of a control point in the similarity of [`Alignment::FromControl`].
pub fn similarity_weight(block: &Block, point: PointId) -> f64 {
    let point = &block.surveyed[point.index()];
    let sigma_xy = point.sigma_xy.unwrap_or(block.sigma.control_xy_m);
    let sigma_z = point.sigma_z.unwrap_or(block.sigma.control_z_m);
    3.0 / (2.0 * sigma_xy * sigma_xy + sigma_z * sigma_z)
}

#[cfg(test)]
#[path = "checks_tests.rs"]
mod tests;
