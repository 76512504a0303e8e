//! `diagnosis.json`: what was found, in the keys that scripts rely on, and the verdict.

use super::impact::{self, Impact};
use super::improve::{Change, Confirmation, Improvement, Settings, Step};
use super::left::Left;
use super::linearised::Linearised;
use super::select::Judged;
use super::structure::Structure;
use super::test::power::noncentrality;
use super::test::separability::{self, INSEPARABLE};
use crate::block::Block;
use crate::effects::Role;
use crate::math::null_is_nan;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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
    /// RMS of what it adds to the image measurements and the base does not absorb, px.
    #[serde(default)]
    pub size_px: f64,
    /// What it does to surveyed points (without any, to a sample of tie points); null where that cannot be computed.
    #[serde(default)]
    pub impact: Option<Impact>,
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
    /// Drop of `v'Pv` from the step before, on the same measurements and weights.
    #[serde(deserialize_with = "null_is_nan")]
    pub statistic: f64,
    /// Drop that the null model predicted; null where nothing was predicted.
    #[serde(default)]
    pub predicted: Option<f64>,
    /// Why, of what was taken out, and of outliers and weights; empty otherwise.
    #[serde(default)]
    pub why: String,
    /// Iterations of its refit.
    #[serde(default)]
    pub iterations: usize,
    /// p-value that let the effect in.
    #[serde(deserialize_with = "null_is_nan")]
    pub p_value: f64,
    /// Do the solvers agree on this model? Null where it was adjusted with one of them.
    #[serde(default)]
    pub solvers_agree: Option<bool>,
}

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
) -> Diagnosis {
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
    Diagnosis {
        format: FORMAT,
        verdict,
        significance: settings.significance,
        candidates: candidates(block, improvement, first, settings),
        recommended: improvement.added.clone(),
        structure: tests.collect(),
        left: match left_over {
            true => left(improvement, last, rest, &significant, structure),
            false => Vec::new(),
        },
        ledger: improvement.steps.iter().enumerate().map(ledger_row).collect(),
        sigma_factors: improvement.fit.model.sigma_factors,
        outliers,
    }
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
        if let Some(judged) = rest.judged.iter().find(|judged| last.sets[judged.set].id == *field) {
            left.push(format!(
                "the empirical field {} would take {:.0} of v'Pv away with {:.0} parameters",
                field, judged.drop, judged.dof
            ));
        }
    }
    for judged in significant {
        let id = &last.sets[judged.set].id;
        let tried = improvement.confirmations.iter().rfind(|tried| tried.id == *id && !tried.kept);
        let why = match tried {
            Some(tried) => tried.reason.as_str(),
            None if judged.predicted_drop.is_some_and(|drop| drop <= 0.0) => {
                "it does not predict images that its estimate did not see"
            }
            None => "what is left could itself be it",
        };
        left.push(format!("{id} is significant still: {why}"));
    }
    left
}

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
    }
}

