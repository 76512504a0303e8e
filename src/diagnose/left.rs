//! Unexplained structure beside the effects in the model: fields that the objective took in, tests of the residuals.

use super::catalogue;
use super::improvement::Improvement;
use super::linearised::{Linearised, Questions, with_candidates};
use super::select::Judged;
use super::settings::Settings;
use crate::block::Block;
use crate::null_model::{Columns, measurements_at};
use crate::residuals::{self, Structure, check_points};
use crate::run::RunError;
use crate::run::fit::Fit;

/// Unexplained structure.
pub struct Left {
    /// Empirical fields in the model, and those that are significant beside it.
    pub fields: Vec<Field>,
    /// Tests of structure.
    pub structure: Structure,
    /// The fit with the columns of empirical fields and of all tests of structure, each of them apart from the others.
    pub shapes: Linearised,
}

/// An empirical field.
pub struct Field {
    /// Its id.
    pub id: String,
    /// Drop of `v'Pv`.
    pub drop: f64,
}

/// Judges what the model as it stands leaves.
///
/// # Errors
/// A fit that cannot be linearised.
pub fn analyse(
    block: &Block,
    improvement: &Improvement,
    linearised: &Linearised,
    settings: &Settings<'_>,
) -> Result<Left, RunError> {
    let fit = &improvement.fit;
    let Fit { problem, solution, .. } = fit;
    let state = &solution.state;
    let heights = check_points::of_fit(block, fit, settings.significance, settings.options.threads)?;
    let measurements = measurements_at(problem, state, settings.options.threads)?;
    let mut layout = residuals::Layout::new(problem, state, &measurements, settings.options.threads)?;
    let asked = |extra: &dyn Columns| {
        let is_field = |candidate: &super::candidate::Candidate| !candidate.physical;
        let (tested, _) = catalogue::candidates(block, fit, &improvement.parts, settings.plugins, is_field);
        let asked = Questions { tested, extra, clustered: true, ..Questions::nothing() };
        with_candidates(block, fit, &improvement.parts, asked, settings)
    };
    let (shapes, structure) = layout.analyse(&heights, settings.significance, |columns| {
        let linearised = asked(columns)?;
        let beside = linearised.situation(settings).beside().into_system();
        let spread = residuals::Spread::of(&linearised.scores);
        Ok::<_, RunError>((linearised, beside, spread))
    })?;
    let fields = fields_in(linearised, settings);
    Ok(Left { fields, structure, shapes })
}

/// Empirical fields that the objective took in.
fn fields_in(linearised: &Linearised, settings: &Settings<'_>) -> Vec<Field> {
    let situation = linearised.situation(settings);
    let taken = linearised.taken.iter().filter(|taken| !linearised.sets[taken.set].physical);
    let field = |taken: &super::select::Taken| {
        let id = linearised.sets[taken.set].id.clone();
        let without = situation.without(&id);
        let drop = without.judge(taken.set, &without.beside()).map_or(0.0, |judged: Judged| judged.drop);
        Field { id, drop }
    };
    taken.map(field).collect()
}
