//! A whole diagnosis: outliers first, then the loop, then what is left, then the verdict.

use super::fit::{DiagnoseError, Fit, fit};
use super::forward::{Improvement, Settings, improve};
use super::outliers::{self, Outliers, Strictness};
use super::structure::{self, Structure};
use super::verdict::{self, Diagnosis, Verdict, diagnosis};
use crate::adjust::native::pool;
use crate::adjust::{AdjustError, CovarianceOf, Options};
use crate::block::Block;
use crate::model::Model;
use crate::run::{self, RunError};
use std::collections::BTreeSet;

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

/// Diagnoses `block` under `model`.
pub fn diagnose(block: &Block, model: &Model, settings: &Settings<'_>) -> Result<Diagnosed, DiagnoseError> {
    (settings.tell)("searching outliers");
    let (model, mut outliers) = match search(block, model, None, settings, Strictness::Loose) {
        Err(error) if undetermined_centre(&error, model) => {
            (settings.tell)(
                "the block does not determine the centre of distortion: tied to the principal point (as --tie dc=pp)",
            );
            let tied = Model { tie_dc_to_pp: true, ..model.clone() };
            let outliers = search(block, &tied, None, settings, Strictness::Loose)?;
            (tied, outliers)
        }
        found => (model.clone(), found?),
    };
    let model = &model;
    let mut clean = outliers.without(block);
    let mut improvement = improve(&clean, model, None, settings)?;
    if !improvement.added.is_empty() {
        // With the effects in the model, outliers that they hid stand out.
        let fitted = &improvement.fitted.fit;
        match search(block, &fitted.model, Some(fitted), settings, Strictness::Tight) {
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
    let significance = settings.significance;
    let pool = pool(settings.options.threads)?;
    let Improvement { base, fitted, steps, .. } = &improvement;
    let (before, after) = pool.install(|| {
        rayon::join(
            || structure_of(&clean, base, significance),
            || match steps.len() {
                1 => Ok(None),
                _ => structure_of(&clean, &fitted.fit, significance).map(Some),
            },
        )
    });
    let before = before?;
    let mut after = after?.unwrap_or_else(|| before.clone());
    let count = outliers.rejected.len();
    let mut found = diagnosis(&clean, &improvement, &after, significance, count);
    // An effect that is less sure than what it leaves is a shape that happens to fit, not the cause.
    let mut banned = BTreeSet::new();
    while found.verdict == Verdict::Unexplained {
        let left = verdict::ln_p_of_rest(&improvement, &after);
        let unsure: Vec<String> =
            improvement.added.iter().filter(|id| improvement.entry_ln_p(id) > left).cloned().collect();
        if unsure.is_empty() {
            break;
        }
        (settings.tell)(&format!("what is left is surer than {}: going on without", unsure.join(", ")));
        banned.extend(unsure);
        improvement.go_on_without(&clean, &banned, left, settings)?;
        let fitted = &improvement.fitted.fit;
        after = pool.install(|| structure_of(&clean, fitted, significance))?;
        found = diagnosis(&clean, &improvement, &after, significance, count);
    }
    Ok(Diagnosed { block: clean, outliers, improvement, before, after, diagnosis: found })
}

/// The adjustment failed with a centre of distortion of its own: where distortion is small, that centre runs away.
fn undetermined_centre(error: &DiagnoseError, model: &Model) -> bool {
    let DiagnoseError::Run(RunError::Adjust(error)) = error else { return false };
    let failed = matches!(error, AdjustError::NotConverged { .. } | AdjustError::Singular { .. });
    failed && !model.tie_dc_to_pp && model.free[3] && model.free[4]
}

fn structure_of(block: &Block, fitted: &Fit, significance: f64) -> Result<Structure, DiagnoseError> {
    let comparison = run::compare(block, &fitted.problem, &fitted.solution)?;
    let state = &fitted.solution.state;
    Ok(structure::analyse(&fitted.problem, state, comparison.as_ref(), significance)?)
}

fn search(
    block: &Block,
    model: &Model,
    near: Option<&Fit>,
    settings: &Settings<'_>,
    strictness: Strictness,
) -> Result<Outliers, DiagnoseError> {
    let options = Options { covariance: CovarianceOf::Nothing, ..settings.options.clone() };
    let how = outliers::Options { strictness, ..outliers::Options::default() };
    let mut last: Option<Fit> = None;
    outliers::find(block, how, &mut |block: &Block| -> Result<outliers::Fit, DiagnoseError> {
        let fitted = last.insert(fit(block, model, last.as_ref().or(near), &options)?);
        Ok(outliers::Fit { problem: fitted.problem.clone(), state: fitted.solution.state.clone() })
    })
}
