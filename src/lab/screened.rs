//! Mistakes of people in the block of a node: what is adjusted all the same, and what is said of it.

use super::setup::Source;
use crate::block::{Block, Role};
use crate::diagnose::verdict::{Diagnosis, Verdict};
use crate::mistakes::Mistake;
use crate::model::{Datum, Model};
use crate::screening;
use std::path::PathBuf;
use std::sync::Arc;

impl Source {
    /// A block with the mistakes that were found in it. What is recorded wrongly takes no part, as in a diagnosis.
    pub(super) fn screened(path: PathBuf, recorded: Arc<Block>, mistakes: Vec<Mistake>) -> Self {
        let rest = screening::without(&recorded, &Model::default(), &mistakes);
        let block = rest.map_or_else(|| recorded.clone(), |(block, _)| Arc::new(block));
        Self { path, recorded, block, mistakes, undone: Vec::new() }
    }

    /// The same of a step that undid something.
    pub(super) fn with_undone(self, undone: Vec<Mistake>) -> Self {
        Self { undone, ..self }
    }

    /// `model` with a datum that the block still has. Its name says what takes part, so that an adjustment of the whole
    /// block with it leaves out the same group.
    pub(super) fn possible(&self, model: &Model) -> Model {
        if Arc::ptr_eq(&self.block, &self.recorded) {
            return model.clone();
        }
        let control = self.block.count(Role::Control) > 0;
        let gnss = self.block.images.iter().any(|image| image.gnss.is_some());
        let datum = match (model.datum, control, gnss) {
            (_, false, false) => Datum::Free,
            (Datum::Control | Datum::All, false, true) => Datum::Gnss,
            (Datum::Gnss | Datum::All, true, false) => Datum::Control,
            (datum, ..) => datum,
        };
        Model { datum, ..model.clone() }
    }

    /// Enters the mistakes, and what else was found, into a diagnosis: they are the verdict, whatever effects stand
    /// beside them.
    pub(super) fn judge(&self, diagnosis: &mut Diagnosis, others: Vec<Mistake>) {
        diagnosis.mistakes.clone_from(&self.mistakes);
        diagnosis.mistakes.extend(others);
        if !diagnosis.mistakes.is_empty() {
            diagnosis.verdict = Verdict::Mistake;
        }
    }
}

/// The mistakes in a sentence; `None` where there are none.
pub(super) fn in_words(mistakes: &[Mistake]) -> Option<String> {
    let (first, others) = mistakes.split_first()?;
    Some(match others.len() {
        0 => first.sentence.clone(),
        1 => format!("{} One more mistake was found.", first.sentence),
        n => format!("{} {n} more mistakes were found.", first.sentence),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistakes_are_told_in_a_sentence() {
        let mistake = |sentence: &str| Mistake::new("scale", "control", sentence.into(), String::new());
        assert_eq!(in_words(&[]), None);
        assert_eq!(in_words(&[mistake("Feet.")]).as_deref(), Some("Feet."));
        let two = [mistake("Feet."), mistake("Degrees.")];
        assert_eq!(in_words(&two).as_deref(), Some("Feet. One more mistake was found."));
    }
}
