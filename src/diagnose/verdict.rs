//! `diagnosis.json`: what was found, in the keys that scripts rely on, and the verdict.

use super::impact::Impact;
use super::imprecise::Imprecise;
use super::knowledge::Known;
use super::moved::Moved;
use crate::effects::Words;
use crate::math::null_is_nan;
use crate::mistakes::Mistake;
use crate::model::{FlightFactors, SigmaFactors};
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
    /// Somebody made a mistake: the survey contradicts the images or itself, or much was set aside.
    Mistake,
}

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
    /// What people got wrong; empty where nothing was found. The diagnosis went on without it.
    #[serde(default)]
    pub mistakes: Vec<Mistake>,
    /// The effects that the diagnosis took in, at the final model.
    #[serde(default)]
    pub found: Vec<FoundEntry>,
    /// The shape of what is left.
    #[serde(default)]
    pub left_shapes: Vec<LeftEntry>,
    /// How what is left weighs; null before the final adjustment has told the precision of the points.
    #[serde(default)]
    pub weight: Option<Weight>,
    /// How far the points of the final model lie from those of the base; null where nothing was added.
    #[serde(default)]
    pub moved: Option<Moved>,
    /// The height errors of the check points against what the block's own errors allow, in a sentence; null where they
    /// were not tested.
    #[serde(default)]
    pub check_points: Option<String>,
    /// Effects that the final model added (of a diagnosis without improvement: that it recommends to add first).
    pub recommended: Vec<String>,
    /// Tests of residual structure, at the final model.
    pub structure: Vec<StructureEntry>,
    /// What is left, in words; empty where nothing is.
    pub left: Vec<String>,
    /// One row per model tried.
    pub ledger: Vec<LedgerRow>,
    /// Factors that the stated standard deviations were multiplied by.
    pub sigma_factors: SigmaFactors,
    /// The same of single flights, where they were asked for.
    #[serde(default)]
    pub flight_factors: BTreeMap<String, FlightFactors>,
    /// Groups that are much less precise than stated.
    #[serde(default)]
    pub imprecise: Vec<Imprecise>,
    /// Measurements that were set aside as outliers.
    pub outliers: usize,
    /// Points of which measurements were set aside, where they are few.
    #[serde(default)]
    pub outlier_points: Vec<String>,
    /// Sizes that are known from elsewhere, held in every model.
    #[serde(default)]
    pub known: Vec<Known>,
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
    /// Factor by which the size is larger because values of a sample of the images are tested, not those of all; 1
    /// where all are.
    #[serde(default = "all_are_tested")]
    pub factor_of_sample: f64,
}

fn all_are_tested() -> f64 {
    1.0
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
    /// What the statistic is: `F`, or `z` of the sum of squared scores of a random effect, standardised. Empty in a
    /// file of before it was noted.
    #[serde(default)]
    pub test: String,
    /// Degrees of freedom.
    #[serde(deserialize_with = "null_is_nan")]
    pub dof: f64,
    /// Of this test alone, corrected for a scan.
    #[serde(deserialize_with = "null_is_nan")]
    pub p_value: f64,
    /// Its natural logarithm, which does not underflow.
    #[serde(deserialize_with = "null_is_nan")]
    pub ln_p_value: f64,
    /// The p-value among all candidates (Sidak): that any of them is as clear by chance. Null in a file of before it
    /// was computed, and where there was no test.
    #[serde(default)]
    pub family_p_value: Option<f64>,
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
    /// Is the estimate within what physics allows? Where not, a shape that looks like the effect, but not its cause.
    #[serde(default = "yes")]
    pub plausible: bool,
    /// Candidates that this block cannot tell from this one: a correlation above 0.9, and for what was found those of
    /// [`FoundEntry`], too.
    pub inseparable_from: Vec<String>,
    /// Factor on the variance of the score from measurements that err together.
    #[serde(deserialize_with = "null_is_nan")]
    pub design_effect: f64,
    /// See [`DetectableEntry`]; null for candidates of several parameters or of a place.
    pub detectable: Option<DetectableEntry>,
    /// What the block lacks to test it.
    pub needs: Vec<String>,
    /// Was it tested?
    pub tested: bool,
    /// What a refit showed; null where none was made.
    pub confirmed: Option<ConfirmedEntry>,
}

fn yes() -> bool {
    true
}

/// An effect that the diagnosis took in, at the final model.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FoundEntry {
    /// Id.
    pub effect: String,
    /// Sizes by parameter.
    pub estimate: BTreeMap<String, EstimateEntry>,
    /// What `v'Pv` rises by without it.
    #[serde(deserialize_with = "null_is_nan")]
    pub drop: f64,
    /// Beside everything else that is in.
    #[serde(deserialize_with = "null_is_nan")]
    pub p_value: f64,
    /// Its natural logarithm.
    #[serde(deserialize_with = "null_is_nan")]
    pub ln_p_value: f64,
    /// RMS of what it adds to the image measurements and nothing else absorbs, px.
    #[serde(deserialize_with = "null_is_nan")]
    pub size_px: f64,
    /// How far points move when it is left out.
    pub impact: Option<Impact>,
    /// Candidates that this block cannot tell from it: a correlation above 0.9 at the base model, or significant in its
    /// place and nothing of it left beside them at the final one.
    pub inseparable_from: Vec<String>,
    /// Is the estimate within what physics allows?
    pub plausible: bool,
    /// Options of the effect that are not the default, as `--add` takes them: `against` is `order`.
    #[serde(default)]
    pub options: BTreeMap<String, String>,
    /// Where the velocities come from that it multiplies, in words; `None`: it needs none.
    #[serde(default)]
    pub inputs: Option<String>,
    /// What it is, what to do and what would tell it apart, as its descriptor has it; `None` of a freed camera group,
    /// and of a plug-in that states no words.
    #[serde(default)]
    pub words: Option<Words>,
}

/// A shape that is left, described by an empirical field.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LeftEntry {
    /// The field.
    pub field: String,
    /// RMS over all image coordinates, px.
    #[serde(deserialize_with = "null_is_nan")]
    pub size_px: f64,
    /// How far points move when the field takes it away.
    pub impact: Option<Impact>,
}

/// How what is left weighs against the precision of the points.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Weight {
    /// Typical standard deviation of a point in space, m.
    #[serde(deserialize_with = "null_is_nan")]
    pub precision_m: f64,
    /// What the user tolerates, m.
    pub tolerance_m: Option<f64>,
    /// In words.
    pub sentence: String,
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
    /// The objective, zero at the base: it falls from row to row.
    #[serde(default, deserialize_with = "null_is_nan")]
    pub objective: f64,
    /// p-value of the drop among chi-squares; one where nothing was tested.
    #[serde(deserialize_with = "null_is_nan")]
    pub p_value: f64,
    /// Do the solvers agree on this model? Null where it was adjusted with one of them.
    #[serde(default)]
    pub solvers_agree: Option<bool>,
    /// Effects with one derivation, of which that agreement proves nothing; left out without any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub one_derivation: Vec<String>,
}
