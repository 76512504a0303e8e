//! Add and watch: the best candidate enters the model, and stays only when its refit drops as predicted, it is still needed beside the
//! others, and it predicts measurements that the fit did not see. Check points only watch.

use super::candidate::{Candidate, candidates};
use super::fit::{DiagnoseError, Fit, fit, fit_with_weights, screen_all};
use super::heldout::{HeldOut, held_out};
use super::score::{Base, Score, Screening, screen};
use super::verdict::shapes_left;
use crate::adjust::Options;
use crate::block::Block;
use crate::camera;
use crate::effects::Role as ParameterRole;
use crate::math::statistics::chi_square_ln_sf;
use crate::model::{EffectRef, Model, SigmaFactors};
use crate::run;
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, BTreeSet};

/// Effects that one improvement adds at most: more than this is not a diagnosis any more.
pub const MOST_EFFECTS: usize = 6;

/// What an improvement needs besides block and model.
pub struct Settings<'a> {
    /// Effects from plug-ins.
    pub plugins: &'a [EffectRef],
    /// Options of every fit.
    pub options: Options,
    /// Family-wise significance level.
    pub significance: f64,
    /// Effects to add at most; 0 only tests.
    pub most_effects: usize,
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

/// A candidate that was refitted.
#[derive(Debug, Clone)]
pub struct Confirmation {
    /// Id.
    pub id: String,
    /// Predicted drop, and that of the refit.
    pub predicted: f64,
    /// See `predicted`.
    pub drop: f64,
    /// Held-out RMS before and after, px.
    pub before_px: f64,
    /// See `before_px`.
    pub after_px: f64,
    /// It was kept.
    pub kept: bool,
    /// Why not.
    pub reason: String,
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
    /// The final fit.
    pub fitted: Fit,
    /// Effects that are in the final model and were not in the base, in order of entry.
    pub added: Vec<String>,
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
    let Settings { plugins, options, significance, most_effects, tell } = settings;
    tell("adjusting the base model and estimating the weights");
    let mut fitted = fit_with_weights(block, model, near, plugins, options, *significance)?;
    let base = fitted.clone();
    let mut heldout = held_out(&fitted, options)?;
    let mut steps = vec![step(block, &fitted, &heldout, None, 0.0, 0.0)?];
    let mut confirmations = Vec::new();
    let mut added: Vec<String> = Vec::new();
    let mut refused: BTreeSet<String> = BTreeSet::new();
    let mut screenings = Vec::new();
    loop {
        tell(&format!("testing what may be missing (step {})", steps.len()));
        let screening = screen_all(block, &fitted, plugins, options.threads, *significance)?;
        let mut entered = false;
        if added.len() < *most_effects {
            for score in significant(&screening, *significance) {
                let id = score.candidate.id.clone();
                if refused.contains(&id) {
                    continue;
                }
                tell(&format!("adding {id} and adjusting again"));
                let (confirmation, after) = try_candidate(block, &fitted, &heldout, score, options);
                let kept = confirmation.kept;
                if !kept {
                    tell(&format!("{id} is not kept: {}", confirmation.reason));
                }
                let drop = confirmation.drop;
                confirmations.push(confirmation);
                match after {
                    Some((after, after_heldout)) if kept => {
                        steps.push(step(block, &after, &after_heldout, Some(id.clone()), drop, score.ln_p)?);
                        (fitted, heldout) = (after, after_heldout);
                        added.push(id);
                        entered = true;
                        break;
                    }
                    _ => {
                        refused.insert(id);
                    }
                }
            }
        }
        if !entered && added.len() < *most_effects && !shapes_left(&screening, *significance).is_empty() {
            tell("something is left that no score explains: refitting the effects of the image one by one");
            if let Some(rescued) = rescue(block, &fitted, &heldout, &screening, settings, &mut confirmations) {
                let Rescued { id, drop, ln_p, after, heldout: after_heldout } = rescued;
                steps.push(step(block, &after, &after_heldout, Some(id.clone()), drop, ln_p)?);
                (fitted, heldout) = (after, after_heldout);
                added.push(id);
                entered = true;
            }
        }
        screenings.push(screening);
        if !entered {
            return Ok(Improvement { steps, confirmations, screenings, base, fitted, added });
        }
        // What was refused beside a smaller model may be needed beside this one; and what the effect left in the residuals no longer passes for
        // noise, so the weights are estimated anew, from the stated ones: a factor that the missing effect inflated would be believed.
        refused.clear();
        match reweighted(block, &fitted, model.sigma_factors, settings) {
            Ok(Some((weighted, weighted_heldout))) => {
                (fitted, heldout) = (weighted, weighted_heldout);
                // The ledger's row is that of the model as it goes on.
                if let Some(Step { added, drop, ln_p, .. }) = steps.pop() {
                    steps.push(step(block, &fitted, &heldout, added, drop, ln_p)?);
                }
            }
            Ok(None) => {}
            Err(error) => tell(&format!("the weights stay as they are: {error}")),
        }
        if let Some(id) = not_needed(block, &fitted, &added, settings)? {
            tell(&format!("{id} is not needed any more"));
            let without = without_effects(&fitted.model, std::slice::from_ref(&id));
            let after = fit(block, &without, Some(&fitted), options);
            let after = after.and_then(|after| Ok((held_out(&after, options)?, after)));
            let (after_heldout, after) = match after {
                Ok(after) => after,
                Err(error) => {
                    tell(&format!("{id} stays, for without it: {error}"));
                    continue;
                }
            };
            let rise = 2.0 * (after.solution.cost - fitted.solution.cost);
            steps.push(step(block, &after, &after_heldout, Some(format!("-{id}")), -rise, 0.0)?);
            (fitted, heldout) = (after, after_heldout);
            added.retain(|name| *name != id);
            refused.insert(id);
        }
    }
}

