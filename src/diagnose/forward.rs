//! Add and watch: the best candidate enters the model, and stays only when its refit drops significantly, it is still needed beside the
//! others, and it predicts measurements that the fit did not see. Check points only watch.

use super::candidate::Candidate;
use super::fit::{DiagnoseError, Fit, fit, same_weights, screen_all, with_weights};
use super::heldout::HeldOut;
use super::models::{at_solution, without_effects};
use super::needed::not_needed;
use super::score::{INSEPARABLE, Score, Screening};
use super::trial::{Confirmation, Rescued, Tried, ln_level, rescue, try_candidate};
use super::verdict::shapes_left;
use crate::adjust::Options;
use crate::block::Block;
use crate::model::{EffectRef, Model, SigmaFactors};
use crate::run;
use std::collections::BTreeSet;

/// Effects that one improvement adds at most: more than this is not a diagnosis any more.
const MOST_EFFECTS: usize = 6;

/// Times that an effect may be taken out as not needed and come back: two that take each other's place would go on for ever.
const MOST_RETURNS: usize = 1;

/// What an improvement needs besides block and model.
pub struct Settings<'a> {
    /// Effects from plug-ins.
    pub plugins: &'a [EffectRef],
    /// Options of every fit.
    pub options: Options,
    /// Family-wise significance level.
    pub significance: f64,
    /// Told what is being done.
    pub tell: &'a dyn Fn(&str),
}

/// One row of the ledger.
#[derive(Debug, Clone)]
pub struct Step {
    /// Id of what was added; `None` for the base, `-id` for what was taken out again.
    pub added: Option<String>,
    /// Model of the step, start values those of its solution.
    pub model: Model,
    /// `sqrt(v'Pv / redundancy)`.
    pub sigma0: f64,
    /// RMS of tie residuals per coordinate, px.
    pub tie_rms_px: f64,
    /// RMS of predictions of left-out measurements, px.
    pub heldout_rms_px: f64,
    /// 3D RMS at check points, m.
    pub check_rms_m: Option<f64>,
    /// Drop of `v'Pv` since the step before.
    pub drop: f64,
    /// Logarithm of the p-value that let it in.
    pub ln_p: f64,
}

/// The steps of an improvement and where it ended.
pub struct Improvement {
    /// Ledger.
    pub steps: Vec<Step>,
    /// Refits, in order.
    pub confirmations: Vec<Confirmation>,
    /// Screenings, from that of the base model to that of the final one.
    pub screenings: Vec<Screening>,
    /// The base fit.
    pub base: Fit,
    /// The final fit, and what it predicts.
    pub fitted: Tried,
    /// Effects that are in the final model and were not in the base, in order of entry.
    pub added: Vec<String>,
    /// Weights as they were stated.
    stated: SigmaFactors,
}

/// Candidates that are significant family-wise and name a cause, best first.
pub fn significant(screening: &Screening, significance: f64) -> Vec<&Score> {
    let level = (significance / screening.scores.len().max(1) as f64).ln();
    screening.scores.iter().filter(|score| score.candidate.physical && score.ln_p < level).collect()
}

/// Runs the loop; `near` is an earlier fit to start from.
pub fn improve(
    block: &Block,
    model: &Model,
    near: Option<&Fit>,
    settings: &Settings<'_>,
) -> Result<Improvement, DiagnoseError> {
    let Settings { plugins, options, significance, tell } = settings;
    tell("adjusting the base model and estimating the weights");
    let stated = model.sigma_factors;
    let base = with_weights(block, fit(block, model, near, options)?, stated, plugins, options, *significance)?;
    let mut improvement = Improvement {
        steps: Vec::new(),
        confirmations: Vec::new(),
        screenings: Vec::new(),
        fitted: Tried::new(base.clone(), settings)?,
        base,
        added: Vec::new(),
        stated,
    };
    improvement.note(block, None, 0.0, 0.0)?;
    improvement.advance(block, &Allowed::default(), settings)?;
    Ok(improvement)
}

/// What may enter: everything significant by default.
#[derive(Default)]
struct Allowed {
    /// Ids that may not.
    banned: BTreeSet<String>,
    /// Logarithm of the p-value that an effect has to be below, besides the level.
    ln_p: f64,
}

