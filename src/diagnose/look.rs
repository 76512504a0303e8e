//! One model looked at as it stands: its residual structure, and what may be missing beside it. Nothing is added,
//! nothing taken out.

use super::competition::{Next, next};
use super::conclusion::diagnosis;
use super::improvement::Improvement;
use super::left::{self, Left};
use super::linearised::{Linearised, linearise};
use super::settings::Settings;
use super::verdict::{Diagnosis, Verdict};
use crate::block::Block;
use crate::run::RunError;

/// What a look showed.
pub struct Look {
    /// The fit with every candidate beside it.
    pub linearised: Linearised,
    /// Unexplained structure.
    pub left: Left,
    /// The same as `diagnosis.json` has it. The verdict is of the model as it stands: `missing` where the objective
    /// prefers another set, whose first member is then recommended; `unexplained` where structure remains all the same.
    pub diagnosis: Diagnosis,
    /// What the objective asks for next; `None`: nothing enters, nothing leaves.
    pub next: Option<Next>,
}

/// Looks at the fit of `improvement`. `outliers`: how many measurements of the block were set aside before.
///
/// # Errors
/// A fit that cannot be linearised.
pub fn look(
    block: &Block,
    improvement: &Improvement,
    outliers: usize,
    settings: &Settings<'_>,
) -> Result<Look, RunError> {
    (settings.tell)("testing what may be missing");
    let linearised = linearise(block, &improvement.fit, &improvement.parts, settings)?;
    (settings.tell)("testing the residuals");
    let left = left::analyse(block, improvement, &linearised, settings)?;
    let mut found =
        diagnosis(block, improvement, &linearised, &linearised, &left, &left.structure, outliers, settings)?;
    let next = next(&linearised, &improvement.prices, settings);
    match &next {
        Some(Next::Add(id)) => {
            found.verdict = Verdict::Missing;
            found.recommended = vec![id.clone()];
        }
        _ if found.verdict == Verdict::Missing => found.verdict = Verdict::Adequate,
        _ => {}
    }
    Ok(Look { linearised, left, diagnosis: found, next })
}
