//! Refits: the model of a set of hypotheses fitted to the block, and its objective. What `(s, M)` promises counts
//! only here.

use super::added::Added;
use super::candidate::is_random;
use super::linearised::{Linearised, prior_information, without_candidates};
use super::models::{SMALLEST_DEVIATION, at_approximations, at_solution, with_members};
use super::objective::{Members, Objective};
use super::select::{Nature, Taken};
use super::settings::Settings;
use super::single;
use crate::adjust::Options;
use crate::block::Block;
use crate::problem::{Problem, ThetaEntry};
use crate::run::RunError;
use crate::run::fit::{Fit, fit, solve};
use crate::snooping::settle::SAME_MINIMUM;

/// Refits for the standard deviation of random values at most.
const VARIANCE_REFITS: usize = 3;
/// What an estimate of it leaves of the error of the last one, at most: it is of a linear problem, of which the next
/// fit moves the place alone.
const LEFT_OF_CHANGE: f64 = 0.1;
/// Change of a standard deviation, in its own relative uncertainty `1 / sqrt(2 n)`, that asks for another refit.
const VARIANCE_CHANGE: f64 = 0.1;
/// Iterations of a refit at most: five times what one takes that starts where nearly the same model ended.
const REFIT_ITERATIONS: usize = 50;
/// A refit that ends this far from its first order (as a multiple of the drop) is nonlinear: its start says nothing
/// of which minimum is the lower.
const NONLINEAR: f64 = 0.5;

/// A fitted set of hypotheses.
pub struct Refitted {
    /// The fit.
    pub fit: Fit,
    /// What the diagnosis has then taken in.
    pub added: Added,
    /// `J`.
    pub value: f64,
    /// The tie point in which most of the gain lies, where it has a large share: the objective is that of what
    /// remains without it.
    pub carrier: Option<String>,
}

/// What a refit starts from.
pub struct Refits<'a> {
    /// The block.
    pub block: &'a Block,
    /// The fit that was linearised.
    pub fit: &'a Fit,
    /// What it has taken in.
    pub added: &'a Added,
    /// Its linearisation.
    pub linearised: &'a Linearised,
    /// The objective there.
    pub objective: &'a Objective<'a>,
    /// The hypotheses in it.
    pub current: &'a Members,
    /// Settings of the diagnosis.
    pub settings: &'a Settings<'a>,
}