impl Improvement {
    /// Adds effects until nothing significant is left that may enter.
    fn advance(&mut self, block: &Block, allowed: &Allowed, settings: &Settings<'_>) -> Result<(), DiagnoseError> {
        let Settings { plugins, options, significance, tell } = settings;
        let mut refused = allowed.banned.clone();
        loop {
            tell(&format!("testing what may be missing (step {})", self.steps.len()));
            let screening = screen_all(block, &self.fitted.fit, plugins, options.threads, *significance)?;
            let entered = self.added.len() < MOST_EFFECTS
                && (self.add_significant(block, &screening, allowed.ln_p, &mut refused, settings)?
                    || allowed.ln_p == 0.0 && self.add_rescued(block, &screening, settings)?);
            self.screenings.push(screening);
            if !entered {
                return Ok(());
            }
            // What was refused beside a smaller model may be needed beside this one.
            refused.clone_from(&allowed.banned);
            self.weigh(block, settings)?;
            if let Some(id) = not_needed(block, &self.fitted.fit, &self.added, settings)? {
                tell(&format!("{id} is not needed any more"));
                match self.take_out(block, std::slice::from_ref(&id), settings) {
                    Ok(()) => {
                        refused.insert(id);
                    }
                    Err(error) => tell(&format!("{id} stays, for without it: {error}")),
                }
            }
        }
    }

    /// Adds the first of the significant candidates that holds in its refit. Was there one?
    fn add_significant(
        &mut self,
        block: &Block,
        screening: &Screening,
        ln_p: f64,
        refused: &mut BTreeSet<String>,
        settings: &Settings<'_>,
    ) -> Result<bool, DiagnoseError> {
        for score in significant(screening, settings.significance) {
            let id = score.candidate.id.clone();
            if refused.contains(&id) || score.ln_p > ln_p || self.times_taken_out(&id) > MOST_RETURNS {
                continue;
            }
            (settings.tell)(&format!("adding {id} and adjusting again"));
            let level = ln_level(screening, settings);
            let (confirmation, after) = try_candidate(block, &self.fitted, score, level, settings);
            let drop = confirmation.drop;
            if !confirmation.kept {
                (settings.tell)(&format!("{id} is not kept: {}", confirmation.reason));
            }
            self.confirmations.push(confirmation);
            if let Some(after) = after {
                self.enter(block, id, after, drop, score.ln_p)?;
                return Ok(true);
            }
            refused.insert(id);
        }
        Ok(false)
    }

    /// Where a shape is left that no score explains, adds the effect whose refit does. Was there one?
    fn add_rescued(
        &mut self,
        block: &Block,
        screening: &Screening,
        settings: &Settings<'_>,
    ) -> Result<bool, DiagnoseError> {
        if shapes_left(screening, settings.significance).is_empty() {
            return Ok(false);
        }
        (settings.tell)("something is left that no score explains: refitting the effects of the image one by one");
        let rescued = rescue(block, &self.fitted, screening, settings, &mut self.confirmations);
        let Some(Rescued { id, drop, ln_p, after }) = rescued else { return Ok(false) };
        self.enter(block, id, after, drop, ln_p)?;
        Ok(true)
    }

    fn enter(&mut self, block: &Block, id: String, after: Tried, drop: f64, ln_p: f64) -> Result<(), DiagnoseError> {
        self.fitted = after;
        self.added.push(id.clone());
        self.note(block, Some(id), drop, ln_p)
    }

    /// What a new effect left in the residuals no longer passes for noise: estimates the weights anew. Control and positions are taken as stated
    /// at first: a factor that the missing effect inflated lets the block bend away from them, and would be believed.
    fn weigh(&mut self, block: &Block, settings: &Settings<'_>) -> Result<(), DiagnoseError> {
        let Settings { plugins, options, significance, tell } = settings;
        let now = self.fitted.fit.model.sigma_factors;
        let stated = SigmaFactors { image: now.image, ..self.stated };
        let begin = || match stated == now {
            true => Ok(self.fitted.fit.clone()),
            false => {
                let model = Model { sigma_factors: stated, ..self.fitted.fit.model.clone() };
                fit(block, &model, Some(&self.fitted.fit), options)
            }
        };
        let weighed = begin().map_err(DiagnoseError::from).and_then(|begin| {
            let fit = with_weights(block, begin, self.stated, plugins, options, *significance)?;
            let model = at_solution(&fit);
            Ok(if same_weights(model.sigma_factors, now) {
                None
            } else {
                Some(Tried::new(Fit { model, ..fit }, settings)?)
            })
        });
        match weighed {
            Ok(None) => {}
            Ok(Some(weighed)) => {
                self.fitted = weighed;
                // The ledger's row is that of the model as it goes on.
                if let Some(Step { added, drop, ln_p, .. }) = self.steps.pop() {
                    self.note(block, added, drop, ln_p)?;
                }
            }
            Err(error) => tell(&format!("the weights stay as they are: {error}")),
        }
        Ok(())
    }

