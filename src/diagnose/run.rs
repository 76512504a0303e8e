//! A whole diagnosis: a base without outliers and with believable weights, the loop, what is left, the verdict.

use super::check_points;
use super::conclusion::diagnosis;
use super::fit::{DiagnoseError, Fit, fit};
use super::improve::Improvement;
use super::left;
use super::outliers::{Outliers, Snooping, Strictness};
use super::settings::Settings;
use super::settle::{judge, settle};
use super::structure::{self, Structure};
use super::verdict::Diagnosis;
use crate::adjust::AdjustError;
use crate::adjust::native::pool::Pool;
use crate::block::Block;
use crate::model::Model;
use crate::run::RunError;
use std::collections::HashSet;

/// Rounds of the weights: the second changes a factor by the square of what the first changed it.
const WEIGHT_ROUNDS: usize = 3;
/// Times that the loop begins anew because an outlier was found or came back, an effect was challenged, or a place has to be looked for again.
const MOST_ROUNDS: usize = 24;

const CENTRE_TIED: &str =
    "the block does not determine the centre of distortion: tied to the principal point (as --tie dc=pp)";

/// What a diagnosis found, and the block that it was made on.
pub struct Diagnosed {
    /// The block without outliers.
    pub block: Block,
    /// Outliers.
    pub outliers: Outliers,
    /// The loop.
    pub improvement: Improvement,
    /// Residual structure of the base model, and of the final one.
    pub before: Structure,
    /// See `before`.
    pub after: Structure,
    /// Verdict and figures.
    pub diagnosis: Diagnosis,
}

