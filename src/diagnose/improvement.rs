//! A model on its way: its fit, what the diagnosis took in, and the ledger of how it came about. Check points only
//! watch.

use super::added::Added;
use super::competition::{Competition, Expected};
use super::heldout::held_out_px;
use super::hypothesis::Prices;
use super::ledger::{Change, Confirmation, Step};
use super::linearised::Linearised;
use super::models::at_solution;
use super::objective::{Members, Objective};
use super::refit::{Refits, Refitted, settle};
use super::settings::Settings;
use super::weights;
use crate::adjust::native::Native;
use crate::adjust::{AdjustError, CovarianceOf, Iteration, Options, Solution, Solver};
use crate::block::Block;
use crate::math::statistics::chi_square_ln_sf;
use crate::null_model::SharedBase;
use crate::run::RunError;
use crate::run::distortion_centre;
use crate::run::fit::{Fit, fit};
use std::ops::ControlFlow;

/// Weights after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Weights {
    /// From the residuals.
    Estimated,
    /// As they were.
    Kept,
}

/// A model on its way.
#[derive(Clone)]
pub struct Improvement {
    /// Ledger.
    pub steps: Vec<Step>,
    /// Refits that were tried, in order.
    pub confirmations: Vec<Confirmation>,
    /// The base fit.
    pub base: Fit,
    /// The fit as it stands.
    pub fit: Fit,
    /// Typical error of its predictions of left-out measurements, px.
    pub heldout_px: f64,
    /// Ids of what was added, in order of entry.
    pub added: Vec<String>,
    /// Effects and groups that the diagnosis took in.
    pub parts: Added,
    /// The objective, zero at the base.
    pub objective: f64,
    /// Lowest prices so far.
    pub prices: Prices,
}

impl Improvement {
    /// Begins with a fit of the base model.
    ///
    /// # Errors
    /// A fit that predicts nothing.
    pub fn new(block: &Block, base: Fit, settings: &Settings<'_>) -> Result<Self, RunError> {
        let own = base.model.effects.len();
        Self::with(block, base, Added { own, ..Added::default() }, settings)
    }

    /// Begins with a fit in which the effects and groups of `parts` were taken in before.
    ///
    /// # Errors
    /// A fit that predicts nothing.
    pub fn with(block: &Block, base: Fit, parts: Added, settings: &Settings<'_>) -> Result<Self, RunError> {
        let heldout_px = held_out_px(&base, settings.options.threads)?;
        let taken = base.model.effects.iter().skip(parts.own).map(|term| term.effect.descriptor().id.to_string());
        let added = taken.chain(parts.freed.keys().cloned()).collect();
        let mut improvement = Self {
            steps: Vec::new(),
            confirmations: Vec::new(),
            fit: base.clone(),
            // It is kept to be described: what it takes for granted need not be kept with it.
            base: Fit { null_base: SharedBase::default(), ..base },
            heldout_px,
            added,
            parts,
            objective: 0.0,
            prices: Prices::new(),
        };
        improvement.note(block, Change::Base, "")?;
        Ok(improvement)
    }

    /// Goes on with a refit; `gain`: what the objective changes by.
    pub(super) fn accept(
        &mut self,
        block: &Block,
        refitted: Refitted,
        change: Change,
        (expected, gain): (Expected, f64),
        weights: Weights,
        settings: &Settings<'_>,
    ) -> Result<(), RunError> {
        let drop = self.fit.chi_square() - refitted.fit.chi_square();
        (self.fit, self.parts) = (refitted.fit, refitted.added);
        if let Change::Exchanged { added, removed } = &change {
            self.added.retain(|id| !removed.contains(id));
            self.added.extend(added.iter().filter(|id| !self.added.contains(id)).cloned().collect::<Vec<_>>());
        }
        self.objective += gain;
        match weights {
            Weights::Estimated => {
                self.reweigh(block, settings)?;
            }
            Weights::Kept => self.heldout_px = held_out_px(&self.fit, settings.options.threads)?,
        }
        self.note(block, change, "")?;
        if let Some(step) = self.steps.last_mut() {
            (step.drop, step.predicted) = (drop, expected.drop);
            step.ln_p = chi_square_ln_sf(drop.max(0.0), expected.dof.max(1.0)).min(0.0);
        }
        Ok(())
    }

