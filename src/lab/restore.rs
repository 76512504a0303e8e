//! Nodes taken up again from their folders.

use super::live::{Changed, Live};
use super::state::Lab;
use super::tree::Saved;
use crate::adjust::Stop;
use crate::block::Block;
use crate::diagnose::added::Added;
use crate::diagnose::improvement::Improvement;
use crate::diagnose::look::look;
use crate::io::model::read_model;
use crate::report::pictures::RunFolder;
use crate::run::fit::{Fit, fit};
use crate::run::folder::{OutlierRow, read_outliers};
use crate::run::set_aside;
use anyhow::{Context, Result};
use std::sync::Arc;

/// The fit of a node, and its measurements.
pub(super) struct Refitted {
    /// Without what is set aside.
    pub block: Block,
    /// What is set aside.
    pub set_aside: Vec<OutlierRow>,
    /// The fit.
    pub fit: Fit,
}

impl Lab {
    /// A node with its fit and null model.
    ///
    /// # Errors
    /// A node that is not done; a fit that does not come out again.
    pub fn live(&self, id: u32) -> Result<Arc<Live>> {
        if let Some(live) = self.kept(id) {
            return Ok(live);
        }
        let saved = self.saved(id)?;
        let live = self.restore(id, &saved).with_context(|| format!("step {id} cannot be taken up again"))?;
        let live = Arc::new(live);
        self.keep(id, live.clone());
        Ok(live)
    }

    /// Takes up a node from its folder.
    ///
    /// # Errors
    /// A folder that cannot be read; a fit that does not converge any more.
    fn restore(&self, id: u32, saved: &Saved) -> Result<Live> {
        let Refitted { block, set_aside, fit } = self.refitted(id)?;
        let stop = Stop::default();
        let settings = self.settings(&stop, false, &|_| {});
        let parts = Added { own: saved.own, freed: saved.freed.clone(), placed: saved.placed.clone() };
        let improvement = Improvement::with(&block, fit, parts, &settings)?;
        let look = look(&block, &improvement, set_aside.len(), &settings)?;
        let ledger =
            RunFolder::read(&self.setup.folder.step(id))?.diagnosis.map_or(Vec::new(), |diagnosis| diagnosis.ledger);
        Ok(Live::new(Changed { block, set_aside, improvement }, look, ledger))
    }

    /// The fit of a node, from its folder alone.
    ///
    /// # Errors
    /// A folder that cannot be read; a fit that does not converge any more.
    pub(super) fn refitted(&self, id: u32) -> Result<Refitted> {
        let dir = self.setup.folder.step(id);
        let source = self.source(id)?;
        let (file, set_aside) = read_outliers(&dir)?.unwrap_or_else(|| (dir.join("outliers.csv"), Vec::new()));
        let block = set_aside::without(&source.block, &set_aside, &file)?;
        let model = read_model(&dir.join("model.toml"), &|id| self.effect(id))?;
        let stop = Stop::default();
        let fit = fit(&block, &model, None, &self.settings(&stop, false, &|_| {}).options)?;
        Ok(Refitted { block, set_aside, fit })
    }
}
