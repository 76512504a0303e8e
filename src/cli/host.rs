//! Who hears what a command does: standard error, or the program that calls the library.

use super::Console;
use super::console::{Expected, Progress};
use crate::block::Block;
use crate::memory;
use crate::run::cost::{Cost, Task};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// A diagnosis that is estimated to take longer says so beforehand, s.
const LONG_S: f64 = 30.0;

/// Refuses a task that this machine has no memory for, and says of a diagnosis how long it will take.
///
/// # Errors
/// Too little memory.
pub fn announce(host: &dyn Host, block: &Block, task: Task) -> anyhow::Result<()> {
    let cost = Cost::of(block, task);
    cost.judge(block.images.len(), memory::available())?;
    // The other tasks may run a second solver, of which the estimate knows nothing.
    if task == Task::Diagnose && cost.seconds > LONG_S {
        host.message(&format!("A diagnosis of this block takes {} (estimated for two threads).", cost.in_words()));
        host.expect(cost.seconds);
    }
    Ok(())
}

/// Hears messages and steps, from whatever thread tells them.
pub trait Host: Sync {
    /// A message that stays.
    fn message(&self, text: &str);
    /// The work is here now.
    fn step(&self, text: &str);
    /// Tells the host in how many seconds the work will end, by an estimate.
    fn expect(&self, _seconds: f64) {}
}

/// Standard error. A live line shows the steps, and vanishes before a message.
pub struct Live<'a> {
    console: &'a Console,
    label: &'static str,
    line: Mutex<Option<Progress>>,
    expected: Mutex<Option<Expected>>,
}

impl<'a> Live<'a> {
    /// For the command `label`.
    pub fn new(console: &'a Console, label: &'static str) -> Self {
        Self { console, label, line: Mutex::default(), expected: Mutex::default() }
    }
}

impl Host for Live<'_> {
    fn message(&self, text: &str) {
        *self.line.lock().unwrap_or_else(PoisonError::into_inner) = None;
        self.console.message(text);
    }

    fn step(&self, text: &str) {
        let expected = *self.expected.lock().unwrap_or_else(PoisonError::into_inner);
        let mut line = self.line.lock().unwrap_or_else(PoisonError::into_inner);
        line.get_or_insert_with(|| self.console.progress_of(self.label, expected)).step(text);
    }

    fn expect(&self, seconds: f64) {
        let expected = Expected { since: Instant::now(), seconds };
        *self.expected.lock().unwrap_or_else(PoisonError::into_inner) = Some(expected);
    }
}