    /// Notes the prices of a linearisation. Where that of a member has fallen the objective falls with it: before the
    /// member was in, what it does looked like measurements that err together, and that made it dear.
    pub(super) fn note_prices(&mut self, competition: &Competition) {
        let ids = competition.current.all().map(|h| &competition.hypotheses[h].id);
        let before: Vec<(&String, f64)> = ids.filter_map(|id| Some((id, *self.prices.get(id)?))).collect();
        competition.note_prices(&mut self.prices);
        self.objective -= before.iter().map(|(id, price)| price - self.prices[*id]).sum::<f64>();
        if let Some(step) = self.steps.last_mut() {
            step.objective = self.objective;
        }
    }

    /// Takes in what somebody asks for, whatever the objective says of it.
    ///
    /// # Errors
    /// Why it cannot be taken in, in words; a refit that fails.
    pub fn add(
        &mut self,
        block: &Block,
        linearised: &Linearised,
        id: &str,
        settings: &Settings<'_>,
    ) -> Result<Result<(), String>, RunError> {
        let competition = Competition::new(linearised, &self.prices, settings);
        let objective = competition.objective(linearised);
        let current = &competition.current;
        if current.all().any(|h| competition.hypotheses[h].id == id) {
            return Ok(Err(format!("{id} is in the model already")));
        }
        let variants = (0..competition.hypotheses.len()).filter(|h| competition.hypotheses[*h].id == id);
        let members = variants.map(|h| match competition.hypotheses[h].random {
            true => objective.with_likeliest(current, h),
            false => current.with_law(h),
        });
        let best = members.min_by(|a, b| objective.value(a).total_cmp(&objective.value(b)));
        let Some(members) = best else {
            let untested = linearised.untested.iter().find(|candidate| candidate.id == id);
            return Ok(Err(match untested {
                Some(candidate) => format!("{id} needs {}", candidate.needs.join(", ")),
                None => format!("{id}: this block absorbs it, nothing of it could be estimated"),
            }));
        };
        self.change_to(block, linearised, (&competition, &objective), &members, settings).map(Ok)
    }

    /// Takes out an effect or a group that was taken in.
    ///
    /// # Errors
    /// A refit that fails.
    pub fn remove(
        &mut self,
        block: &Block,
        linearised: &Linearised,
        id: &str,
        settings: &Settings<'_>,
    ) -> Result<(), RunError> {
        let competition = Competition::new(linearised, &self.prices, settings);
        let objective = competition.objective(linearised);
        let of_id = competition.current.all().find(|h| competition.hypotheses[*h].id == id);
        let members = of_id.map_or(competition.current.clone(), |h| competition.current.without(h));
        self.change_to(block, linearised, (&competition, &objective), &members, settings)
    }

