//! Errors of check points as a fit and the stated precisions expect them, before anything is compared.

use super::patterns::{COEFFICIENTS, DOME, Patterns};
use super::{Adjusted, alignment, propagation};
use crate::adjust::AdjustError;
use crate::block::Role;
use crate::evaluate::Comparison;
use crate::null_model::NullModel;
use nalgebra::{DMatrix, Vector3};

/// Check points whose errors are computed one by one: the root mean square of their variances is then known to some
/// per cent.
const SAMPLE: usize = 100;

/// What measurements that err as stated do to check points.
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    /// Standard deviations of the differences between computed and surveyed coordinates, east, north, height, m: an
    /// even sample of the check points.
    pub sigmas_m: Vec<Vector3<f64>>,
    /// Standard deviation of a bowl or dome of the heights, m, from the middle to `reach_m`. Not known where the check
    /// points are few, or lie on a line.
    pub dome_m: Option<f64>,
    /// Largest horizontal distance of a check point from their middle, m.
    pub reach_m: Option<f64>,
}

/// The patterns of the check points' heights, and their covariance.
pub(super) struct OfPatterns {
    pub(super) patterns: Patterns,
    of_fit: DMatrix<f64>,
    survey: DMatrix<f64>,
    /// `v'Pv`.
    pub(super) chi_square: f64,
}

impl OfPatterns {
    /// With the variance factor of the image measurements.
    pub(super) fn covariance(&self, variance: f64) -> DMatrix<f64> {
        &self.of_fit * variance + &self.survey
    }
}

/// The patterns of the height errors under a fit; `Err` within: why the block does not allow it.
pub(super) fn patterns(
    adjusted: &Adjusted<'_>,
    comparison: &Comparison,
    threads: usize,
) -> Result<Result<OfPatterns, &'static str>, AdjustError> {
    let Adjusted { block, problem, state, null_base, .. } = *adjusted;
    let places: Vec<Vector3<f64>> = checks(comparison).map(|row| comparison.rows[row].position).collect();
    let Some(patterns) = Patterns::new(&places) else { return Ok(Err("the check points lie on a line or a circle")) };
    let Some(shares) = alignment::of_rows(block, comparison, &patterns.functions) else {
        return Ok(Err("the control points hardly determine the similarity"));
    };
    let Some(propagation) = propagation::propagate(adjusted, comparison, &shares)? else {
        return Ok(Err("a point that its marks hardly determine"));
    };
    let null = NullModel::sharing(null_base, problem.clone(), state.clone(), Vec::new(), threads)?;
    let of_fit = null.covariance_of(&propagation.gradients);
    let matrix = |of: &dyn Fn(usize, usize) -> f64| DMatrix::from_fn(COEFFICIENTS, COEFFICIENTS, of);
    Ok(Ok(OfPatterns {
        of_fit: matrix(&|i, j| of_fit[(i, j)] + propagation.marks[(i, j)]),
        survey: matrix(&|i, j| propagation.survey[(i, j)]),
        chi_square: null.chi_square(),
        patterns,
    }))
}

/// What measurements that err as stated do to the check points; `None` without any, or where they are not determined.
///
/// # Errors
/// A state that cannot be evaluated, or at which the cameras are not determined.
pub fn expected(adjusted: &Adjusted<'_>, threads: usize) -> Result<Option<Expected>, AdjustError> {
    let Some(comparison) = adjusted.comparison else { return Ok(None) };
    let patterns = patterns(adjusted, comparison, threads)?.ok();
    let rows: Vec<usize> = checks(comparison).collect();
    let null =
        NullModel::sharing(adjusted.null_base, adjusted.problem.clone(), adjusted.state.clone(), Vec::new(), threads)?;
    let mut sigmas_m = Vec::new();
    for own in (0..rows.len()).step_by(rows.len().div_ceil(SAMPLE).max(1)) {
        let Some(shares) = alignment::of_point(adjusted.block, comparison, rows[own]) else { return Ok(None) };
        let Some(propagation) = propagation::propagate(adjusted, comparison, &shares)? else { continue };
        let of_fit = null.covariance_of(&propagation.gradients);
        let variance = |k: usize| of_fit[(k, k)] + propagation.marks[(k, k)] + propagation.survey[(k, k)];
        sigmas_m.push(Vector3::from_fn(|k, _| variance(k).max(0.0).sqrt()));
    }
    let dome_m = patterns.as_ref().map(|own| own.covariance(1.0)[(DOME, DOME)].sqrt());
    let reach_m = patterns.map(|own| own.patterns.reach_m);
    Ok((!sigmas_m.is_empty()).then_some(Expected { sigmas_m, dome_m, reach_m }))
}

/// Rows of the check points.
fn checks(comparison: &Comparison) -> impl Iterator<Item = usize> {
    (0..comparison.rows.len()).filter(|row| comparison.rows[*row].role == Role::Check)
}
