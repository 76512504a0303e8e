//! What the worker is asked for.

use super::change::Change;
use crate::adjust::Stop;

/// A step in the queue.
pub struct Job {
    /// Its number.
    pub id: u32,
    /// What it changes.
    pub parent: Option<u32>,
    /// How.
    pub change: Change,
    /// Ends it.
    pub stop: Stop,
}