/// The fit with weights estimated anew from the stated ones, and what it predicts; `None` where they stand.
fn reweighted(
    block: &Block,
    fitted: &Fit,
    stated: SigmaFactors,
    settings: &Settings<'_>,
) -> Result<Option<(Fit, HeldOut)>, DiagnoseError> {
    let Settings { plugins, options, significance, .. } = settings;
    let restated = Model { sigma_factors: stated, ..fitted.model.clone() };
    let weighted = fit_with_weights(block, &restated, Some(fitted), plugins, options, *significance)?;
    if weighted.model.sigma_factors == fitted.model.sigma_factors {
        return Ok(None);
    }
    let weighted = Fit { model: at_solution(&weighted), ..weighted };
    let heldout = held_out(&weighted, options)?;
    Ok(Some((weighted, heldout)))
}

/// An effect that only its refit shows.
struct Rescued {
    id: String,
    drop: f64,
    ln_p: f64,
    after: Fit,
    heldout: HeldOut,
}

/// Where a missing distortion term has driven the centre of distortion far away, the score at that place under-predicts it; its refit does not. Refits every
/// effect of the image that was not significant, and keeps the best if its drop is significant among all candidates.
fn rescue(
    block: &Block,
    before: &Fit,
    heldout: &HeldOut,
    screening: &Screening,
    settings: &Settings<'_>,
    confirmations: &mut Vec<Confirmation>,
) -> Option<Rescued> {
    let level = (settings.significance / screening.scores.len().max(1) as f64).ln();
    let mut best: Option<Rescued> = None;
    for score in screening.scores.iter().filter(|score| score.candidate.physical && !score.candidate.scanned()) {
        let of_image =
            score.candidate.term().is_some_and(|term| term.effect.descriptor().stage == crate::effects::Stage::Image);
        if !of_image || confirmations.iter().any(|confirmation| confirmation.id == score.candidate.id) {
            continue;
        }
        let (confirmation, after) = try_candidate(block, before, heldout, score, &settings.options);
        let (drop, kept) = (confirmation.drop, confirmation.kept);
        let ln_p = chi_square_ln_sf(drop.max(0.0), score.dof.max(1.0));
        confirmations.push(confirmation);
        let Some((after, heldout)) = after.filter(|_| kept && ln_p < level) else { continue };
        if best.as_ref().is_none_or(|best| ln_p < best.ln_p) {
            best = Some(Rescued { id: score.candidate.id.clone(), drop, ln_p, after, heldout });
        }
    }
    best
}

