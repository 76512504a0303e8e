//! `diagnosis.json`: what was found, in the keys that scripts rely on, and the verdict.

use super::forward::{Improvement, Step, inseparable_from, significant};
use super::score::{Score, Screening};
use super::structure::Structure;
use super::trial::Confirmation;
use crate::block::{Block, PointId, Role};
use crate::math::null_is_nan;
use crate::problem::{Problem, State};
use crate::run;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// What the diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Nothing significant is left.
    Adequate,
    /// Effects of the catalogue explain what is there.
    Missing,
    /// Significant structure is left that no effect of the catalogue explains.
    Unexplained,
}

/// Version of the format.
const FORMAT: u32 = 1;

/// `diagnosis.json`.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Diagnosis {
    /// Version.
    pub format: u32,
    /// Verdict.
    pub verdict: Verdict,
    /// Family-wise significance level.
    #[serde(deserialize_with = "null_is_nan")]
    pub significance: f64,
    /// Every effect, by rank at the base model.
    pub candidates: Vec<CandidateEntry>,
    /// Effects that the final model added (of a diagnosis without improvement: that it recommends to add first).
    pub recommended: Vec<String>,
    /// Tests of residual structure, at the final model.
    pub structure: Vec<StructureEntry>,
    /// What is left, in words; empty where nothing is.
    pub left: Vec<String>,
    /// One row per model tried.
    pub ledger: Vec<LedgerRow>,
    /// Factors that the stated standard deviations were multiplied by.
    pub sigma_factors: crate::model::SigmaFactors,
    /// Measurements that were set aside as outliers.
    pub outliers: usize,
}

/// A parameter's estimated size.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct EstimateEntry {
    /// In `unit`.
    #[serde(deserialize_with = "null_is_nan")]
    pub value: f64,
    /// Standard deviation.
    #[serde(deserialize_with = "null_is_nan")]
    pub sigma: f64,
    /// Unit.
    pub unit: String,
}

/// What a refit showed.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ConfirmedEntry {
    /// Drop of `v'Pv`.
    #[serde(deserialize_with = "null_is_nan")]
    pub drop: f64,
    /// Before, px.
    #[serde(deserialize_with = "null_is_nan")]
    pub heldout_rms_px_before: f64,
    /// After, px; null where the refit failed.
    pub heldout_rms_px_after: Option<f64>,
    /// It stayed in the model.
    pub kept: bool,
    /// Why not; empty otherwise.
    pub reason: String,
}

/// The smallest size that this block shows with 80 % power.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct DetectableEntry {
    /// In `unit`.
    #[serde(deserialize_with = "null_is_nan")]
    pub size: f64,
    /// Unit.
    pub unit: String,
    /// What an effect of that size, undetected, does to check points: 3D RMS, m; null without check points.
    pub check_change_m: Option<f64>,
}

/// One candidate.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CandidateEntry {
    /// Id.
    pub effect: String,
    /// From 1; untested ones come last.
    pub rank: usize,
    /// Names a cause (`physical`) or a shape (`empirical`).
    pub kind: String,
    /// F, or for random effects the standardised sum of squared scores.
    #[serde(deserialize_with = "null_is_nan")]
    pub statistic: f64,
    /// Degrees of freedom.
    #[serde(deserialize_with = "null_is_nan")]
    pub dof: f64,
    /// Of this test alone, corrected for a scan.
    #[serde(deserialize_with = "null_is_nan")]
    pub p_value: f64,
    /// Its natural logarithm, which does not underflow.
    #[serde(deserialize_with = "null_is_nan")]
    pub ln_p_value: f64,
    /// Significant among all candidates.
    pub significant: bool,
    /// Drop of `v'Pv` that a refit would bring.
    #[serde(deserialize_with = "null_is_nan")]
    pub predicted_drop: f64,
    /// Sizes by parameter.
    pub estimate: BTreeMap<String, EstimateEntry>,
    /// 3D RMS change of check points when the effect enters, m; null without check points.
    pub predicted_check_change_m: Option<f64>,
    /// Candidates that this block cannot tell from this one (correlation above 0.9).
    pub inseparable_from: Vec<String>,
    /// Factor on the variance of the score from measurements that err together.
    #[serde(deserialize_with = "null_is_nan")]
    pub design_effect: f64,
    /// See [`DetectableEntry`]; null for candidates of several parameters.
    pub detectable: Option<DetectableEntry>,
    /// What the block lacks to test it.
    pub needs: Vec<String>,
    /// Was it tested?
    pub tested: bool,
    /// What a refit showed; null where none was made.
    pub confirmed: Option<ConfirmedEntry>,
}

/// One test of residual structure.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StructureEntry {
    /// Against what.
    pub against: String,
    /// Statistic.
    #[serde(deserialize_with = "null_is_nan")]
    pub statistic: f64,
    /// Of this test alone.
    #[serde(deserialize_with = "null_is_nan")]
    pub p_value: f64,
    /// Among all tests that decide.
    #[serde(deserialize_with = "null_is_nan")]
    pub family_p_value: f64,
    /// False for tests at check points, which decide nothing.
    pub decides: bool,
    /// In words.
    pub description: String,
}

