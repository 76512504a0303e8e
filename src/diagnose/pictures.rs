//! What a diagnosis shows, as rows of the run folder: the effects that it found, and the structure of the residuals
//! before and after they were added.

use super::shown::marks;
use crate::block::Block;
use crate::measure::MeasureError;
use crate::residuals::Structure;
use crate::run::fit::Fit;
use crate::run::folder::{self, BASE, FINAL, FoundRow, ModelCheckRow};
use crate::run::{self, RunError};

/// What the pictures of a diagnosis are drawn from.
pub struct Shown<'a> {
    /// The block without outliers.
    pub block: &'a Block,
    /// The model before anything was added; `None` where nothing was, or it is not to be shown.
    pub base: Option<&'a Fit>,
    /// The model that is handed on.
    pub fit: &'a Fit,
    /// What was taken in.
    pub added: &'a [String],
    /// Structure before anything was added; `None` where nothing was, or it is not to be shown.
    pub before: Option<&'a Structure>,
    /// Structure that is left.
    pub after: &'a Structure,
}

impl Shown<'_> {
    /// The rows of both stages; those of the final one alone where there is no other.
    ///
    /// # Errors
    /// A model without one of the effects that cannot be projected.
    pub fn rows(&self) -> Result<folder::Pictures, RunError> {
        let before = self.before.map(|before| (BASE, before));
        let mut rows = folder::Pictures { found: self.found()?, checks: self.checks()?, ..folder::Pictures::default() };
        for (stage, structure) in before.into_iter().chain([(FINAL, self.after)]) {
            structure.pictures.add_rows(&mut rows, self.block, stage);
        }
        Ok(rows)
    }

    /// Surveyed points against the model before anything was added, and against the one that is handed on.
    fn checks(&self) -> Result<Vec<ModelCheckRow>, RunError> {
        let mut rows = Vec::new();
        let Some(base) = self.base else { return Ok(rows) };
        for (stage, fit) in [(BASE, base), (FINAL, self.fit)] {
            let comparison = run::compare(self.block, &fit.problem, &fit.solution)?;
            rows.extend(comparison.iter().flat_map(|of| folder::checks_by_model(self.block, of, stage)));
        }
        Ok(rows)
    }

    /// The picture of every effect that was found.
    fn found(&self) -> Result<Vec<FoundRow>, MeasureError> {
        let mut rows = Vec::new();
        for effect in self.added {
            for mark in marks(self.base, self.fit, effect)? {
                rows.push(FoundRow {
                    effect: effect.clone(),
                    stage: mark.stage.into(),
                    against: mark.against.into(),
                    component: mark.component.into(),
                    unit: mark.unit.into(),
                    camera: mark.y.map_or(String::new(), |_| self.block.cameras[mark.camera].id.clone()),
                    x: mark.x,
                    y: mark.y,
                    n: mark.n,
                    mean: mark.mean,
                    sigma: mark.sigma,
                });
            }
        }
        Ok(rows)
    }
}
