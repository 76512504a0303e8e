//! Height errors of the check points against what the block's own errors allow. Descriptive: check points decide
//! nothing.
//!
//! The errors of a right model are no independent errors of single points. Those of cameras, poses and datum are
//! common to all of them: a block on few control points bends and tilts as a whole, and a least-squares plane through
//! its check points is significant beyond their scatter in most blocks. So the patterns ([`patterns`]: mean and tilt;
//! a bowl or dome) are held against the covariance that the fit gives them,
//!
//! ```text
//! C = s0^2 (G'N^-1 G + marks) + survey        F = c'C^-1 c / k,  k and r degrees of freedom
//! ```
//!
//! with `c` the coefficients, `G` their derivatives by the unknowns of the fit ([`propagation`]), through the
//! similarity from the control points where the block is free ([`alignment`]), `N` the normal matrix, `r` the
//! redundancy of the fit and `s0^2` its variance factor `v'Pv / r`. Image measurements have the factors of the fit,
//! and the survey of the check points those of control. The survey is no observation of the fit: `s0` says nothing of
//! it.
//!
//! The block *allows* a dome up to the bound of that test at the level of significance, two-sided: `sqrt(F(1, r))`
//! times its standard deviation, 3.29 at 0.001. Whatever is beyond it is a p-value below the level, and the other way
//! round.

pub mod alignment;
pub mod expected;
pub mod patterns;
pub mod propagation;
mod sentence;

use crate::adjust::AdjustError;
use crate::block::{Block, Role};
use crate::evaluate::Comparison;
use crate::math::statistics::{f_ln_sf, f_quantile};
use crate::model::{Loss, Model, TieWeights};
use crate::null_model::SharedBase;
use crate::problem::{Problem, State};
use crate::run::fit::Fit;
use crate::run::{self, RunError};
use crate::score::variance_factor;
use nalgebra::{DMatrix, DVector};
use patterns::{COEFFICIENTS, DOME, PLANE, Patterns};
use std::ops::Range;

/// Check points that a dome needs: twice its terms, so that one wrong point does not make it.
const LEAST: usize = 2 * COEFFICIENTS;

/// A fit, and its check points.
pub struct Adjusted<'a> {
    /// What was fitted to.
    pub block: &'a Block,
    /// What was fitted.
    pub model: &'a Model,
    /// Its problem.
    pub problem: &'a Problem,
    /// The solution.
    pub state: &'a State,
    /// Surveyed points against it.
    pub comparison: Option<&'a Comparison>,
    /// What its null models have in common.
    pub null_base: &'a SharedBase,
}

/// A test of a pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatternTest {
    /// F.
    pub statistic: f64,
    /// Degrees of freedom: coefficients.
    pub dof: usize,
    /// p-value.
    pub p_value: f64,
    /// Its natural logarithm, which does not underflow.
    pub ln_p_value: f64,
}

/// Height errors of the check points, tested.
#[derive(Debug, Clone, PartialEq)]
pub struct Heights {
    /// Check points.
    pub n: usize,
    /// Largest horizontal distance from their middle, m.
    pub reach_m: f64,
    /// Mean, tilt to the east, tilt to the north, and the dome beside them (negative: middle up), m; tilts and dome
    /// from the middle to [`Self::reach_m`].
    pub coefficients_m: [f64; COEFFICIENTS],
    /// Their standard deviations under the model, m.
    pub sigmas_m: [f64; COEFFICIENTS],
    /// Is there a plane, mean included?
    pub plane: PatternTest,
    /// Is there a bowl or dome?
    pub dome: PatternTest,
    /// The largest dome that the block allows at the level of significance, m.
    pub dome_allowed_m: f64,
    /// In words, for whoever reads the verdict.
    pub sentence: String,
}

/// Tests the height errors at a level of significance. `Err` within: why the block does not allow it.
///
/// # Errors
/// A state that cannot be evaluated, or at which the cameras are not determined.
pub fn heights(
    adjusted: &Adjusted<'_>,
    significance: f64,
    threads: usize,
) -> Result<Result<Heights, &'static str>, AdjustError> {
    let Adjusted { model, problem, comparison, .. } = *adjusted;
    let rows = || comparison.iter().flat_map(|comparison| &comparison.rows).filter(|row| row.role == Role::Check);
    let Some(comparison) = comparison.filter(|_| rows().count() >= LEAST) else {
        return Ok(Err("too few check points"));
    };
    if model.tie_weights != TieWeights::Unit || model.loss != Loss::None {
        return Ok(Err("the weights are not those of the measurements' precision: the fit has no covariance"));
    }
    let redundancy = problem.redundancy().2 as f64;
    if redundancy <= 0.0 {
        return Ok(Err("no redundancy"));
    }
    let patterns = match expected::patterns(adjusted, comparison, threads)? {
        Ok(patterns) => patterns,
        Err(why) => return Ok(Err(why)),
    };
    let covariance = patterns.covariance(variance_factor(patterns.chi_square, redundancy));
    let Patterns { functions, reach_m } = patterns.patterns;
    let errors = DVector::from_iterator(functions.nrows(), rows().map(|row| row.d.z));
    let coefficients = functions.transpose() * errors;
    let test = |range: Range<usize>| tested(&coefficients, &covariance, range, redundancy);
    let (Some(plane), Some(dome)) = (test(PLANE), test(DOME..DOME + 1)) else {
        return Ok(Err("the stated precisions of marks or survey give no covariance"));
    };
    let sigma = |k: usize| covariance[(k, k)].sqrt();
    let mut heights = Heights {
        n: functions.nrows(),
        reach_m,
        coefficients_m: std::array::from_fn(|k| coefficients[k]),
        sigmas_m: std::array::from_fn(sigma),
        plane,
        dome,
        dome_allowed_m: f_quantile(1.0 - significance, 1.0, redundancy).sqrt() * sigma(DOME),
        sentence: String::new(),
    };
    heights.sentence = sentence::sentence(&heights, problem, significance);
    Ok(Ok(heights))
}

/// [`heights`] of a quick fit.
///
/// # Errors
/// See there.
pub fn of_fit(
    block: &Block,
    fit: &Fit,
    significance: f64,
    threads: usize,
) -> Result<Result<Heights, &'static str>, RunError> {
    let Fit { model, problem, solution, null_base } = fit;
    let comparison = run::compare(block, problem, solution)?;
    let (state, comparison) = (&solution.state, comparison.as_ref());
    let adjusted = Adjusted { block, model, problem, state, comparison, null_base };
    Ok(heights(&adjusted, significance, threads)?)
}

/// F test that some coefficients are zero; `None` without a covariance.
fn tested(
    coefficients: &DVector<f64>,
    covariance: &DMatrix<f64>,
    of: Range<usize>,
    redundancy: f64,
) -> Option<PatternTest> {
    let (first, dof) = (of.start, of.len());
    let (own, covariance) = (coefficients.rows(first, dof), covariance.view((first, first), (dof, dof)).into_owned());
    let statistic = own.dot(&covariance.cholesky()?.solve(&own)) / dof as f64;
    let ln_p_value = f_ln_sf(statistic, dof as f64, redundancy).min(0.0);
    statistic.is_finite().then(|| PatternTest { statistic, dof, p_value: ln_p_value.exp(), ln_p_value })
}
