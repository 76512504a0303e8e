//! What happens while somebody waits.

use serde::Serialize;

/// An event of the stream.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum Event {
    /// A step goes on.
    Progress {
        /// The step.
        node: u32,
        /// `diagnosing`, `solving` or `writing`.
        phase: &'static str,
        /// What is being done.
        text: Option<String>,
        /// Solver, number of its iteration, and its cost; of `solving` alone.
        solver: Option<&'static str>,
        /// See `solver`.
        iteration: Option<usize>,
        /// See `solver`.
        cost: Option<f64>,
    },
    /// The tree changed.
    Tree {},
    /// A step is done.
    Done {
        /// The step.
        node: u32,
    },
    /// A step turned out to be none: there was nothing to do.
    Nothing {
        /// The step, which is not in the tree any more.
        node: u32,
        /// Why there was nothing to do.
        text: String,
    },
    /// A step failed or was cancelled.
    Failed {
        /// The step.
        node: u32,
        /// Why.
        error: String,
    },
}

impl Event {
    /// Its name in the stream.
    pub fn name(&self) -> &'static str {
        match self {
            Event::Progress { .. } => "progress",
            Event::Tree {} => "tree",
            Event::Done { .. } => "done",
            Event::Nothing { .. } => "nothing",
            Event::Failed { .. } => "failed",
        }
    }

    /// A step tells what it is doing.
    pub fn told(node: u32, phase: &'static str, text: &str) -> Self {
        Event::Progress { node, phase, text: Some(text.into()), solver: None, iteration: None, cost: None }
    }
}