/// One row of the ledger.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LedgerRow {
    /// From 0, the base.
    pub step: usize,
    /// What was added (`-id`: taken out again); null for the base.
    pub added: Option<String>,
    /// `sqrt(v'Pv / redundancy)` under the estimated weights.
    #[serde(deserialize_with = "null_is_nan")]
    pub sigma0: f64,
    /// Per coordinate, px.
    #[serde(deserialize_with = "null_is_nan")]
    pub tie_rms_px: f64,
    /// Of predictions of left-out measurements, px.
    pub heldout_rms_px: Option<f64>,
    /// 3D, m; null without check points.
    pub check_rms_m: Option<f64>,
    /// Drop of `v'Pv` from the step before.
    #[serde(deserialize_with = "null_is_nan")]
    pub statistic: f64,
    /// p-value that let the effect in.
    #[serde(deserialize_with = "null_is_nan")]
    pub p_value: f64,
    /// Do the solvers agree on this model? Null where it was adjusted with one of them.
    #[serde(default)]
    pub solvers_agree: Option<bool>,
}

/// Check points over which a predicted change is averaged at most: a mean over this many evenly spaced points is good to some percent.
const CHECK_SAMPLE: usize = 200;

/// Puts a diagnosis together. `structure` is that of the final model.
pub fn diagnosis(
    block: &Block,
    improvement: &Improvement,
    structure: &Structure,
    significance: f64,
    outliers: usize,
) -> Diagnosis {
    let first = &improvement.screenings[0];
    let last = improvement.screenings.last().unwrap_or(first);
    let verdict = verdict(improvement, last, structure, significance);
    Diagnosis {
        format: FORMAT,
        verdict,
        significance,
        candidates: candidates(block, improvement, first, significance),
        recommended: improvement.added.clone(),
        structure: structure
            .tests
            .iter()
            .map(|test| StructureEntry {
                against: test.against.to_string(),
                statistic: test.statistic,
                p_value: test.p_value,
                family_p_value: test.family_p_value,
                decides: test.decides,
                description: test.description.clone(),
            })
            .collect(),
        left: if verdict == Verdict::Unexplained {
            left(improvement, last, structure, significance)
        } else {
            Vec::new()
        },
        ledger: improvement.steps.iter().enumerate().map(ledger_row).collect(),
        sigma_factors: improvement.fitted.fit.model.sigma_factors,
        outliers,
    }
}

/// Empirical candidates that are significant among all: a shape is left that has no name.
pub fn shapes_left(screening: &Screening, significance: f64) -> Vec<&Score> {
    let level = (significance / screening.scores.len().max(1) as f64).ln();
    screening.scores.iter().filter(|score| !score.candidate.physical && score.ln_p < level).collect()
}

/// How improbable what is left is by chance: the least logarithm of a p-value among structure tests and empirical fields.
pub fn ln_p_of_rest(improvement: &Improvement, structure: &Structure) -> f64 {
    let tests = structure.tests.iter().filter(|test| test.decides).map(|test| test.ln_p_value);
    let shapes = improvement.screenings.last().into_iter().flat_map(|screening| &screening.scores);
    let shapes = shapes.filter(|score| !score.candidate.physical).map(|score| score.ln_p);
    tests.chain(shapes).fold(0.0, f64::min)
}

fn verdict(improvement: &Improvement, last: &Screening, structure: &Structure, significance: f64) -> Verdict {
    let left = structure.family_wise().is_some()
        || !shapes_left(last, significance).is_empty()
        || !significant(last, significance).is_empty();
    match (left, improvement.added.is_empty()) {
        (true, _) => Verdict::Unexplained,
        (false, true) => Verdict::Adequate,
        (false, false) => Verdict::Missing,
    }
}

fn left(improvement: &Improvement, last: &Screening, structure: &Structure, significance: f64) -> Vec<String> {
    let mut left = structure.describe_unexplained();
    for score in shapes_left(last, significance) {
        left.push(format!(
            "the empirical field {} would take {:.0} of v'Pv away with {:.0} parameters",
            score.candidate.id, score.predicted, score.dof
        ));
    }
    for score in significant(last, significance) {
        let id = &score.candidate.id;
        let tried = improvement.confirmations.iter().rfind(|tried| tried.id == *id && !tried.kept);
        let why = tried.map_or("less sure than what is left", |tried| &tried.reason);
        left.push(format!("{id} is significant still: {why}"));
    }
    left
}

fn ledger_row((number, step): (usize, &Step)) -> LedgerRow {
    LedgerRow {
        step: number,
        added: step.added.clone(),
        sigma0: step.sigma0,
        tie_rms_px: step.tie_rms_px,
        heldout_rms_px: Some(step.heldout_rms_px).filter(|rms| rms.is_finite()),
        check_rms_m: step.check_rms_m,
        statistic: step.drop,
        p_value: step.ln_p.exp(),
        solvers_agree: None,
    }
}

