//! The normal equations at a state, points eliminated, and their Cholesky factor.

use super::factor::Factor;
use super::loss::Curvature;
use super::pattern::Pattern;
use super::point::Prepared;
use super::pool::Pool;
use super::rank::factor_of_full_rank;
use super::spare::Spare;
use super::structure::Structure;
use super::system::System;
use super::{frames, linearise};
use crate::adjust::{AdjustError, LinearSolver};
use crate::problem::{Problem, State};
use faer::MatMut;

/// The reduced normal equations of images and border, factorised. Unknowns are scaled: images by rank, then border.
pub(crate) struct NormalEquations {
    system: System,
    factor: Factor,
}

impl NormalEquations {
    /// Linearises and factorises at `state`. `structure`: the unknowns, and the effects that act.
    ///
    /// # Errors
    /// A singular problem; a state that cannot be projected.
    pub fn at(problem: &Problem, structure: &Structure, state: &State, pool: &Pool) -> Result<Self, AdjustError> {
        let frames = frames(problem, structure, state)?;
        let at = Prepared { problem, structure, state, frames: &frames };
        let system = pool.install(|| linearise::linearise(&at, 0.0, Curvature::Weights, &Spare::default()))?;
        let pattern = Pattern::of(structure, LinearSolver::Auto);
        let factor = factor_of_full_rank(problem, structure, &system, pattern.as_deref())?;
        Ok(Self { system, factor })
    }

    /// `v'Pv` at the state.
    pub fn chi_square(&self) -> f64 {
        self.system.chi_square
    }

    /// The right-hand side.
    pub fn rhs(&self) -> Vec<f64> {
        [&self.system.rhs_images[..], &self.system.rhs_border].concat()
    }

    /// Gauss-Newton step: of the images, and of the border.
    pub fn solve(&self) -> (Vec<f64>, Vec<f64>) {
        self.factor.solve()
    }

    /// Replaces other right-hand sides, column by column, by their solutions.
    pub fn solve_columns(&self, columns: MatMut<'_, f64>) {
        self.factor.solve_columns(columns);
    }
}
