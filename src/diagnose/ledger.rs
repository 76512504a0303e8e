//! The ledger of an improvement: what happened in each step, and what became of each candidate that was tried.

use crate::block::Block;
use crate::model::Model;
use crate::run;
use crate::run::RunError;
use crate::run::fit::Fit;

/// What happened in a step of the ledger.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// The base.
    Base,
    /// Effects came in, or left.
    Exchanged {
        /// Ids of those that came in.
        added: Vec<String>,
        /// Ids of those that left.
        removed: Vec<String>,
    },
    /// Outliers or weights changed.
    Reweighted,
}

/// One row of the ledger.
#[derive(Debug, Clone)]
pub struct Step {
    /// What happened.
    pub change: Change,
    /// Why, in words; empty for the base and where the objective says it.
    pub why: String,
    /// Model of the step, start values those of its solution.
    pub model: Model,
    /// `sqrt(v'Pv / redundancy)`.
    pub sigma0: f64,
    /// RMS of tie residuals per coordinate, px.
    pub tie_rms_px: f64,
    /// Typical error of predictions of left-out measurements, px.
    pub heldout_px: f64,
    /// 3D RMS at check points, m.
    pub check_rms_m: Option<f64>,
    /// `v'Pv` of the step before less that of this one, on the same measurements and weights.
    pub drop: f64,
    /// Drop that the null model predicted.
    pub predicted: f64,
    /// Logarithm of the p-value of the drop, among chi-squares of as many degrees of freedom as the step added; zero
    /// where nothing was tested.
    pub ln_p: f64,
    /// The objective, zero at the base: it falls from row to row.
    pub objective: f64,
    /// Iterations of its refit.
    pub iterations: usize,
}

/// A candidate that was refitted.
#[derive(Debug, Clone)]
pub struct Confirmation {
    /// Id.
    pub id: String,
    /// Predicted drop.
    pub predicted: f64,
    /// Drop of the refit.
    pub drop: f64,
    /// Held-out error before and after, px.
    pub before_px: f64,
    /// See `before_px`.
    pub after_px: f64,
    /// It was kept.
    pub kept: bool,
    /// Why not; empty otherwise.
    pub reason: String,
}

impl Change {
    /// What changed, as `diagnosis.json` has it; `None` for the base.
    pub fn label(&self) -> Option<String> {
        match self {
            Change::Base => None,
            Change::Exchanged { added, removed } => {
                let removed = removed.iter().map(|id| format!("-{id}"));
                Some(added.iter().cloned().chain(removed).collect::<Vec<_>>().join(", "))
            }
            Change::Reweighted => Some("(weights, outliers)".into()),
        }
    }
}

impl Step {
    /// The row of a fit: what a step was, and what it came to.
    ///
    /// # Errors
    /// A state that cannot be compared with the surveyed points.
    pub(super) fn of(
        block: &Block,
        fit: &Fit,
        heldout_px: f64,
        objective: f64,
        change: Change,
        why: &str,
    ) -> Result<Self, RunError> {
        let Fit { model, problem, solution, .. } = fit;
        let comparison = run::compare(block, problem, solution)?;
        Ok(Self {
            change,
            why: why.into(),
            model: model.clone(),
            sigma0: (fit.chi_square() / problem.redundancy().2 as f64).sqrt(),
            tie_rms_px: run::tie_rms_px(block, problem, &solution.state)?,
            heldout_px,
            check_rms_m: comparison.and_then(|comparison| comparison.check).map(|check| check.rms_m.xyz),
            drop: 0.0,
            predicted: 0.0,
            ln_p: 0.0,
            objective,
            iterations: solution.iterations,
        })
    }
}
