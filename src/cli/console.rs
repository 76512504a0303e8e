//! Standard error: messages, and progress as a live line on a terminal or as plain lines elsewhere.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::time::Duration;

/// How often the live line moves while nothing is reported.
const TICK: Duration = Duration::from_millis(100);

/// Where a command tells what it is doing.
#[derive(Debug, Clone, Copy)]
pub struct Console {
    quiet: bool,
    terminal: bool,
}

impl Console {
    /// Standard error; silent when `quiet`.
    pub fn new(quiet: bool) -> Self {
        Self { quiet, terminal: std::io::stderr().is_terminal() }
    }

    /// Is there a terminal that may show a live line?
    pub fn is_live(&self) -> bool {
        self.terminal && !self.quiet
    }

    /// One message.
    pub fn message(&self, text: &str) {
        if !self.quiet {
            write_error(text);
        }
    }

    /// Begins a task whose steps are reported.
    pub fn progress(&self, label: &str) -> Progress {
        if self.quiet || !self.terminal {
            return Progress { label: label.into(), console: *self, bar: None };
        }
        let style = ProgressStyle::with_template("{spinner} {prefix}: {wide_msg}").expect("constant template");
        let bar = ProgressBar::new_spinner().with_style(style).with_prefix(label.to_string());
        bar.enable_steady_tick(TICK);
        Progress { label: label.into(), console: *self, bar: Some(bar) }
    }
}

/// Characters of a line where tables are fitted to it: on a terminal, as wide as its `COLUMNS` say, at least
/// [`NARROW`].
pub(super) fn text_width() -> Option<usize> {
    let columns = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    std::io::stdout().is_terminal().then(|| columns.map_or(NARROW, |columns: usize| columns.max(NARROW)))
}

/// Characters of a line of any terminal.
const NARROW: usize = 80;

/// A task under way; a live line vanishes with it.
#[derive(Debug)]
pub struct Progress {
    label: String,
    console: Console,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// The task is here now.
    pub fn step(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.set_message(text.to_string()),
            None => self.console.message(&format!("{}: {text}", self.label)),
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// A line on standard error. That it cannot be written is no reason to fail, so `eprintln!`, which would panic, is not
/// used.
pub(super) fn write_error(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{}", printable(text));
}

/// The text without control characters other than line ends: a name from a file could hold what makes a terminal do
/// things.
pub(super) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() && c != '\n' { char::REPLACEMENT_CHARACTER } else { c }).collect()
}
