//! The model that a diagnosis hands on, adjusted with both solvers.

use super::models::with_search_held;
use super::run::Diagnosed;
use super::settings::Settings;
use super::verdict::{Diagnosis, LedgerRow};
use crate::adjust::{Options, Solver};
use crate::block::Block;
use crate::model::Model;
use crate::run::fit::Fit;
use crate::run::{self, Progress, Run, RunError};
use std::ops::ControlFlow;

/// A model that is handed on, adjusted to the last digit by `solvers`.
pub struct HandedOn {
    /// The model.
    pub model: Model,
    /// Its adjustment.
    pub run: Run,
    /// Why places that were searched are held; `None` where they were found again.
    pub held: Option<String>,
}

/// Which model of a diagnosis is handed on. Both are diagnosed in the same way: whether the remaining misfit has a
/// cause shows only when the cause is included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keep {
    /// The base model.
    Base,
    /// The model of the last step.
    Improved,
}

impl Diagnosed {
    /// Adjusts the model that is handed on with each solver, and completes the diagnosis: do the solvers agree on it,
    /// and does the remaining misfit matter beside the precision of the points, or beside `tolerance_m`?
    ///
    /// The models on the way decide nothing any more: their rows of the ledger keep the native solver's figures.
    ///
    /// # Errors
    /// Those of [`run::adjust_from`].
    pub fn hand_on(
        &mut self,
        keep: Keep,
        solvers: &[&dyn Solver],
        tolerance_m: Option<f64>,
        settings: &Settings<'_>,
    ) -> Result<HandedOn, RunError> {
        (settings.tell)(match solvers {
            [_] => "adjusting the final model with one solver",
            _ => "adjusting the final model with both solvers",
        });
        let ended = match keep {
            Keep::Base => &self.improvement.base,
            Keep::Improved => &self.improvement.fit,
        };
        let go_on: &mut Progress<'_> = &mut |_, _| ControlFlow::Continue(());
        let mut handed_on = adjust_handed_on(&self.block, ended, solvers, &settings.options, go_on)?;
        let ledger = &mut self.diagnosis.ledger;
        let row = match keep {
            Keep::Base => ledger.first_mut(),
            Keep::Improved => ledger.last_mut(),
        };
        row.into_iter().for_each(|row| row.adjusted_by_both(&handed_on.run));
        self.diagnosis.complete(&mut handed_on.run, tolerance_m);
        Ok(handed_on)
    }
}

impl LedgerRow {
    /// Notes whether the solvers agree on the model of this row.
    pub fn adjusted_by_both(&mut self, run: &Run) {
        let Some(agreement) = &run.agreement else { return };
        self.solvers_agree = Some(agreement.agree);
        self.one_derivation.clone_from(&agreement.one_derivation);
    }
}

impl Diagnosis {
    /// Takes the precision of the points from the final adjustment, and tells that of the mistakes.
    pub fn complete(&mut self, run: &mut Run, tolerance_m: Option<f64>) {
        run.mistakes.clone_from(&self.mistakes);
        self.weigh(run.point_sigma_m(), tolerance_m);
    }
}

/// Adjusts the model that a diagnosis hands on with each solver, from where the diagnosis ended. Where that fails with
/// a place that was searched, the place stays where the diagnosis found it.
///
/// # Errors
/// Those of [`run::adjust_from`].
pub fn adjust_handed_on(
    block: &Block,
    ended: &Fit,
    solvers: &[&dyn Solver],
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<HandedOn, RunError> {
    let model = ended.model.clone();
    let near = Some((&ended.problem, &ended.solution.state));
    let error = match run::adjust_from(block, &model, near, solvers, options, progress) {
        Ok(run) => return Ok(HandedOn { model, run, held: None }),
        Err(error) => error,
    };
    match with_search_held(&model) {
        Some(model) if !options.stop.is_raised() => {
            let run = run::adjust_from(block, &model, near, solvers, options, progress)?;
            let held = format!("{error}\nso the places that were searched are held where they were found");
            Ok(HandedOn { model, run, held: Some(held) })
        }
        _ => Err(error),
    }
}
