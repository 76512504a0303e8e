//! What a laboratory is opened with.

use super::photos::Photos;
use super::simulated::Simulated;
use super::tree::Folder;
use crate::adjust::Solver;
use crate::block::Block;
use crate::mistakes::Mistake;
use crate::model::{EffectRef, Model};
use crate::run::folder::OutlierRow;
use std::path::PathBuf;
use std::sync::Arc;

/// What the laboratory was opened with.
pub struct Setup {
    /// Folder of the block.
    pub source: PathBuf,
    /// The block, about its centre.
    pub block: Block,
    /// Measurements that the run of `--model` set aside.
    pub set_aside: Vec<OutlierRow>,
    /// The base model.
    pub model: Model,
    /// Effects of plug-ins.
    pub plugins: Vec<EffectRef>,
    /// The solvers of every step.
    pub solvers: Vec<&'static dyn Solver>,
    /// Are outliers searched at the base?
    pub snoop: bool,
    /// Probability with which an adequate block is told that something is missing.
    pub significance: f64,
    /// Threads.
    pub threads: usize,
    /// Where steps are kept.
    pub folder: Folder,
    /// Of a block whose errors one chooses.
    pub simulated: Option<Simulated>,
    /// The images themselves.
    pub photos: Option<Photos>,
}

/// The block of a root, or of a step that mends, with all that stands beneath it.
pub struct Source {
    /// Folder of the block as it was read.
    pub path: PathBuf,
    /// The block as it is recorded, about its centre; of a step that mends, with mistakes undone.
    pub recorded: Arc<Block>,
    /// The block that is adjusted: without what is recorded wrongly.
    pub block: Arc<Block>,
    /// What is recorded wrongly.
    pub mistakes: Vec<Mistake>,
    /// What the step undid, in this order; nothing of a root.
    pub undone: Vec<Mistake>,
}
