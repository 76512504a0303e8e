//! What keeps tie points from being more precise: their own rays, poses and datum, or cameras.

use super::Spread;
use crate::adjust::Covariance;
use crate::problem::Problem;
use nalgebra::{DMatrix, Vector3};
use serde::Serialize;

/// Standard deviations that 95 % of the tie points would stay below if more were known than the block determines.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limits {
    /// Every pose, camera and effect is known: what the rays of each point leave, m.
    pub rays_m: f64,
    /// Every parameter of cameras and effects is known, poses are not, m.
    pub cameras_known_m: f64,
    /// The parameter of a camera or an effect that brings most where it is known; none without a free one.
    pub parameter: Option<String>,
    /// What is left where it is known, m.
    pub parameter_known_m: Option<f64>,
}

/// Variances of a point, m^2.
struct OfPoint {
    all: Vector3<f64>,
    rays: Vector3<f64>,
    cameras_known: Vector3<f64>,
    /// What each shared parameter takes of `all`.
    by_parameter: Vec<Vector3<f64>>,
}

/// In plan and in height, of the points `ties`; `None` where the parts of the covariance are not known.
pub(super) fn of_ties(problem: &Problem, covariance: &Covariance, ties: &[usize]) -> Option<[Limits; 2]> {
    let shared = covariance.shared.clone().cholesky()?;
    let of_point = |j: &usize| {
        let parts = covariance.point_parts.get(*j)?;
        let all = covariance.points[*j].diagonal();
        let with_shared = &parts.with_shared;
        // Of `X C^-1 X'` the diagonal: rows of `X L'^-1` squared.
        let mut whitened: DMatrix<f64> = DMatrix::from_fn(with_shared.ncols(), 3, |l, axis| with_shared[(axis, l)]);
        shared.l_dirty().solve_lower_triangular_mut(&mut whitened);
        let taken = Vector3::from_fn(|axis, _| whitened.column(axis).norm_squared());
        let by_parameter = with_shared.column_iter().enumerate();
        let by_parameter = by_parameter.map(|(l, x)| x.component_mul(&x) / covariance.shared[(l, l)]).collect();
        Some(OfPoint { all, rays: parts.rays.diagonal(), cameras_known: all - taken, by_parameter })
    };
    let points: Vec<OfPoint> = ties.iter().map(of_point).collect::<Option<_>>()?;
    let names: Vec<String> = covariance.shared_unknowns.iter().map(|unknown| problem.unknown_name(*unknown)).collect();
    let plan = limits(&points, &names, |variance| 0.5 * (variance.x + variance.y))?;
    Some([plan, limits(&points, &names, |variance| variance.z)?])
}

fn limits(points: &[OfPoint], names: &[String], along: impl Fn(&Vector3<f64>) -> f64) -> Option<Limits> {
    let worst = |of: &dyn Fn(&OfPoint) -> Vector3<f64>| {
        Some(Spread::of(points.iter().map(|own| along(&of(own)).max(0.0).sqrt()).collect())?.worst)
    };
    let known = |l: usize| Some((l, worst(&|own| own.all - own.by_parameter[l])?));
    let known: Vec<(usize, f64)> = (0..names.len()).map(known).collect::<Option<_>>()?;
    let best = known.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
    Some(Limits {
        rays_m: worst(&|own| own.rays)?,
        cameras_known_m: worst(&|own| own.cameras_known)?,
        parameter: best.map(|(l, _)| names[l].clone()),
        parameter_known_m: best.map(|(_, left)| left),
    })
}
