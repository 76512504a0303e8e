//! A node with everything that the next step, and a prediction, go on from.

use super::changing::Changed;
use super::predicted::Predicted;
use super::state::Lab;
use super::tree::Saved;
use crate::adjust::Stop;
use crate::block::Block;
use crate::diagnose::added::Added;
use crate::diagnose::fit::{Fit, fit};
use crate::diagnose::improve::Improvement;
use crate::diagnose::linearised::Linearised;
use crate::diagnose::look::{Look, look};
use crate::diagnose::select::Event as Asked;
use crate::diagnose::verdict::LedgerRow;
use crate::io::model::read_model;
use crate::report::pictures::RunFolder;
use crate::run::folder::{OutlierRow, read_outliers};
use crate::run::set_aside;
use anyhow::Result;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};
/// A node with everything that the next step, and a prediction, go on from.
pub struct Live {
    /// The block without what is set aside.
    pub block: Block,
    /// What is set aside.
    pub set_aside: Vec<OutlierRow>,
    /// The fit, and how it came about.
    pub improvement: Improvement,
    /// The fit with every candidate beside it.
    pub linearised: Linearised,
    /// What the rules ask for next.
    pub next: Option<Asked>,
    /// One row per step from the root.
    pub ledger: Vec<LedgerRow>,
    /// Predictions that were asked for.
    pub predicted: Mutex<HashMap<String, Result<Arc<Predicted>, String>>>,
}

impl Live {
    pub(super) fn new(changed: Changed, look: Look, ledger: Vec<LedgerRow>) -> Self {
        let Changed { block, set_aside, improvement } = changed;
        let Look { linearised, next, .. } = look;
        Self { block, set_aside, improvement, linearised, next, ledger, predicted: Mutex::default() }
    }

    /// Takes up a node from its folder.
    ///
    /// # Errors
    /// A folder that cannot be read; a fit that does not converge any more.
    pub fn restore(lab: &Lab, id: u32, saved: &Saved) -> Result<Self> {
        let dir = lab.setup.folder.step(id);
        let source = lab.source(id)?;
        let (file, set_aside) = read_outliers(&dir)?.unwrap_or_else(|| (dir.join("outliers.csv"), Vec::new()));
        let block = set_aside::without(&source.block, &set_aside, &file)?;
        let model = read_model(&dir.join("model.toml"), &|id| lab.effect(id))?;
        let stop = Stop::default();
        let settings = lab.settings(&stop, false, &|_| {});
        let fitted = fit(&block, &model, None, &settings.options)?;
        let parts = Added { own: saved.own, freed: saved.freed.clone(), placed: saved.placed.clone() };
        let improvement = Improvement::with(&block, fitted, parts, &settings)?;
        let look = look(&block, &improvement, set_aside.len(), &settings)?;
        let ledger =
            RunFolder::read_without_residuals(&dir)?.diagnosis.map_or(Vec::new(), |diagnosis| diagnosis.ledger);
        Ok(Self::new(Changed { block, set_aside, improvement }, look, ledger))
    }

    /// The fit.
    pub fn fit(&self) -> &Fit {
        &self.improvement.fit
    }
}
