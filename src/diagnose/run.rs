//! A whole diagnosis: outliers first, then the loop, then what is left, then the verdict.

use super::fit::{DiagnoseError, Fit, fit};
use super::forward::{Improvement, Settings, improve, without_effects};
use super::outliers::{self, Outliers, Strictness};
use super::structure::{self, Structure};
use super::verdict::{Diagnosis, Verdict, diagnosis};
use super::{forward, verdict};
use crate::adjust::{AdjustError, CovarianceOf, Options};
use crate::block::Block;
use crate::model::Model;
use crate::run::{self, RunError};

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

/// Diagnoses `block` under `model`; adds at most `settings.most_effects` effects.
pub fn diagnose(block: &Block, model: &Model, settings: &Settings<'_>) -> Result<Diagnosed, DiagnoseError> {
    (settings.tell)("searching outliers");
    let (model, mut outliers) = match search(block, model, settings, Strictness::Loose) {
        Err(error) if undetermined_centre(&error, model) => {
            (settings.tell)(
                "the block does not determine the centre of distortion: tied to the principal point (as --tie dc=pp)",
            );
            let tied = Model { tie_dc_to_pp: true, ..model.clone() };
            let outliers = search(block, &tied, settings, Strictness::Loose)?;
            (tied, outliers)
        }
        found => (model.clone(), found?),
    };
    let model = &model;
    let mut clean = outliers.without(block);
    let mut improvement = improve(&clean, model, None, settings)?;
    if !improvement.added.is_empty() {
        // With the effects in the model, outliers that they hid stand out.
        match search(block, &improvement.fitted.model, settings, Strictness::Tight) {
            Ok(found) if found.rejected.len() != outliers.rejected.len() => {
                outliers = found;
                clean = outliers.without(block);
                improvement = improve(&clean, model, Some(&improvement.base), settings)?;
            }
            Ok(_) => {}
            // With the outliers back in, the larger model may not converge at all.
            Err(error) => {
                (settings.tell)(&format!("the second search for outliers failed ({error}); the first stands"))
            }
        }
    }
    (settings.tell)("describing what is left");
    let before = structure_of(&clean, &improvement.base, settings)?;
    let mut after = match improvement.steps.len() {
        1 => before.clone(),
        _ => structure_of(&clean, &improvement.fitted, settings)?,
    };
    let count = outliers.rejected.len();
    let mut found = diagnosis(&clean, &improvement, &after, settings.significance, count);
    if found.verdict == Verdict::Unexplained && !improvement.added.is_empty() {
        // An effect that is less sure than what it leaves is a shape that happens to fit, not the cause.
        let left = verdict::ln_p_of_rest(&improvement, &after);
        let names: Vec<String> =
            improvement.added.iter().filter(|id| forward::entry_ln_p(&improvement, id) > left).cloned().collect();
        if !names.is_empty() {
            let kept = without_effects(&improvement.fitted.model, &names);
            let fitted = fit(&clean, &kept, Some(&improvement.fitted), &settings.options)?;
            forward::take_out(&clean, &mut improvement, fitted, &names, settings)?;
            after = structure_of(&clean, &improvement.fitted, settings)?;
            found = diagnosis(&clean, &improvement, &after, settings.significance, count);
        }
    }
    Ok(Diagnosed { block: clean, outliers, improvement, before, after, diagnosis: found })
}

/// The adjustment failed with a centre of distortion of its own: where distortion is small, that centre runs away.
fn undetermined_centre(error: &DiagnoseError, model: &Model) -> bool {
    let DiagnoseError::Run(RunError::Adjust(error)) = error else { return false };
    let failed = matches!(error, AdjustError::NotConverged { .. } | AdjustError::Singular { .. });
    failed && !model.tie_dc_to_pp && model.free[3] && model.free[4]
}

fn structure_of(block: &Block, fitted: &Fit, settings: &Settings<'_>) -> Result<Structure, DiagnoseError> {
    let comparison = run::compare(block, &fitted.problem, &fitted.solution)?;
    let state = &fitted.solution.state;
    Ok(structure::analyse(&fitted.problem, state, comparison.as_ref(), settings.significance)?)
}

fn search(
    block: &Block,
    model: &Model,
    settings: &Settings<'_>,
    strictness: Strictness,
) -> Result<Outliers, DiagnoseError> {
    let options = Options { covariance: CovarianceOf::Nothing, ..settings.options.clone() };
    let how = outliers::Options { strictness, ..outliers::Options::default() };
    let mut last: Option<Fit> = None;
    outliers::find(block, how, &mut |block: &Block| -> Result<outliers::Fit, DiagnoseError> {
        let fitted = last.insert(fit(block, model, last.as_ref(), &options)?);
        Ok(outliers::Fit { problem: fitted.problem.clone(), state: fitted.solution.state.clone() })
    })
}
