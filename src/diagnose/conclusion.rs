//! What a diagnosis comes to: its verdict, and everything that stands beside it.

use super::entries;
use super::fit::DiagnoseError;
use super::imprecise;
use super::improve::{Change, Improvement, Step};
use super::left::Left;
use super::linearised::Linearised;
use super::select::Judged;
use super::settings::Settings;
use super::structure::Structure;
use super::verdict::{Diagnosis, LedgerRow, StructureEntry, Verdict};
use crate::block::Block;

/// Version of the format.
const FORMAT: u32 = 1;

/// Puts a diagnosis together: `first` is the linearisation of the base model, `last` that of the final one, `structure` the latter's.
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
) -> Result<Diagnosis, DiagnoseError> {
    let significant = significant(last, rest, settings);
    let left_over = structure.family_wise().is_some() || !rest.fields.is_empty() || !significant.is_empty();
    let verdict = match (left_over, improvement.added.is_empty()) {
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
    let found = entries::found(block, last, &candidates, settings);
    for found in &found {
        if let Some(candidate) = candidates.iter_mut().find(|candidate| candidate.effect == found.effect) {
            candidate.inseparable_from.clone_from(&found.inseparable_from);
        }
    }
    Ok(Diagnosis {
        format: FORMAT,
        found,
        left_shapes: entries::left(block, rest, settings),
        weight: None,
        check_points: structure.check_points.clone(),
        verdict,
        significance: settings.significance,
        candidates,
        recommended: improvement.added.clone(),
        structure: tests.collect(),
        left: match left_over {
            true => left(improvement, last, rest, &significant, structure),
            false => Vec::new(),
        },
        ledger: improvement.steps.iter().enumerate().map(ledger_row).collect(),
        sigma_factors: improvement.fit.model.sigma_factors,
        flight_factors: improvement.fit.model.flight_factors.clone(),
        imprecise: imprecise::beyond(block, &improvement.fit)?,
        outliers,
    })
}

/// Candidates that name a cause and are significant still.
fn significant<'a>(last: &Linearised, rest: &'a Left, settings: &Settings<'_>) -> Vec<&'a Judged> {
    let level = last.ln_level(settings.significance);
    rest.judged.iter().filter(|judged| last.sets[judged.set].physical && judged.ln_p < level).collect()
}

fn left(
    improvement: &Improvement,
    last: &Linearised,
    rest: &Left,
    significant: &[&Judged],
    structure: &Structure,
) -> Vec<String> {
    let mut left = structure.describe_unexplained();
    for field in &rest.fields {
        left.push(format!(
            "the empirical field {} would take {:.0} of v'Pv away with {:.0} parameters",
            field.id, field.drop, field.dof
        ));
    }
    for judged in significant {
        let id = &last.sets[judged.set].id;
        let tried = improvement.confirmations.iter().rfind(|tried| tried.id == *id && !tried.kept);
        let why = match tried {
            Some(tried) => tried.reason.as_str(),
            None if judged.implausible => "its size is beyond what physics allows, so that it only looks like it",
            None if judged.predicted_drop.is_some_and(|drop| drop <= 0.0) => {
                "it does not predict images that its estimate did not see"
            }
            None => "what is left could itself be it",
        };
        left.push(format!("{id} is significant still: {why}"));
    }
    left
}

/// A row of the ledger.
fn ledger_row((number, step): (usize, &Step)) -> LedgerRow {
    let added = match &step.change {
        Change::Base => None,
        Change::Added(id) => Some(id.clone()),
        Change::Removed(id) => Some(format!("-{id}")),
        Change::Reweighted => Some("(weights, outliers)".into()),
    };
    let predicted = matches!(step.change, Change::Added(_)).then_some(step.predicted);
    LedgerRow {
        step: number,
        added,
        sigma0: step.sigma0,
        tie_rms_px: step.tie_rms_px,
        heldout_rms_px: Some(step.heldout_px).filter(|rms| rms.is_finite()),
        check_rms_m: step.check_rms_m,
        statistic: step.drop,
        p_value: step.ln_p.exp(),
        predicted,
        why: step.why.clone(),
        iterations: step.iterations,
        solvers_agree: None,
        one_derivation: Vec::new(),
    }
}