fn candidates(
    block: &Block,
    improvement: &Improvement,
    screening: &Screening,
    significance: f64,
) -> Vec<CandidateEntry> {
    let changes = check_changes(block, improvement, screening);
    let level = (significance / screening.scores.len().max(1) as f64).ln();
    let confirmed = |id: &str| -> Option<ConfirmedEntry> {
        improvement.confirmations.iter().rfind(|confirmation| confirmation.id == id).map(confirmed_entry)
    };
    let mut entries: Vec<CandidateEntry> = screening
        .scores
        .iter()
        .enumerate()
        .map(|(position, score)| CandidateEntry {
            effect: score.candidate.id.clone(),
            rank: position + 1,
            kind: kind(score.candidate.physical),
            statistic: score.statistic,
            dof: score.dof,
            p_value: score.p_value(),
            ln_p_value: score.ln_p,
            significant: score.ln_p < level,
            predicted_drop: score.predicted,
            estimate: score
                .estimates
                .iter()
                .map(|(name, e)| (name.clone(), EstimateEntry { value: e.value, sigma: e.sigma, unit: e.unit.clone() }))
                .collect(),
            predicted_check_change_m: changes[position],
            inseparable_from: inseparable_from(screening, position),
            design_effect: score.design_effect,
            detectable: detectable(score, changes[position]),
            needs: Vec::new(),
            tested: true,
            confirmed: confirmed(&score.candidate.id),
        })
        .collect();
    for candidate in &screening.untested {
        entries.push(CandidateEntry {
            effect: candidate.id.clone(),
            rank: entries.len() + 1,
            kind: kind(candidate.physical),
            statistic: 0.0,
            dof: 0.0,
            p_value: 1.0,
            ln_p_value: 0.0,
            significant: false,
            predicted_drop: 0.0,
            estimate: BTreeMap::new(),
            predicted_check_change_m: None,
            inseparable_from: Vec::new(),
            design_effect: 1.0,
            detectable: None,
            needs: candidate.needs.clone(),
            tested: false,
            confirmed: confirmed(&candidate.id),
        });
    }
    entries
}

fn kind(physical: bool) -> String {
    if physical { "physical" } else { "empirical" }.into()
}

fn confirmed_entry(confirmation: &Confirmation) -> ConfirmedEntry {
    ConfirmedEntry {
        drop: confirmation.drop,
        heldout_rms_px_before: confirmation.before_px,
        heldout_rms_px_after: Some(confirmation.after_px).filter(|rms| rms.is_finite()),
        kept: confirmation.kept,
        reason: confirmation.reason.clone(),
    }
}

fn detectable(score: &Score, change: Option<f64>) -> Option<DetectableEntry> {
    let size = score.detectable?;
    let estimate = score.estimates.values().next()?;
    // The change is linear in the size of the effect.
    let check_change_m = change.filter(|_| estimate.value != 0.0).map(|change| change * size / estimate.value.abs());
    Some(DetectableEntry { size, unit: estimate.unit.clone(), check_change_m })
}

/// 3D RMS change of check points for each score, where the block has check points.
fn check_changes(block: &Block, improvement: &Improvement, screening: &Screening) -> Vec<Option<f64>> {
    let sample = sampled_checks(block);
    let residuals = |problem: &Problem, state: &State| -> Option<BTreeMap<PointId, Vector3<f64>>> {
        let comparison = run::compare_state(&sample, problem, state).ok()??;
        let checks = comparison.rows.iter().filter(|row| row.role == Role::Check);
        let residuals: BTreeMap<_, _> = checks.map(|row| (row.point, row.d)).collect();
        (!residuals.is_empty()).then_some(residuals)
    };
    let base = &improvement.base;
    let Some(before) = residuals(&base.problem, &base.solution.state) else {
        return vec![None; screening.scores.len()];
    };
    let change = |state: &State| {
        let after = residuals(&screening.problem, state)?;
        let squares: Vec<f64> =
            before.iter().filter_map(|(point, d)| Some((after.get(point)? - d).norm_squared())).collect();
        Some((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    screening.moved.iter().map(change).collect()
}

/// The block with its control points and evenly spaced check points alone marked.
fn sampled_checks(block: &Block) -> Block {
    let checks: Vec<usize> = (0..block.surveyed.len()).filter(|k| block.surveyed[*k].role == Role::Check).collect();
    let stride = checks.len().div_ceil(CHECK_SAMPLE).max(1);
    let kept: BTreeSet<usize> = checks.into_iter().step_by(stride).collect();
    let mut sample = block.clone();
    sample.ties = Vec::new();
    sample.marks.retain(|mark| {
        let point = mark.point.index();
        block.surveyed[point].role == Role::Control || kept.contains(&point)
    });
    sample
}