    /// Takes effects out again. Errors: the smaller model cannot be fitted; everything stays.
    fn take_out(&mut self, block: &Block, ids: &[String], settings: &Settings<'_>) -> Result<(), DiagnoseError> {
        let without = without_effects(&self.fitted.fit.model, ids);
        let after = fit(block, &without, Some(&self.fitted.fit), &settings.options)?;
        let rise = 2.0 * (after.solution.cost - self.fitted.fit.solution.cost);
        self.fitted = Tried::new(after, settings)?;
        self.added.retain(|id| !ids.contains(id));
        let name = ids.iter().map(|id| format!("-{id}")).collect::<Vec<_>>().join(" ");
        self.note(block, Some(name), -rise, 0.0)
    }

    /// Takes out again what is less sure than what is left (`ln_p`, a logarithm of a p-value), now and when it was taken out before (`banned`).
    /// What had been taken out for its sake comes back where it is surer.
    pub fn go_on_without(
        &mut self,
        block: &Block,
        banned: &BTreeSet<String>,
        ln_p: f64,
        settings: &Settings<'_>,
    ) -> Result<(), DiagnoseError> {
        let ids: Vec<String> = self.added.iter().filter(|id| banned.contains(*id)).cloned().collect();
        self.take_out(block, &ids, settings)?;
        self.weigh(block, settings)?;
        self.advance(block, &Allowed { banned: banned.clone(), ln_p }, settings)
    }

    /// Logarithm of the p-value that let an added effect in.
    pub fn entry_ln_p(&self, id: &str) -> f64 {
        let entered = |step: &&Step| step.added.as_deref() == Some(id);
        self.steps.iter().rev().find(entered).map_or(0.0, |step| step.ln_p)
    }

    fn times_taken_out(&self, id: &str) -> usize {
        let name = format!("-{id}");
        self.steps.iter().filter(|step| step.added.as_ref() == Some(&name)).count()
    }

    /// Appends the fit as it stands to the ledger.
    fn note(&mut self, block: &Block, added: Option<String>, drop: f64, ln_p: f64) -> Result<(), DiagnoseError> {
        let Tried { fit, heldout } = &self.fitted;
        self.steps.push(step(block, fit, heldout, added, drop, ln_p)?);
        Ok(())
    }
}

fn step(
    block: &Block,
    fitted: &Fit,
    heldout: &HeldOut,
    added: Option<String>,
    drop: f64,
    ln_p: f64,
) -> Result<Step, DiagnoseError> {
    let comparison = run::compare(block, &fitted.problem, &fitted.solution)?;
    let chi_square = 2.0 * fitted.solution.cost;
    Ok(Step {
        added,
        model: fitted.model.clone(),
        sigma0: (chi_square / fitted.problem.redundancy().2 as f64).sqrt(),
        tie_rms_px: run::tie_rms_px(block, &fitted.problem, &fitted.solution.state)?,
        heldout_rms_px: heldout.rms_px(),
        check_rms_m: comparison.and_then(|comparison| comparison.check).map(|check| check.rms_m.xyz),
        drop,
        ln_p,
    })
}

/// Ids of candidates that a block cannot tell from `score`, given the screening that it came from.
pub fn inseparable_from(screening: &Screening, position: usize) -> Vec<String> {
    let candidate = |i: usize| -> &Candidate { &screening.scores[i].candidate };
    (0..screening.scores.len())
        .filter(|i| *i != position && candidate(*i).physical)
        .filter(|i| {
            let seen = screening.correlation[position][*i].max(screening.correlation[*i][position]);
            seen > INSEPARABLE
        })
        .map(|i| candidate(i).id.clone())
        .collect()
}
