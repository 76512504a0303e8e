//! A node of the tree, and how far it is.

use super::change::Change;
use super::tree::{Figures, Saved};
use crate::adjust::Stop;
use std::time::Instant;

/// How far a node is.
#[derive(Debug, Clone, PartialEq)]
pub enum State {
    /// In the queue.
    Waiting,
    /// Being computed, since then.
    Running(Instant),
    /// In its folder.
    Done(Box<Saved>),
    /// Why it failed.
    Failed(String),
    /// Somebody did not want it any more.
    Cancelled,
}

/// A node of the tree.
#[derive(Debug, Clone)]
pub struct Node {
    /// The node that it changes; none for a root.
    pub parent: Option<u32>,
    /// What it changes.
    pub change: Change,
    /// How far it is.
    pub state: State,
    /// Its figures as soon as the solvers are done; what is left is tested after that.
    pub figures: Option<Figures>,
    /// Ends it.
    pub stop: Stop,
}

/// A node that cannot be shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Absent {
    /// It is not there.
    #[error("there is no step {0}")]
    NoNode(u32),
    /// It is not done.
    #[error("step {0} is not done")]
    NotDone(u32),
}
