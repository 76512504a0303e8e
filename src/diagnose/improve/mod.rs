//! Add and watch: the loop that carries out what the rules ask for, and keeps the ledger. Check points only watch.

mod contest;
mod ledger;
mod refit;
mod removal;
mod rivals;
mod single;

use contest::Contender;
pub use ledger::{Change, Confirmation, Step};

use super::added::Added;
use super::fit::{DiagnoseError, Fit, fit};
use super::heldout::held_out_px;
use super::linearised::{Linearised, linearise};
use super::models::{at_solution, predicted_drop};
use super::probability::probability;
use super::scan::Places;
use super::select::{Beside, Event, Nature, Situation, next};
use super::settings::Settings;
use super::weights;
use crate::adjust::native::Native;
use crate::adjust::native::null_model::SharedBase;
use crate::adjust::{AdjustError, CovarianceOf, Iteration, Options, Solver};
use crate::block::Block;
use crate::run::distortion_centre;
use std::collections::BTreeSet;
use std::ops::ControlFlow;

/// Effects that one improvement adds at most: more than this is not a diagnosis any more.
const MOST_EFFECTS: usize = 6;

/// A model on its way: its fit, and what is known of how it came about.
#[derive(Clone)]
pub struct Improvement {
    /// Ledger.
    pub steps: Vec<Step>,
    /// Refits, in order.
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
    refused: BTreeSet<String>,
    /// What was refused because it rests on one tie point, which may be wrong.
    on_one_point: BTreeSet<String>,
    /// Of a size that physics does not allow, and no refit beside what is in told what they are.
    unresolved: BTreeSet<String>,
    left_before: BTreeSet<String>,
    /// What stays although a rule asked for its removal: no fit without it succeeded.
    staying: BTreeSet<String>,
    /// Places on the sensor, where they were found last.
    places: Places,
}

impl Improvement {
    /// Begins with a fit of the base model.
    pub fn new(block: &Block, base: Fit, settings: &Settings<'_>) -> Result<Self, DiagnoseError> {
        let own = base.model.effects.len();
        Self::with(block, base, Added { own, ..Added::default() }, settings)
    }

