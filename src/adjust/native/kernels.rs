//! The passes of an iteration one by one, for measuring them: `cargo bench --bench kernels`. A solve puts them
//! together.

use super::bundle::{Bundle, BundleState};
use super::lm::Iterated;
use super::loss::Curvature;
use super::pattern::Pattern;
use super::pool::Pool;
use super::spare::Spare;
use super::structure::Structure;
use super::system::System;
use super::{frames, rank, structure};
use crate::adjust::{AdjustError, LinearSolver};
use crate::problem::Problem;
use std::sync::Arc;

/// Next to none, as near a solution.
const DAMPING: f64 = 1e-9;

/// A problem at its start values, with all that a pass needs of those before it.
pub struct Kernels<'a> {
    problem: &'a Problem,
    structure: Structure,
    pattern: Option<Arc<Pattern>>,
    pool: Pool,
    spare: Spare,
    start: BundleState,
    system: System,
    step: (Vec<f64>, Vec<f64>),
}

impl<'a> Kernels<'a> {
    /// Makes every pass once.
    ///
    /// # Errors
    /// Start values that cannot be projected; a singular problem.
    pub fn new(problem: &'a Problem, threads: usize) -> Result<Self, AdjustError> {
        let (structure, pool) = (structure(problem)?, Pool::new(threads)?);
        let pattern = Pattern::of(&structure, LinearSolver::Auto);
        let start = BundleState { state: problem.start.clone(), frames: frames(problem, &structure, &problem.start)? };
        let spare = Spare::default();
        let bundle = Bundle { problem, structure: &structure, pattern: pattern.as_deref(), pool: &pool, spare: &spare };
        let system = bundle.linearise(&start, DAMPING, Curvature::Weights)?;
        let step = rank::factor_of_full_rank(problem, &structure, &system, pattern.as_deref())?.solve();
        Ok(Self { problem, structure, pattern, pool, spare, start, system, step })
    }

    fn bundle(&self) -> Bundle<'_> {
        let Self { problem, structure, pattern, pool, spare, .. } = self;
        Bundle { problem, structure, pattern: pattern.as_deref(), pool, spare }
    }

    /// Derivatives of every measurement, its point eliminated at once: chi-square.
    ///
    /// # Errors
    /// None that [`Self::new`] has not had.
    pub fn linearise(&self) -> Result<f64, AdjustError> {
        let system = self.bundle().linearise(&self.start, DAMPING, Curvature::Weights)?;
        Ok(system.chi_square)
    }

    /// Factorises the reduced system and solves it: the Newton decrement; `None` where it is not positive definite.
    pub fn solve(&self) -> Option<f64> {
        let step = self.bundle().solve(&self.system, DAMPING)?;
        Some(self.system.decrement(&step))
    }

    /// Moves images, border and every point by the step, and projects the measurements there: chi-square; `None` where
    /// one cannot be projected.
    pub fn attempt(&self) -> Option<f64> {
        let attempt = self.bundle().attempt(&self.start, &self.system, &self.step, DAMPING, Curvature::Weights)?;
        Some(attempt.chi_square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adjust::Solver;
    use crate::adjust::native::Native;
    use crate::model::{Datum, Model};
    use crate::scenario::{Scenario, add_noise, simulate};
    use std::collections::BTreeMap;

    #[test]
    fn each_pass_does_what_it_says() {
        let scenario = Scenario::preset("closerange", &BTreeMap::from([("points".into(), 60.0)])).expect("a preset");
        let mut block = simulate(&scenario, 1).expect("a block").block;
        add_noise(&mut block, 0.3, 1).expect("noise");
        let problem = Problem::new(&block, &Model { datum: Datum::Free, ..Model::default() }).expect("a problem");
        let kernels = Kernels::new(&problem, 1).expect("passes");
        let residuals = Native.evaluate(&problem, &problem.start).expect("residuals").residuals;
        let chi_square: f64 = residuals.iter().map(|r| r * r).sum();
        let before = kernels.linearise().expect("a pass");
        assert!((before / chi_square - 1.0).abs() < 1e-12, "{before} for {chi_square}");
        // From the truth, noise is all that there is to follow: the model is as good as linear there.
        let drop = before - kernels.attempt().expect("a step");
        let decrement = kernels.solve().expect("positive definite");
        assert!(decrement > 0.0 && (drop / decrement - 1.0).abs() < 1e-2, "{drop} for {decrement}");
    }
}