/// Diagnoses `block` under `model`. Where the centre of distortion is not determined, in the base or beside what was found, it is tied to the
/// principal point.
///
/// # Errors
/// A fit that fails.
pub fn diagnose(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<Diagnosed, DiagnoseError> {
    Pool::new(settings.options.threads)?.install(|| diagnose_in_pool(whole, model, settings))
}

fn diagnose_in_pool(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<Diagnosed, DiagnoseError> {
    match diagnose_as_it_is(whole, model, settings) {
        Err(error) if undetermined_centre(&error, model) => {
            (settings.tell)(CENTRE_TIED);
            diagnose_as_it_is(whole, &tied(model), settings)
        }
        diagnosed => diagnosed,
    }
}

fn diagnose_as_it_is(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<Diagnosed, DiagnoseError> {
    let tell = settings.tell;
    let (mut search, base) = base(whole, model, settings)?;
    let mut block = search.block(whole).into_owned();
    let mut improvement = Improvement::new(&block, base, settings)?;
    let mut first = None;
    let mut strictness = Strictness::Loose;
    let (mut look_anew, mut round) = (false, 0);
    // Effects and outliers that a judgement led to. One that leads back to where one was would go on for ever.
    let (mut judging, mut reached) = (true, HashSet::new());
    let (linearised, rest) = loop {
        let (linearised, searched) = improvement.advance(&block, settings, &mut first, look_anew)?;
        round += 1;
        let may_change = round < MOST_ROUNDS;
        look_anew = false;
        if may_change && judging && (!improvement.added.is_empty() || improvement.rests_on_a_point()) {
            // With the effects in the model, outliers that they hid stand out; and what looked like an effect may be one.
            let mut changed = judged_again(whole, &mut search, &mut improvement, strictness, settings)?;
            if !changed && strictness == Strictness::Loose {
                strictness = Strictness::Tight;
                changed = judged_again(whole, &mut search, &mut improvement, strictness, settings)?;
            }
            if changed {
                block = search.block(whole).into_owned();
                judging = reached.insert((improvement.added.clone(), search.left_out()));
                continue;
            }
        }
        if may_change && !searched {
            look_anew = true;
            continue;
        }
        tell("describing what is left");
        let rest = left::analyse(&block, &improvement, &linearised, settings)?;
        if may_change
            && (left::challenge(&block, &mut improvement, &rest, settings)?
                || improvement.let_go_what_no_refit_needs(&block, &linearised, settings)?)
        {
            continue;
        }
        break (linearised, rest);
    };
    improvement.finish(&block, settings)?;
    let after = rest.structure.clone();
    let before = match improvement.added.is_empty() {
        true => after.clone(),
        false => structure_of(&block, &improvement.base, settings)?,
    };
    let outliers = search.outliers(whole);
    let first = first.as_ref().unwrap_or(&linearised);
    let found = diagnosis(&block, &improvement, first, &linearised, &rest, &after, outliers.rejected.len(), settings)?;
    Ok(Diagnosed { block, outliers, improvement, before, after, diagnosis: found })
}

/// The base of a diagnosis: `model` fitted without outliers and with believable weights.
///
/// # Errors
/// A fit that fails.
pub fn base(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<(Snooping, Fit), DiagnoseError> {
    let tell = settings.tell;
    tell("adjusting the base model and searching outliers");
    let mut search = Snooping::new(whole, model);
    let fitted = match settle(whole, &mut search, model, None, Strictness::Loose, settings) {
        Err(error) if undetermined_centre(&error, model) => {
            tell(CENTRE_TIED);
            let tied = tied(model);
            search = Snooping::new(whole, &tied);
            settle(whole, &mut search, &tied, None, Strictness::Loose, settings)?
        }
        fitted => fitted?,
    };
    tell("estimating the weights");
    let fitted = weighed(&search.block(whole), fitted, settings)?;
    Ok((search, fitted))
}

/// Judges every measurement anew at the model as it stands; the loop goes on with what is left. Did anything change?
fn judged_again(
    whole: &Block,
    search: &mut Snooping,
    improvement: &mut Improvement,
    strictness: Strictness,
    settings: &Settings<'_>,
) -> Result<bool, DiagnoseError> {
    if !settings.snoop {
        return Ok(false);
    }
    let fitted = &improvement.fit;
    let before = search.clone();
    let round = judge(whole, search, fitted, strictness, settings)?;
    if round.rejected + round.returned == 0 {
        return Ok(false);
    }
    let model = super::models::at_solution(fitted);
    let near = fitted.clone();
    match settle(whole, search, &model, Some(&near), strictness, settings) {
        Ok(fit) => {
            let why = format!("{} measurements set aside, {} taken back", round.rejected, round.returned);
            let block = search.block(whole);
            improvement.measured_anew(&block, fit, &why, settings)?;
            improvement.weigh(&block, settings)?;
            Ok(true)
        }
        Err(error) => {
            (settings.tell)(&format!("the search for outliers stopped: {error}"));
            *search = before;
            Ok(false)
        }
    }
}

fn weighed(block: &Block, mut fitted: Fit, settings: &Settings<'_>) -> Result<Fit, DiagnoseError> {
    let added = super::added::Added { own: fitted.model.effects.len(), ..Default::default() };
    for _ in 0..WEIGHT_ROUNDS {
        let Some(model) = super::weights::reweighted(block, &fitted, &added, settings)? else { break };
        fitted = fit(block, &model, Some(&fitted), &settings.options)?;
    }
    Ok(fitted)
}

/// The adjustment failed with a centre of distortion of its own: where distortion is small, that centre runs away.
fn undetermined_centre(error: &DiagnoseError, model: &Model) -> bool {
    let DiagnoseError::Run(RunError::Adjust(error)) = error else { return false };
    let failed = matches!(error, AdjustError::NotConverged { .. } | AdjustError::Singular { .. });
    failed && !model.tie_dc_to_pp && model.free[3] && model.free[4]
}

fn tied(model: &Model) -> Model {
    Model { tie_dc_to_pp: true, ..model.clone() }
}

fn structure_of(block: &Block, fitted: &Fit, settings: &Settings<'_>) -> Result<Structure, DiagnoseError> {
    let state = &fitted.solution.state;
    let Settings { significance, options, .. } = settings;
    let heights = check_points::of_fit(block, fitted, settings)?;
    Ok(structure::analyse(&fitted.problem, state, &heights, *significance, options.threads)?)
}
