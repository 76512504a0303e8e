//! The model that a diagnosis hands on, adjusted with both solvers.

use super::models::with_search_held;
use crate::adjust::{Options, Solver};
use crate::block::Block;
use crate::model::Model;
use crate::run::fit::Fit;
use crate::run::{self, Progress, Run, RunError};

/// A model that is handed on, adjusted to the last digit by `solvers`.
pub struct HandedOn {
    /// The model.
    pub model: Model,
    /// Its adjustment.
    pub run: Run,
    /// Why places that were searched are held; `None` where they were found again.
    pub held: Option<String>,
}

/// Adjusts the model that a diagnosis hands on with each solver, from where the diagnosis ended. Where that fails with a place that was
/// searched, the place stays where the diagnosis found it.
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
