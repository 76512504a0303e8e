//! What a diagnosis comes to: its verdict, and everything that stands beside it.

use super::entries;
use super::imprecise;
use super::improvement::Improvement;
use super::ledger::{Change, Step};
use super::left::Left;
use super::linearised::Linearised;
use super::settings::Settings;
use super::verdict::{Diagnosis, LedgerRow, StructureEntry, Verdict};
use crate::block::Block;
use crate::residuals::Structure;
use crate::run::RunError;

/// Version of the format.
const FORMAT: u32 = 1;

/// Puts a diagnosis together: `first` is the linearisation of the base model, `last` that of the final one, `structure`
/// the latter's.
#[allow(clippy::too_many_arguments)]
pub fn diagnosis(
    block: &Block,
    improvement: &Improvement,
    first: &Linearised,
    last: &Linearised,
    rest: &Left,
    structure: &Structure,
    outliers: usize,
    settings: &Settings<'_>,
) -> Result<Diagnosis, RunError> {
    let left_over = structure.family_wise().is_some() || !rest.fields.is_empty();
    let is_cause = |id: &&String| !rest.fields.iter().any(|field| field.id == **id);
    let causes: Vec<String> = improvement.added.iter().filter(is_cause).cloned().collect();
    let verdict = match (left_over, causes.is_empty()) {
        (true, _) => Verdict::Unexplained,
        (false, true) => Verdict::Adequate,
        (false, false) => Verdict::Missing,
    };
    let tests = structure.tests.iter().map(|test| StructureEntry {
        against: test.against.to_string(),
        statistic: test.statistic,
        p_value: test.p_value,
        family_p_value: test.family_p_value,
        decides: test.decides,
        description: test.description.clone(),
    });
    let mut candidates = entries::candidates(block, improvement, first, settings);
    let found = entries::found(block, last, improvement, settings);
    for found in &found {
        if let Some(candidate) = candidates.iter_mut().find(|candidate| candidate.effect == found.effect) {
            candidate.inseparable_from.clone_from(&found.inseparable_from);
        }
    }
    Ok(Diagnosis {
        format: FORMAT,
        found,
        left_shapes: entries::left(block, last, settings),
        weight: None,
        moved: None,
        check_points: structure.check_points.clone(),
        verdict,
        significance: settings.significance,
        candidates,
        recommended: causes,
        structure: tests.collect(),
        left: match left_over {
            true => left(rest, structure),
            false => Vec::new(),
        },
        ledger: improvement.steps.iter().enumerate().map(ledger_row).collect(),
        sigma_factors: improvement.fit.model.sigma_factors,
        flight_factors: improvement.fit.model.flight_factors.clone(),
        imprecise: imprecise::beyond(block, &improvement.fit, settings.significance)?,
        outliers,
        outlier_points: Vec::new(),
        mistakes: Vec::new(),
        known: Vec::new(),
    })
}

/// Unexplained structure, in words.
fn left(rest: &Left, structure: &Structure) -> Vec<String> {
    let mut left = structure.describe_unexplained();
    for field in &rest.fields {
        left.push(format!("the empirical field {} takes {:.0} of v'Pv away", field.id, field.drop));
    }
    left
}

/// A row of the ledger.
fn ledger_row((number, step): (usize, &Step)) -> LedgerRow {
    let exchanged = matches!(step.change, Change::Exchanged { .. });
    LedgerRow {
        step: number,
        added: step.change.label(),
        sigma0: step.sigma0,
        tie_rms_px: step.tie_rms_px,
        heldout_rms_px: Some(step.heldout_px).filter(|rms| rms.is_finite()),
        check_rms_m: step.check_rms_m,
        statistic: step.drop,
        objective: step.objective,
        p_value: step.ln_p.exp(),
        predicted: exchanged.then_some(step.predicted),
        why: step.why.clone(),
        iterations: step.iterations,
        solvers_agree: None,
        one_derivation: Vec::new(),
    }
}