fn try_candidate(
    block: &Block,
    before: &Fit,
    heldout: &HeldOut,
    score: &Score,
    options: &Options,
) -> (Confirmation, Option<(Fit, HeldOut)>) {
    let mut confirmation = Confirmation {
        id: score.candidate.id.clone(),
        predicted: score.predicted,
        drop: 0.0,
        before_px: heldout.rms_px(),
        after_px: f64::NAN,
        kept: false,
        reason: String::new(),
    };
    let model = with_candidate(&before.model, score);
    // A shape with a kink may have no smooth way to its best place; the scan's, held, is the second choice. Others may start too far away where
    // what is missing has driven the base: the block's approximations are their second choice.
    let after = fit(block, &model, Some(before), options)
        .or_else(|_| match held_where_found(&model) {
            Some(held) => fit(block, &held, Some(before), options),
            None => fit(block, &model, None, options),
        })
        .map_err(|error| error.to_string());
    let after = after.and_then(|after| {
        let heldout = held_out(&after, options).map_err(|error| error.to_string())?;
        Ok((after, heldout))
    });
    match after {
        Err(error) => {
            confirmation.reason = error;
            (confirmation, None)
        }
        Ok((mut after, after_heldout)) => {
            confirmation.drop = 2.0 * (before.solution.cost - after.solution.cost);
            confirmation.after_px = after_heldout.rms_px();
            confirmation.kept = after_heldout.normalised < heldout.normalised;
            if !confirmation.kept {
                confirmation.reason = "it does not predict left-out measurements better".into();
            }
            after.model = at_solution(&after);
            (confirmation, Some((after, after_heldout)))
        }
    }
}

/// The model with the searched parameters of its newest effect held where they stand; `None` where it has none.
fn held_where_found(model: &Model) -> Option<Model> {
    let mut model = model.clone();
    let term = model.effects.last_mut()?;
    let parameters = &term.effect.descriptor().parameters;
    let searched: Vec<String> = parameters
        .iter()
        .filter(|p| matches!(p.role, ParameterRole::Searched(_)))
        .map(|p| p.name.to_string())
        .collect();
    term.held.extend(searched.iter().cloned());
    (!searched.is_empty()).then_some(model)
}

fn with_candidate(model: &Model, score: &Score) -> Model {
    match score.start_term() {
        Some(term) => {
            let mut model = model.clone();
            model.effects.push(term);
            model
        }
        None => score.candidate.added_to(model),
    }
}

/// The model with the start values of effects and cameras where its fit ended: what is adjusted with it again ends in the same minimum. (An
/// unflat sensor and a free centre of distortion have two, 2.7 units of `v'Pv` apart in a small block.)
pub fn at_solution(fitted: &Fit) -> Model {
    let mut model = fitted.model.clone();
    let cameras = fitted.problem.camera_names.iter().zip(&fitted.problem.camera_free);
    for ((camera, free), interior) in cameras.zip(&fitted.solution.state.interiors) {
        let values = model.camera_values.entry(camera.clone()).or_default();
        let free = (0..free.len()).filter(|k| free[*k]);
        values.extend(free.map(|k| (camera::PARAMETERS[k].to_string(), interior[k])));
    }
    for (t, entry) in fitted.problem.theta.iter().enumerate() {
        let term = &mut model.effects[entry.effect as usize];
        let descriptor = term.effect.descriptor();
        match descriptor.parameters[entry.parameter as usize].role {
            ParameterRole::Random(name) => {
                if let Some(sigma) = entry.prior_sigma {
                    term.values.insert(name.to_string(), sigma);
                }
            }
            _ => {
                let prefix = format!("{}.", descriptor.id);
                let name = entry.name.strip_prefix(&prefix).unwrap_or(&entry.name).to_string();
                term.values.insert(name, fitted.solution.state.theta[t]);
            }
        }
    }
    model
}

/// The model without some of its effects.
pub fn without_effects(model: &Model, ids: &[String]) -> Model {
    let mut model = model.clone();
    model.effects.retain(|term| !ids.iter().any(|id| term.effect.descriptor().id == *id));
    model
}

