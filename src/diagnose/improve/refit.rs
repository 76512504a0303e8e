//! Refits of an improvement: with a set in the model, and with the standard deviations of random values that the fit asks for.

use super::super::added::Added;
use super::super::fit::{DiagnoseError, Fit, fit, solve};
use super::super::linearised::{Linearised, without_candidates};
use super::super::models::{at_approximations, at_solution, predicted_drop, with_set};
use super::super::select::{Beside, Nature, Situation, Taken};
use super::super::settings::Settings;
use super::super::settle::SAME_MINIMUM;
use super::Improvement;
use crate::adjust::Options;
use crate::block::Block;
use crate::problem::Problem;
use std::collections::BTreeSet;

/// Refits for the standard deviation of random values at most.
const VARIANCE_REFITS: usize = 3;
/// What an estimate of it leaves of the error of the last one, at most: it is of a linear problem, of which the next fit moves the place alone.
const LEFT_OF_CHANGE: f64 = 0.1;
/// Change of a standard deviation, in its own relative uncertainty `1 / sqrt(2 n)`, that asks for another refit.
const VARIANCE_CHANGE: f64 = 0.1;
/// Iterations of a refit at most: five times what one takes that starts where nearly the same model ended.
const REFIT_ITERATIONS: usize = 50;

/// A refit that takes more than this many times what its first order says away: the second order is as large as the first, and the start says
/// nothing of which minimum is the lower.
const NONLINEAR: f64 = 2.0;

/// Standard deviation (typical sizes) below which random values are none.
const SMALLEST_DEVIATION: f64 = 1e-4;

impl Improvement {
    /// The fit with a set in it, and what the diagnosis has then taken in.
    pub(super) fn refit(
        &self,
        block: &Block,
        linearised: &Linearised,
        situation: &Situation<'_>,
        beside: &Beside,
        set: usize,
        settings: &Settings<'_>,
    ) -> Result<(Fit, Added), DiagnoseError> {
        let chance = linearised.sets[set].nature == Nature::Chance;
        let mut with = situation.clone();
        with.taken.push(Taken { set, variance: 0.0, removable: true });
        if chance {
            let variance = linearised.variance(&with, set);
            with.taken.last_mut().expect("just pushed").variance = variance;
        }
        let values = linearised.solution(&with);
        let mut parts = self.parts.clone();
        let (model, problem) = with_set(block, &self.fit, linearised, &with, set, &values, &mut parts)?;
        let few = Options {
            max_iterations: REFIT_ITERATIONS.min(settings.options.max_iterations),
            ..settings.options.clone()
        };
        // A distortion that is missing may have driven the base far away: the block's approximations are the second choice.
        let anew = || fit(block, &at_approximations(&model), None, &settings.options);
        let refitted = match solve(&model, problem, &few) {
            Err(_) if !chance => anew().map_err(DiagnoseError::from),
            Ok(near) if !chance && self.is_far(&near, linearised, situation, beside, set) => {
                Ok(anew().ok().filter(|anew| anew.chi_square() < near.chi_square() - SAME_MINIMUM).unwrap_or(near))
            }
            refitted => refitted.map_err(DiagnoseError::from),
        };
        Ok((self.settle(block, refitted?, &parts, settings)?, parts))
    }

    /// Did a refit with a law come so far that its first order said nothing of it?
    fn is_far(
        &self,
        refitted: &Fit,
        linearised: &Linearised,
        situation: &Situation<'_>,
        beside: &Beside,
        set: usize,
    ) -> bool {
        let Some(judged) = situation.judge(set, beside) else { return true };
        let by_chance = judged.dof * judged.inflation;
        let first_order = predicted_drop(linearised, beside, &judged) + by_chance;
        self.fit.chi_square() - refitted.chi_square() > NONLINEAR * first_order
    }

    /// Fits again with the standard deviations of random values that the fit asks for.
    pub(super) fn settle(
        &self,
        block: &Block,
        mut fit: Fit,
        parts: &Added,
        settings: &Settings<'_>,
    ) -> Result<Fit, DiagnoseError> {
        fit.model = at_solution(&fit);
        let random = |fit: &Fit| fit.problem.theta.iter().any(|entry| is_random(&fit.problem, entry));
        for _ in 0..VARIANCE_REFITS {
            if !random(&fit) {
                break;
            }
            let linearised = without_candidates(block, &fit, parts, settings)?;
            let situation = linearised.situation(settings, &BTreeSet::new());
            let mut problem = fit.problem.clone();
            let (mut known, mut last) = (true, true);
            for taken in situation.taken.iter().filter(|taken| situation.sets[taken.set].nature == Nature::Chance) {
                let set = &situation.sets[taken.set];
                let variance = linearised.variance(&situation, taken.set);
                let deviation = variance.sqrt().max(SMALLEST_DEVIATION);
                let change = (deviation / taken.variance.sqrt()).ln().abs();
                let allowed = VARIANCE_CHANGE / (2.0 * set.columns.len() as f64).sqrt();
                known &= change < allowed;
                last &= LEFT_OF_CHANGE * change < allowed;
                for entry in problem.theta.iter_mut() {
                    let of = &fit.problem.effects[entry.effect as usize];
                    if of.effect.descriptor().id == set.id && entry.prior_sigma.is_some() {
                        entry.prior_sigma = Some(deviation * entry.scale);
                    }
                }
            }
            if known {
                break;
            }
            problem.start = fit.solution.state.clone();
            fit = solve(&fit.model.clone(), problem, &settings.options)?;
            fit.model = at_solution(&fit);
            if last {
                break;
            }
        }
        Ok(fit)
    }
}

fn is_random(problem: &Problem, entry: &crate::problem::ThetaEntry) -> bool {
    let parameters = &problem.effects[entry.effect as usize].effect.descriptor().parameters;
    matches!(parameters[entry.parameter as usize].role, crate::effects::Role::Random(_)) && entry.prior_sigma.is_some()
}
