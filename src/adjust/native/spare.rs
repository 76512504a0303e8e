//! Systems that nobody needs any more: memory that was asked for once need not be asked for again.

use super::system::System;
use std::sync::{Mutex, PoisonError};

/// What the next linearisation of a problem fills again.
#[derive(Debug, Default)]
pub struct Spare {
    /// Systems of chunks.
    pub parts: Mutex<Vec<System>>,
    whole: Mutex<Option<System>>,
}

impl Spare {
    /// Keeps the system of a problem.
    pub fn keep(&self, system: System) {
        *self.whole.lock().unwrap_or_else(PoisonError::into_inner) = Some(system);
    }

    /// Gives the one that was kept.
    pub fn take(&self) -> Option<System> {
        self.whole.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}
