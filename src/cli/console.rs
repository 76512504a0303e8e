//! Standard error: messages, and progress as a live line on a terminal or as plain lines elsewhere.

use crate::run::cost::duration_in_words;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

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
        self.progress_of(label, None)
    }

    /// The same of a task of which is known how long it takes: the time that is over stands beside each step.
    pub fn progress_of(&self, label: &str, expected: Option<Expected>) -> Progress {
        let (label, console) = (label.to_string(), *self);
        if self.quiet || !self.terminal {
            return Progress { label, console, expected, bar: None };
        }
        let template = expected.map_or("{spinner} {prefix}: {wide_msg}".to_string(), |expected| {
            format!("{{spinner}} {{prefix}}: {{wide_msg}} {{elapsed}} of {}", expected.in_words())
        });
        let style = ProgressStyle::with_template(&template).expect("a template");
        let bar = ProgressBar::new_spinner().with_style(style).with_prefix(label.clone());
        let bar = expected.map_or(bar.clone(), |expected| bar.with_elapsed(expected.since.elapsed()));
        bar.enable_steady_tick(TICK);
        Progress { label, console, expected, bar: Some(bar) }
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

/// How long a task will take by an estimate.
#[derive(Debug, Clone, Copy)]
pub struct Expected {
    /// When it began.
    pub since: Instant,
    /// From then to its end, s.
    pub seconds: f64,
}

impl Expected {
    /// In words: `about 80 s`.
    fn in_words(&self) -> String {
        duration_in_words(self.seconds)
    }

    /// What is over: `34 s of about 80 s`.
    fn so_far(&self) -> String {
        format!("{:.0} s of {}", self.since.elapsed().as_secs_f64(), self.in_words())
    }
}

/// A task under way; a live line vanishes with it.
#[derive(Debug)]
pub struct Progress {
    label: String,
    console: Console,
    expected: Option<Expected>,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// The task is here now.
    pub fn step(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.set_message(text.to_string()),
            None => {
                let over = self.expected.map_or(String::new(), |expected| format!(" ({})", expected.so_far()));
                self.console.message(&format!("{}: {text}{over}", self.label));
            }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_over_stands_beside_what_was_expected() {
        let since = Instant::now().checked_sub(Duration::from_secs(34)).expect("a clock that ran before");
        assert_eq!(Expected { since, seconds: 81.0 }.so_far(), "34 s of about 81 s");
        assert_eq!(Expected { since, seconds: 600.0 }.so_far(), "34 s of about 10 min");
    }
}