/// Logarithm of the p-value that let an added effect in.
pub fn entry_ln_p(improvement: &Improvement, id: &str) -> f64 {
    let entered = |step: &&Step| step.added.as_deref() == Some(id);
    improvement.steps.iter().rev().find(entered).map_or(0.0, |step| step.ln_p)
}

/// Notes that effects were taken out again, with the fit that is left.
pub fn take_out(
    block: &Block,
    improvement: &mut Improvement,
    fitted: Fit,
    ids: &[String],
    settings: &Settings<'_>,
) -> Result<(), DiagnoseError> {
    let heldout = held_out(&fitted, &settings.options)?;
    let rise = 2.0 * (fitted.solution.cost - improvement.fitted.solution.cost);
    let name = ids.iter().map(|id| format!("-{id}")).collect::<Vec<_>>().join(" ");
    improvement.steps.push(step(block, &fitted, &heldout, Some(name), -rise, 0.0)?);
    improvement.added.retain(|id| !ids.contains(id));
    improvement.fitted = fitted;
    Ok(())
}

/// An added effect (not the newest) that the others do not leave significant any more: by its parameters' covariance, or for a random effect by
/// its score beside the others.
fn not_needed(
    block: &Block,
    fitted: &Fit,
    added: &[String],
    settings: &Settings<'_>,
) -> Result<Option<String>, DiagnoseError> {
    let older = &added[..added.len().saturating_sub(1)];
    let level = (settings.significance / older.len().max(1) as f64).ln();
    let mut least: Option<(f64, &String)> = None;
    for id in older {
        let ln_p = match wald(fitted, id) {
            Some((statistic, dof)) => chi_square_ln_sf(statistic, dof),
            None => score_beside_others(block, fitted, id, settings)?,
        };
        if ln_p > level && least.is_none_or(|(other, _)| ln_p > other) {
            least = Some((ln_p, id));
        }
    }
    Ok(least.map(|(_, id)| id.clone()))
}

/// Logarithm of the p-value of an effect's score test in the model without it; minus infinity (needed) where it cannot be tested.
fn score_beside_others(block: &Block, fitted: &Fit, id: &str, settings: &Settings<'_>) -> Result<f64, DiagnoseError> {
    let model = without_effects(&fitted.model, &[id.to_string()]);
    let without = fit(block, &model, Some(fitted), &settings.options)?;
    let mut list = candidates(block, &without.problem, &without.model, settings.plugins);
    list.retain(|candidate| candidate.id == id);
    let Fit { model, problem, solution } = &without;
    let state = &solution.state;
    let base =
        Base { block, model, problem, state, threads: settings.options.threads, significance: settings.significance };
    let screening = screen(&base, list, &BTreeMap::new())?;
    Ok(screening.scores.first().map_or(f64::NEG_INFINITY, |score| score.ln_p))
}

/// Wald statistic and degrees of freedom of an effect's linear parameters; `None` for random effects and camera parameters.
fn wald(fitted: &Fit, id: &str) -> Option<(f64, f64)> {
    let covariance = fitted.solution.covariance.as_ref()?;
    let layout = fitted.problem.layout();
    let mut rows = Vec::new();
    let mut values = Vec::new();
    for (row, unknown) in covariance.shared_unknowns.iter().enumerate().filter(|(_, u)| **u >= layout.theta(0)) {
        let t = unknown - layout.theta(0);
        let entry = &fitted.problem.theta[t];
        let descriptor = fitted.problem.effects[entry.effect as usize].effect.descriptor();
        let parameter = &descriptor.parameters[entry.parameter as usize];
        if descriptor.id == id && parameter.role == ParameterRole::Estimated {
            rows.push(row);
            values.push(fitted.solution.state.theta[t] - parameter.nominal);
        }
    }
    let matrix = DMatrix::from_fn(rows.len(), rows.len(), |i, j| covariance.shared[(rows[i], rows[j])]);
    let values = DVector::from_vec(values);
    let solved = matrix.cholesky()?.solve(&values);
    (!rows.is_empty()).then(|| (values.dot(&solved), rows.len() as f64))
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
            seen > super::score::INSEPARABLE
        })
        .map(|i| candidate(i).id.clone())
        .collect()
}