fn candidates(
    block: &Block,
    improvement: &Improvement,
    first: &Linearised,
    settings: &Settings<'_>,
) -> Vec<CandidateEntry> {
    let situation = first.situation(settings, &Default::default());
    let beside = situation.beside();
    let judged = situation.judge_all(&beside);
    let level = first.ln_level(settings.significance);
    let impacts = impact::of_candidates(block, first, &situation, &judged);
    let measurements = first.null.problem().observations.len() as f64;
    let pixel = improvement.base.problem.observations.iter().map(|o| 1.0 / o.inverse_sigma).sum::<f64>() / measurements;
    let confirmed = |id: &str| -> Option<ConfirmedEntry> {
        improvement.confirmations.iter().rfind(|confirmation| confirmation.id == id).map(confirmed_entry)
    };
    let seen = |a: &Judged, b: &Judged| -> f64 {
        if a.component.is_some() || b.component.is_some() {
            return 0.0;
        }
        let one = separability::seen_by(&beside, &a.pivoted, &b.pivoted);
        one.max(separability::seen_by(&beside, &b.pivoted, &a.pivoted))
    };
    let physical = |judged: &Judged| first.sets[judged.set].physical;
    let id = |judged: &Judged| first.sets[judged.set].id.clone();
    let mut entries: Vec<CandidateEntry> = Vec::new();
    for (position, one) in judged.iter().enumerate() {
        let partners = judged.iter().enumerate();
        let partners = partners.filter(|(other, b)| *other != position && physical(b) && seen(one, b) > INSEPARABLE);
        let inseparable_from = partners.map(|(_, b)| id(b)).collect();
        let estimate = estimates(first, one);
        let change = impacts[position].as_ref().filter(|impact| impact.surveyed).map(|impact| impact.rms_m);
        entries.push(CandidateEntry {
            effect: id(one),
            rank: position + 1,
            kind: kind(physical(one)),
            statistic: one.statistic,
            dof: one.dof,
            p_value: one.ln_p.exp(),
            ln_p_value: one.ln_p,
            significant: one.ln_p < level,
            predicted_drop: one.drop,
            detectable: detectable(first, one, level, change),
            estimate,
            predicted_check_change_m: change,
            size_px: pixel * (one.drop / (2.0 * measurements)).sqrt(),
            impact: impacts[position].clone(),
            inseparable_from,
            design_effect: one.design_effect,
            needs: Vec::new(),
            tested: true,
            confirmed: confirmed(&id(one)),
        });
    }
    let tested: Vec<String> = entries.iter().map(|entry| entry.effect.clone()).collect();
    let absorbed = first
        .sets
        .iter()
        .zip(&first.candidates)
        .filter(|(set, candidate)| candidate.is_some() && !tested.contains(&set.id));
    let mut untested: Vec<(String, bool, Vec<String>)> = Vec::new();
    for (set, _) in absorbed {
        if !untested.iter().any(|(id, ..)| *id == set.id) {
            let needs =
                vec!["a block that does not absorb it: its size would not be known to its plausible range".into()];
            untested.push((set.id.clone(), set.physical, needs));
        }
    }
    untested.extend(first.untested.iter().map(|c| (c.id.clone(), c.physical, c.needs.clone())));
    for (effect, physical, needs) in untested {
        entries.push(CandidateEntry {
            rank: entries.len() + 1,
            kind: kind(physical),
            statistic: 0.0,
            dof: 0.0,
            p_value: 1.0,
            ln_p_value: 0.0,
            significant: false,
            predicted_drop: 0.0,
            estimate: BTreeMap::new(),
            predicted_check_change_m: None,
            size_px: 0.0,
            impact: None,
            inseparable_from: Vec::new(),
            design_effect: 1.0,
            detectable: None,
            needs,
            tested: false,
            confirmed: confirmed(&effect),
            effect,
        });
    }
    entries
}

/// Sizes by parameter.
fn estimates(linearised: &Linearised, judged: &Judged) -> BTreeMap<String, EstimateEntry> {
    let problem = linearised.null.problem();
    let set = &linearised.sets[judged.set];
    let theta = problem.layout().theta(0);
    let mut estimates = BTreeMap::new();
    if let Some(component) = &judged.component {
        let unit = linearised.unit(set.columns[0]);
        let entry = &problem.theta[linearised.null.unknown(set.columns[0]) - theta];
        let descriptor = problem.effects[entry.effect as usize].effect.descriptor();
        for parameter in &descriptor.parameters {
            if let Role::Random(name) = parameter.role {
                let unit_name = parameter.unit.to_string();
                let (value, sigma) = (component.deviation * unit, component.sigma * unit);
                estimates.insert(name.to_string(), EstimateEntry { value, sigma, unit: unit_name });
            }
        }
        return estimates;
    }
    let variances = judged.pivoted.variances();
    for (position, (column, value)) in judged.pivoted.kept.iter().zip(judged.pivoted.estimate().iter()).enumerate() {
        let unknown = linearised.null.unknown(*column);
        let (name, unit) = match unknown.checked_sub(theta) {
            None => (problem.unknown_name(unknown), crate::camera::UNITS[unknown % 12].to_string()),
            Some(t) => {
                let entry = &problem.theta[t];
                let descriptor = problem.effects[entry.effect as usize].effect.descriptor();
                let name = entry.name.strip_prefix(&format!("{}.", descriptor.id)).unwrap_or(&entry.name);
                (name.to_string(), descriptor.parameters[entry.parameter as usize].unit.to_string())
            }
        };
        let scale = linearised.unit(*column);
        let sigma = (variances[position] * judged.inflation).sqrt() * scale;
        estimates.insert(name, EstimateEntry { value: value * scale, sigma, unit });
    }
    estimates
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

fn detectable(linearised: &Linearised, judged: &Judged, ln_level: f64, change: Option<f64>) -> Option<DetectableEntry> {
    let estimate = estimates(linearised, judged).into_values().next()?;
    let size = match (&judged.component, judged.pivoted.kept.as_slice()) {
        (Some(component), _) => component.detectable * linearised.unit(linearised.sets[judged.set].columns[0]),
        (None, [_]) => noncentrality(ln_level.exp(), 1.0).sqrt() * estimate.sigma,
        _ => return None,
    };
    // The change is linear in the size of the effect.
    let check_change_m = change.filter(|_| estimate.value != 0.0).map(|change| change * size / estimate.value.abs());
    Some(DetectableEntry { size, unit: estimate.unit, check_change_m })
}