    /// Begins with a fit in which the effects and groups of `parts` were taken in before.
    ///
    /// # Errors
    /// A fit that predicts nothing.
    pub fn with(block: &Block, base: Fit, parts: Added, settings: &Settings<'_>) -> Result<Self, DiagnoseError> {
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
            refused: BTreeSet::new(),
            on_one_point: BTreeSet::new(),
            unresolved: BTreeSet::new(),
            left_before: BTreeSet::new(),
            staying: BTreeSet::new(),
            places: Places::new(),
        };
        improvement.note(block, Change::Base, "")?;
        Ok(improvement)
    }

    /// Takes in and out what the rules ask for, until they ask for nothing. Gives the last linearisation, and whether places were searched in
    /// it; `first` keeps that of the base.
    ///
    /// While nothing enters or leaves, what has a place on the sensor stays where it was found: there it fits less well than it could, if at all.
    /// `search` looks for a better place before it counts that nothing enters, and one is looked for when such an effect is to enter.
    pub fn advance(
        &mut self,
        block: &Block,
        settings: &Settings<'_>,
        first: &mut Option<Linearised>,
        mut search: bool,
    ) -> Result<(Linearised, bool), DiagnoseError> {
        'fit: loop {
            (settings.tell)(&format!("testing what may be missing (step {})", self.steps.len()));
            if search {
                self.places.clear();
            }
            let searched = self.places.is_empty();
            let linearised = linearise(block, &self.fit, &self.parts, first.is_none(), &self.places, settings)?;
            self.places = linearised.places();
            loop {
                let situation = self.situation(&linearised, settings);
                let may_enter = self.added.len() < MOST_EFFECTS;
                match next(&situation) {
                    Some(Event::Added { set }) if linearised.is_placed(set) && !searched => search = true,
                    Some(Event::Added { set }) if may_enter => {
                        search = false;
                        self.take_in(block, &linearised, &situation, set, false, settings)?;
                        self.weigh(block, settings)?;
                        first.get_or_insert(linearised);
                    }
                    Some(Event::Resembled { set }) if may_enter => {
                        if !self.resolve(block, &linearised, &situation, set, settings)? {
                            continue;
                        }
                        self.weigh(block, settings)?;
                        first.get_or_insert(linearised);
                    }
                    Some(Event::Removed { id, why }) => {
                        self.let_go(block, &id, &why, settings)?;
                    }
                    _ => return Ok((linearised, searched)),
                }
                continue 'fit;
            }
        }
    }

    /// Takes in what somebody asks for, whatever the rules say of it.
    ///
    /// # Errors
    /// Why it cannot be taken in, in words; a refit that fails.
    pub fn add(
        &mut self,
        block: &Block,
        linearised: &Linearised,
        id: &str,
        settings: &Settings<'_>,
    ) -> Result<Result<(), String>, DiagnoseError> {
        let situation = linearised.situation(settings, &BTreeSet::new());
        let judged = situation.judge_all(&situation.beside());
        let Some(judged) = judged.iter().find(|judged| linearised.sets[judged.set].id == id) else {
            let untested = linearised.untested.iter().find(|candidate| candidate.id == id);
            return Ok(Err(match untested {
                Some(candidate) => format!("{id} needs {}", candidate.needs.join(", ")),
                None if situation.has(id) => format!("{id} is in the model already"),
                None => format!("{id}: this block absorbs it, nothing of it could be estimated"),
            }));
        };
        self.take_in(block, linearised, &situation, judged.set, true, settings)?;
        let refused = self.confirmations.last().filter(|confirmation| !confirmation.kept);
        Ok(refused.map_or(Ok(()), |refused| Err(format!("{id}: {}", refused.reason))))
    }

    /// What the rules see of a linearisation of the fit as it stands.
    pub(super) fn situation<'a>(&self, linearised: &'a Linearised, settings: &Settings<'_>) -> Situation<'a> {
        let mut situation = linearised.situation(settings, &self.refused());
        situation.unresolved.clone_from(&self.unresolved);
        for taken in &mut situation.taken {
            taken.removable &= !self.staying.contains(&linearised.sets[taken.set].id);
        }
        situation
    }

    /// Ids that may not enter any more.
    pub fn refused(&self) -> BTreeSet<String> {
        self.refused.union(&self.on_one_point).cloned().collect()
    }

    /// Was something refused because it rests on one tie point, which may be wrong?
    pub fn rests_on_a_point(&self) -> bool {
        !self.on_one_point.is_empty()
    }

    /// Refits with a set and with what it could be instead.
    fn take_in(
        &mut self,
        block: &Block,
        linearised: &Linearised,
        situation: &Situation<'_>,
        set: usize,
        asked_for: bool,
        settings: &Settings<'_>,
    ) -> Result<(), DiagnoseError> {
        (settings.tell)(&format!("adding {} and adjusting again", linearised.sets[set].id));
        let beside = situation.beside();
        let mut sets = vec![set];
        sets.extend(situation.rivals(set, &beside));
        if !asked_for {
            sets.extend(rivals::laws_of_the_lens(linearised, situation, set, &beside));
        }
        if let Some(best) = self.best_refit(block, linearised, situation, &beside, &sets, settings) {
            self.confirm(block, linearised, situation, &beside, best, asked_for, settings)?;
        }
        Ok(())
    }

    /// Refits with the laws of the lens that a law of impossible size could stand for. The surest enters where its refit is significant, too. Did one?
    fn resolve(
        &mut self,
        block: &Block,
        linearised: &Linearised,
        situation: &Situation<'_>,
        set: usize,
        settings: &Settings<'_>,
    ) -> Result<bool, DiagnoseError> {
        let shape = &linearised.sets[set].id;
        self.unresolved.insert(shape.clone());
        let beside = situation.beside();
        let laws = rivals::laws_of_the_lens(linearised, situation, set, &beside);
        if !laws.is_empty() {
            (settings.tell)(&format!("{shape} would be of an impossible size: adjusting with what looks like it"));
        }
        match self.best_refit(block, linearised, situation, &beside, &laws, settings) {
            Some(best) if self.ln_p(&best, situation, &beside) < situation.ln_level => {
                self.confirm(block, linearised, situation, &beside, best, false, settings)
            }
            _ => Ok(false),
        }
    }

    /// Judges the refit with a set; it stays where it takes something of v'Pv away, not of one tie point alone, or where it was `asked_for`. Does it?
    #[expect(clippy::too_many_arguments, reason = "what a judgement is made of")]
    fn confirm(
        &mut self,
        block: &Block,
        linearised: &Linearised,
        situation: &Situation<'_>,
        beside: &Beside,
        best: Contender,
        asked_for: bool,
        settings: &Settings<'_>,
    ) -> Result<bool, DiagnoseError> {
        let Contender { set, refitted } = best;
        let id = linearised.sets[set].id.clone();
        let judged = situation.judge(set, beside);
        let (predicted, ln_p) =
            judged.as_ref().map_or((0.0, 0.0), |judged| (predicted_drop(linearised, beside, judged), judged.ln_p));
        let mut confirmation = Confirmation {
            id: id.clone(),
            predicted,
            drop: 0.0,
            before_px: self.heldout_px,
            after_px: f64::NAN,
            kept: false,
            reason: String::new(),
        };
        match refitted.and_then(|(fit, parts)| Ok((held_out_px(&fit, settings.options.threads)?, fit, parts))) {
            Ok((heldout_px, fit, parts)) => {
                confirmation.drop = self.fit.chi_square() - fit.chi_square();
                confirmation.after_px = heldout_px;
                if confirmation.drop <= 0.0 {
                    confirmation.reason = "its refit takes nothing of v'Pv away".into();
                    self.refused.insert(id.clone());
                } else if let Some(judged) = judged.as_ref().filter(|_| situation.sets[set].nature == Nature::Law)
                    && let share = confirmation.drop.max(predicted) / judged.drop
                    && situation.ln_p_of_share(judged, beside, share) > situation.ln_level
                {
                    // Its test lets it be of any size, its refit of those that such an effect can have.
                    confirmation.reason =
                        "of a size that it can have, it takes no more of v'Pv away than chance".into();
                    self.refused.insert(id.clone());
                } else if let Some(judged) = judged.filter(|_| situation.sets[set].nature == Nature::Law)
                    && let Some(single::Carrier { point, left }) = single::carrier(&self.fit, &fit, &settings.options)?
                    && let ln_p = situation.ln_p_of_share(&judged, beside, left)
                    && ln_p > situation.ln_level
                {
                    confirmation.reason = format!(
                        "it rests on point {point} alone, where a blunder says as much (without it {})",
                        probability(ln_p)
                    );
                    self.on_one_point.insert(id.clone());
                }
                confirmation.kept = asked_for || confirmation.reason.is_empty();
                if confirmation.kept {
                    (self.fit, self.heldout_px, self.parts) = (fit, heldout_px, parts);
                    self.places.clear();
                    self.unresolved.clear();
                    self.added.push(id.clone());
                    self.note(block, Change::Added(id), "")?;
                    if let Some(step) = self.steps.last_mut() {
                        (step.drop, step.predicted, step.ln_p) = (confirmation.drop, predicted, ln_p);
                    }
                } else {
                    (settings.tell)(&format!("{id} is not kept: {}", confirmation.reason));
                }
            }
            Err(error) => {
                confirmation.reason = format!("its refit failed: {error}");
                (settings.tell)(&format!("{id} is not kept: {}", confirmation.reason));
                self.refused.insert(id);
            }
        }
        let kept = confirmation.kept;
        self.confirmations.push(confirmation);
        Ok(kept)
    }

    /// The same model on other measurements. What rested on a single point may rest on more of these.
    ///
    /// # Errors
    /// A fit with random values that fails, one that predicts nothing.
    pub fn measured_anew(
        &mut self,
        block: &Block,
        fit: Fit,
        why: &str,
        settings: &Settings<'_>,
    ) -> Result<(), DiagnoseError> {
        self.on_one_point.clear();
        self.staying.clear();
        self.replace(block, fit, why, settings)
    }

    /// The same model on other measurements, or with other weights.
    fn replace(&mut self, block: &Block, fit: Fit, why: &str, settings: &Settings<'_>) -> Result<(), DiagnoseError> {
        self.fit = self.settle(block, fit, &self.parts, settings)?;
        self.heldout_px = held_out_px(&self.fit, settings.options.threads)?;
        self.note(block, Change::Reweighted, why)
    }

    /// Estimates the weights of groups of observations anew; fits again where they changed. Where that fails they stay.
    pub fn weigh(&mut self, block: &Block, settings: &Settings<'_>) -> Result<(), DiagnoseError> {
        let refit = || -> Result<Option<Fit>, DiagnoseError> {
            let Some(model) = weights::reweighted(block, &self.fit, &self.parts, settings)? else { return Ok(None) };
            let refitted = fit(block, &model, Some(&self.fit), &settings.options)?;
            self.settle(block, refitted, &self.parts, settings).map(Some)
        };
        match refit() {
            Ok(None) => Ok(()),
            Ok(Some(fit)) => self.replace(block, fit, "weights from the residuals", settings),
            Err(error) => {
                (settings.tell)(&format!("the weights stay as they are: {error}"));
                Ok(())
            }
        }
    }

    /// Solves the model as it stands to the last digit, and its row of the ledger with it. Where it does not come that far, the row stays.
    ///
    /// # Errors
    /// A centre of distortion that the block does not determine beside what is in.
    pub fn finish(&mut self, block: &Block, settings: &Settings<'_>) -> Result<(), DiagnoseError> {
        let mut problem = self.fit.problem.clone();
        problem.start = self.fit.solution.state.clone();
        let options = Options { covariance: CovarianceOf::Shared, ..settings.options.clone() };
        let solution = match Native.solve(&problem, &options, &mut |_| ControlFlow::Continue(())) {
            Ok(solution) => solution,
            Err(failure @ AdjustError::NotConverged { .. }) => {
                let go_on = &mut |_: &'static str, _: &Iteration| ControlFlow::Continue(());
                return match distortion_centre::explain(failure, &problem, &Native, &options, go_on) {
                    undetermined @ AdjustError::Singular { .. } => Err(undetermined.into()),
                    _ => Ok(()),
                };
            }
            Err(singular @ AdjustError::Singular { .. })
                if distortion_centre::makes_singular(&problem, &Native, &options) =>
            {
                return Err(singular.into());
            }
            Err(_) => return Ok(()),
        };
        distortion_centre::check(&problem, Native.name(), &solution)?;
        (self.fit.solution, self.fit.null_base) = (solution, SharedBase::default());
        self.fit.model = at_solution(&self.fit);
        let Some(Step { change, why, drop, predicted, ln_p, iterations, .. }) = self.steps.pop() else { return Ok(()) };
        self.note(block, change, &why)?;
        if let Some(step) = self.steps.last_mut() {
            (step.drop, step.predicted, step.ln_p, step.iterations) = (drop, predicted, ln_p, iterations);
        }
        Ok(())
    }

    /// Appends the fit as it stands to the ledger.
    fn note(&mut self, block: &Block, change: Change, why: &str) -> Result<(), DiagnoseError> {
        self.steps.push(Step::of(block, &self.fit, self.heldout_px, change, why)?);
        Ok(())
    }
}