    /// Goes on with other members as somebody asks.
    fn change_to(
        &mut self,
        block: &Block,
        linearised: &Linearised,
        (competition, objective): (&Competition, &Objective<'_>),
        members: &Members,
        settings: &Settings<'_>,
    ) -> Result<(), RunError> {
        let current = &competition.current;
        let (fit, added) = (&self.fit.clone(), &self.parts.clone());
        let refits = Refits { block, fit, added, linearised, objective, current, settings };
        let refitted = refits.refit(members)?;
        let expected = Expected::of(objective, current, members);
        let gain = refitted.value - refits.value_of_current();
        let added = competition.ids_beyond(members, current);
        let removed = competition.ids_beyond(current, members);
        // Who asks for one change gets one.
        self.accept(block, refitted, Change::Exchanged { added, removed }, (expected, gain), Weights::Kept, settings)
    }

    /// The same model on other measurements; `gain`: what the objective changes by.
    ///
    /// # Errors
    /// A fit with random values that fails, one that predicts nothing.
    pub fn replace(
        &mut self,
        block: &Block,
        fit: Fit,
        why: &str,
        gain: f64,
        settings: &Settings<'_>,
    ) -> Result<(), RunError> {
        self.fit = settle(block, fit, &self.parts, settings)?;
        self.objective += gain;
        self.reweigh(block, settings)?;
        self.note(block, Change::Reweighted, why)
    }

    /// Estimates the weights as somebody asks. Did they change?
    ///
    /// # Errors
    /// A fit that predicts nothing.
    pub fn weigh(&mut self, block: &Block, settings: &Settings<'_>) -> Result<bool, RunError> {
        let changed = self.reweigh(block, settings)?;
        if changed {
            self.note(block, Change::Reweighted, "weights from the residuals")?;
        }
        Ok(changed)
    }

    /// Estimates the weights of groups of observations anew and fits again where they changed, as a part of the step
    /// that is under way. Where that fails they stay.
    fn reweigh(&mut self, block: &Block, settings: &Settings<'_>) -> Result<bool, RunError> {
        let refit = |now: &Fit| -> Result<Option<(Fit, f64)>, RunError> {
            let Some(weights) = weights::reweighted(block, now, &self.parts, settings)? else { return Ok(None) };
            let refitted = fit(block, &weights.model, Some(now), &settings.options)?;
            let gain = -(weights.gain + weights.gain_of_images);
            Ok(Some((settle(block, refitted, &self.parts, settings)?, gain)))
        };
        let mut changed = false;
        for _ in 0..weights::ROUNDS {
            match refit(&self.fit) {
                Ok(None) => break,
                Ok(Some((fit, gain))) => {
                    self.fit = fit;
                    self.objective += gain;
                    changed = true;
                }
                Err(error) if settings.options.stop.is_raised() => return Err(error),
                Err(error) => {
                    (settings.tell)(&format!("the weights stay as they are: {error}"));
                    break;
                }
            }
        }
        self.heldout_px = held_out_px(&self.fit, settings.options.threads)?;
        Ok(changed)
    }

    /// Solves the model as it stands to the last digit, and its row of the ledger with it. Where it does not come
    /// that far, the row stays.
    ///
    /// # Errors
    /// A centre of distortion that the block does not determine beside what is in.
    pub fn finish(&mut self, block: &Block, settings: &Settings<'_>) -> Result<(), RunError> {
        let Some(solution) = self.to_the_last_digit(settings)? else { return Ok(()) };
        (self.fit.solution, self.fit.null_base) = (solution, SharedBase::default());
        self.fit.model = at_solution(&self.fit);
        let Some(Step { change, why, drop, predicted, ln_p, iterations, .. }) = self.steps.pop() else { return Ok(()) };
        self.note(block, change, &why)?;
        if let Some(step) = self.steps.last_mut() {
            (step.drop, step.predicted, step.ln_p, step.iterations) = (drop, predicted, ln_p, iterations);
        }
        Ok(())
    }

    /// The solution of the model as it stands; `None` where an adjustment does not come that far.
    ///
    /// # Errors
    /// As [`Improvement::finish`].
    pub fn to_the_last_digit(&self, settings: &Settings<'_>) -> Result<Option<Solution>, RunError> {
        let mut problem = self.fit.problem.clone();
        problem.start = self.fit.solution.state.clone();
        let options = Options { covariance: CovarianceOf::Shared, ..settings.options.clone() };
        let solution = match Native.solve(&problem, &options, &mut |_| ControlFlow::Continue(())) {
            Ok(solution) => solution,
            Err(failure @ AdjustError::NotConverged { .. }) => {
                let go_on = &mut |_: &'static str, _: &Iteration| ControlFlow::Continue(());
                return match distortion_centre::explain(failure, &problem, &Native, &options, go_on) {
                    undetermined @ AdjustError::Singular { .. } => Err(undetermined.into()),
                    _ => Ok(None),
                };
            }
            Err(singular @ AdjustError::Singular { .. })
                if distortion_centre::makes_singular(&problem, &Native, &options) =>
            {
                return Err(singular.into());
            }
            Err(_) => return Ok(None),
        };
        distortion_centre::check(&problem, Native.name(), &solution)?;
        Ok(Some(solution))
    }

    /// Appends the fit as it stands to the ledger.
    fn note(&mut self, block: &Block, change: Change, why: &str) -> Result<(), RunError> {
        self.steps.push(Step::of(block, &self.fit, self.heldout_px, self.objective, change, why)?);
        Ok(())
    }
}
