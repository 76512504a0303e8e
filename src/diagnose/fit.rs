//! Fits of the diagnosis: by the native solver, as far as decisions see.

use crate::adjust::native::Native;
use crate::adjust::{AdjustError, CovarianceOf, Options, Solution, Solver};
use crate::block::Block;
use crate::measure::MeasureError;
use crate::model::Model;
use crate::problem::{Problem, ProblemError};
use crate::run::RunError;
use std::ops::ControlFlow;

/// A model fitted to a block.
#[derive(Clone)]
pub struct Fit {
    /// The model.
    pub model: Model,
    /// Its problem.
    pub problem: Problem,
    /// Its solution.
    pub solution: Solution,
}

impl Fit {
    /// `v'Pv`, priors of random values included.
    pub fn chi_square(&self) -> f64 {
        2.0 * self.solution.cost
    }
}

/// Change of chi-square at which a fit of the diagnosis stops: parameters are then known to a tenth of their sigma, and what is left of the
/// gradient the null model takes out of every score. The model that is handed on is solved to the last digit, by both solvers.
const CHI_SQUARE_CHANGE: f64 = 1e-2;

/// Options of a fit that decides.
pub(super) fn deciding(options: &Options) -> Options {
    Options {
        chi_square_change: options.chi_square_change.max(CHI_SQUARE_CHANGE),
        covariance: CovarianceOf::Nothing,
        ..options.clone()
    }
}

/// Fits with the native solver.
///
/// `near`: an earlier fit of the same images, to start from; another model's solution is nearer than the block's approximations.
pub fn fit(block: &Block, model: &Model, near: Option<&Fit>, options: &Options) -> Result<Fit, RunError> {
    let mut problem = Problem::new(block, model)?;
    if let Some(near) = near {
        problem.start_from(&near.problem, &near.solution.state);
    }
    Ok(solve(model, problem, options)?)
}

/// Fits a problem from its start values.
pub fn solve(model: &Model, problem: Problem, options: &Options) -> Result<Fit, AdjustError> {
    let solution = Native.solve(&problem, &deciding(options), &mut |_| ControlFlow::Continue(()))?;
    Ok(Fit { model: model.clone(), problem, solution })
}

/// Why a diagnosis failed.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// A fit failed.
    #[error(transparent)]
    Run(#[from] RunError),
}

impl From<AdjustError> for DiagnoseError {
    fn from(error: AdjustError) -> Self {
        Self::Run(error.into())
    }
}

impl From<MeasureError> for DiagnoseError {
    fn from(error: MeasureError) -> Self {
        AdjustError::from(error).into()
    }
}

impl From<ProblemError> for DiagnoseError {
    fn from(error: ProblemError) -> Self {
        Self::Run(error.into())
    }
}