impl Refits<'_> {
    /// `J` of the fit as it stands.
    pub fn value_of_current(&self) -> f64 {
        self.value(self.fit, self.current)
    }

    /// `J` of a fit with some members.
    fn value(&self, fit: &Fit, members: &Members) -> f64 {
        let objective = self.objective;
        objective.misfit(fit.chi_square() + implausibility(fit, self.added.own))
            + objective.log_determinant(members)
            + objective.price(members)
    }

    /// Fits some members from the present solution.
    ///
    /// # Errors
    /// A fit that fails.
    pub fn refit(&self, members: &Members) -> Result<Refitted, RunError> {
        let Self { block, fit: from, linearised, objective, settings, .. } = *self;
        let taken = |h: usize, variance: f64| Taken { set: objective.hypotheses[h].set, variance };
        let laws = members.laws.iter().map(|h| taken(*h, 0.0));
        let random = members.random.iter().map(|(h, variance)| taken(*h, *variance));
        let mut situation = linearised.situation(settings);
        situation.taken = laws.chain(random).collect();
        let values = linearised.solution(&situation);
        let mut added = self.added.clone();
        let model = with_members(block, from, linearised, &situation, &values, &mut added)?;
        let problem = Problem::near(block, &model, Some((&from.problem, &from.solution.state)))?;
        let few = Options {
            max_iterations: REFIT_ITERATIONS.min(settings.options.max_iterations),
            ..settings.options.clone()
        };
        // A distortion that is missing may have driven the present fit far away: the block's approximations are the
        // second choice.
        let anew = || fit(block, &at_approximations(&model), None, &settings.options);
        let predicted = self.predicted_drop(members);
        let refitted = match solve(&model, problem, &few) {
            Err(error) => {
                if settings.options.stop.is_raised() {
                    return Err(error.into());
                }
                anew()?
            }
            Ok(near) => {
                let penalised = |fit: &Fit| fit.chi_square() + implausibility(fit, self.added.own);
                let drop = penalised(from) - penalised(&near);
                match (drop - predicted).abs() > NONLINEAR * predicted.abs().max(1.0 / NONLINEAR)
                    && !members.laws.is_empty()
                {
                    true => {
                        anew().ok().filter(|anew| anew.chi_square() < near.chi_square() - SAME_MINIMUM).unwrap_or(near)
                    }
                    false => near,
                }
            }
        };
        let fit = settle(block, refitted, &added, settings)?;
        let mut value = self.value(&fit, &members_of(&fit, members, objective));
        // What lies in one point alone a blunder there explains at least as well: an effect is worth what remains
        // without it.
        let carrier = single::carrier(from, &fit, &settings.options)?;
        if let Some(found) = &carrier {
            let drop = from.chi_square() - fit.chi_square();
            value += objective.misfit((1.0 - found.left) * drop).max(0.0);
        }
        let carrier = carrier.map(|found| found.point);
        Ok(Refitted { fit, added, value, carrier })
    }

    /// Drop of `v'Pv` and of how implausible the sizes are, to first order.
    fn predicted_drop(&self, members: &Members) -> f64 {
        self.objective.chi_square(self.current) - self.objective.chi_square(members)
    }
}

/// The members with the variances that a fit has.
fn members_of(fit: &Fit, members: &Members, objective: &Objective<'_>) -> Members {
    let mut members = members.clone();
    for (h, variance) in &mut members.random {
        let id = &objective.hypotheses[*h].id;
        let own = fit.problem.theta.iter().find(|entry| {
            entry.prior_sigma.is_some() && fit.problem.effects[entry.effect as usize].effect.descriptor().id == *id
        });
        if let Some(entry) = own {
            *variance = (entry.prior_sigma.unwrap_or(0.0) / entry.scale).powi(2);
        }
    }
    members
}

/// `theta' Lambda^-1 theta` of the laws that a diagnosis took in: how implausible their sizes are. Priors of random
/// values are in `v'Pv` already.
fn implausibility(fit: &Fit, own: usize) -> f64 {
    let problem = &fit.problem;
    let layout = problem.layout();
    let of_theta = problem.theta.iter().enumerate().filter(|(_, entry)| entry.effect as usize >= own && entry.free);
    let squared = |(t, entry): (usize, &ThetaEntry)| {
        let random = is_random(&problem.effects[entry.effect as usize].effect);
        let prior = prior_information(problem, layout.theta(t));
        if random { 0.0 } else { prior * ((fit.solution.state.theta[t] - entry.prior_mean) / entry.scale).powi(2) }
    };
    of_theta.map(squared).sum()
}

/// Fits again with the standard deviations of random values that the fit asks for.
///
/// # Errors
/// A fit that fails.
pub fn settle(block: &Block, mut fit: Fit, added: &Added, settings: &Settings<'_>) -> Result<Fit, RunError> {
    fit.model = at_solution(&fit);
    for _ in 0..VARIANCE_REFITS {
        if !fit.problem.theta.iter().any(|entry| has_variance(&fit.problem, entry, added.own)) {
            break;
        }
        let linearised = without_candidates(block, &fit, added, settings)?;
        let situation = linearised.situation(settings);
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

/// Is a parameter one of random values whose variance the diagnosis estimates?
fn has_variance(problem: &Problem, entry: &ThetaEntry, own: usize) -> bool {
    let random = is_random(&problem.effects[entry.effect as usize].effect);
    random && entry.effect as usize >= own && entry.prior_sigma.is_some()
}
