//! One model looked at as it stands: what it leaves, and what may be missing beside it. Nothing is added, nothing taken out.

use super::conclusion::diagnosis;
use super::fit::DiagnoseError;
use super::improve::Improvement;
use super::left::{self, Left};
use super::linearised::{Linearised, linearise};
use super::scan::Places;
use super::select::{self, Event};
use super::settings::Settings;
use super::verdict::{Diagnosis, Verdict};
use crate::block::Block;

/// What a look showed.
pub struct Look {
    /// The fit with every candidate beside it.
    pub linearised: Linearised,
    /// What is left.
    pub left: Left,
    /// The same as `diagnosis.json` has it. The verdict is of the model as it stands: `missing` where the rules would take something in, which
    /// is then recommended; `unexplained` where something is left all the same.
    pub diagnosis: Diagnosis,
    /// What the rules ask for next; `None`: nothing enters, nothing leaves.
    pub next: Option<Event>,
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
) -> Result<Look, DiagnoseError> {
    (settings.tell)("testing what may be missing");
    let linearised = linearise(block, &improvement.fit, &improvement.parts, true, &Places::new(), settings)?;
    (settings.tell)("testing what is left");
    let left = left::analyse(block, improvement, &linearised, settings)?;
    let mut found =
        diagnosis(block, improvement, &linearised, &linearised, &left, &left.structure, outliers, settings)?;
    let mut situation = linearised.situation(settings, &improvement.refused());
    let next = loop {
        match select::next(&situation) {
            // What it is only refits tell.
            Some(Event::Resembled { set }) => situation.unresolved.insert(linearised.sets[set].id.clone()),
            next => break next,
        };
    };
    match &next {
        Some(Event::Added { set }) => {
            found.verdict = Verdict::Missing;
            found.recommended = vec![linearised.sets[*set].id.clone()];
        }
        _ if found.verdict == Verdict::Missing => found.verdict = Verdict::Adequate,
        _ => {}
    }
    Ok(Look { linearised, left, diagnosis: found, next })
}
