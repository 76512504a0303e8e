//! How far the effects of a chain of steps moved the points: between the last step that has none of them and this one.

use super::live::Changed;
use super::state::Lab;
use super::step::Step;
use crate::diagnose::moved::{Moved, between};
use crate::io::model::read_model;
use anyhow::Result;

impl Step<'_> {
    /// `None` where the model has no effects that a step took in, and where a mistake was mended after the first: the
    /// blocks of the two adjustments then differ by more than the effects.
    ///
    /// # Errors
    /// A step that cannot be taken up again.
    pub(super) fn moved(&self, changed: &Changed) -> Result<Option<Moved>> {
        if changed.improvement.added.is_empty() || self.change.has_block() {
            return Ok(None);
        }
        let lab = self.lab;
        let above = self.parent.map_or(Ok(Vec::new()), |parent| lab.path(parent))?;
        for (row, step) in above.into_iter().enumerate().rev() {
            if lab.is_without_effects(step)? {
                let last = &changed.improvement.fit;
                let moved = match lab.kept(step) {
                    Some(live) => between(&changed.block, live.fit(), last)?,
                    None => between(&changed.block, &lab.refitted(step)?.fit, last)?,
                };
                return Ok(moved.map(|moved| Moved { step: row, ..moved }));
            }
            if lab.saved(step)?.change.has_block() {
                return Ok(None);
            }
        }
        Ok(None)
    }
}

impl Lab {
    /// Has no step up to this one taken anything into the model?
    fn is_without_effects(&self, id: u32) -> Result<bool> {
        let saved = self.saved(id)?;
        let model = read_model(&self.setup.folder.step(id).join("model.toml"), &|id| self.effect(id))?;
        Ok(model.effects.len() <= saved.own && saved.freed.is_empty())
    }
}
