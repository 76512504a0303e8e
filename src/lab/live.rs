//! A node with everything that the next step, and a prediction, go on from.

use super::predicted::Predicted;
use crate::block::Block;
use crate::diagnose::competition::Next;
use crate::diagnose::improvement::Improvement;
use crate::diagnose::linearised::Linearised;
use crate::diagnose::look::Look;
use crate::diagnose::verdict::LedgerRow;
use crate::run::fit::Fit;
use crate::run::folder::OutlierRow;
use anyhow::Result;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// What a change makes of a node before anybody looks at it.
pub(super) struct Changed {
    pub block: Block,
    pub set_aside: Vec<OutlierRow>,
    pub improvement: Improvement,
}

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
    /// What the objective asks for next.
    pub next: Option<Next>,
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

    /// The fit.
    pub fn fit(&self) -> &Fit {
        &self.improvement.fit
    }
}
