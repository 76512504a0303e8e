//! The commands, one file each. A command reads files, calls the library and gives back an [`Answer`]; it computes
//! nothing itself.
//!
//! Results go to standard output (as JSON with `--json`), progress and messages to standard error.

mod adjust;
mod blunders;
mod campaign;
mod check;
mod compare;
mod completions;
mod config;
mod console;
mod diagnose;
pub mod diagnosis_text;
mod effects;
mod exit;
mod export;
mod host;
mod import;
mod inject;
mod inject_list;
mod inject_text;
mod interrupt;
#[cfg(feature = "lab")]
mod lab;
mod man;
mod mend;
mod mistakes;
pub mod model_options;
mod output;
mod pdf;
mod plan;
mod plugins;
mod report;
mod reproduce;
pub mod shared;
mod simulate;
mod staging;
mod summary_text;
mod text;
mod validate;
mod words;

pub use console::Console;
pub use exit::{Exit, Usage};
pub use host::Host;

use crate::report::tables;
use crate::{faults, memory};
use anyhow::Context;
use clap::{Args, CommandFactory, Parser, Subcommand};
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// The version, and the solvers of this build ([`crate::adjust::BUILT`]).
const LONG_VERSION: &str = if cfg!(feature = "ceres") {
    concat!(env!("CARGO_PKG_VERSION"), "\nsolvers: native, ceres")
} else {
    concat!(env!("CARGO_PKG_VERSION"), "\nsolvers: native (this build has no Ceres)")
};

/// Finds why a photogrammetric adjustment does not fit its measurements.
#[derive(Debug, Parser)]
#[command(
    name = "misclosure",
    version,
    long_version = LONG_VERSION,
    max_term_width = 120,
    arg_required_else_help = true
)]
#[command(after_help = "Exit codes:
  0  done
  1  any other failure
  2  bad usage or bad input
  3  the adjustment failed (not converged, singular)
  4  the two solvers disagree, or results are not as certified

Options that you always give: ~/.config/misclosure/config.toml, by command and long name.
MISCLOSURE_CONFIG=FILE names another file; empty, it names none.")]
struct Arguments {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Command,
}

/// Options of every command.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Global options")]
struct Global {
    /// Threads to use [default: one per processor]; results do not depend on it
    #[arg(long, global = true, value_name = "N")]
    threads: Option<std::num::NonZeroUsize>,
    /// Print the main result as JSON on standard output
    #[arg(long, global = true)]
    json: bool,
    /// Tables in lines as long as they need [default on a terminal: wide tables go on below]
    #[arg(long, global = true)]
    wide: bool,
    /// No progress and no messages, only the result and errors
    #[arg(long, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    Simulate(simulate::Arguments),
    Inject(inject::Arguments),
    Plan(plan::Arguments),
    Check(check::Arguments),
    Compare(compare::Arguments),
    Mend(mend::Arguments),
    Adjust(adjust::Arguments),
    Diagnose(diagnose::DiagnoseArguments),
    Improve(diagnose::ImproveArguments),
    Effects(effects::Arguments),
    Report(report::Arguments),
    Reproduce(reproduce::Arguments),
    Campaign(campaign::Arguments),
    Import(import::Arguments),
    Export(export::Arguments),
    Validate(validate::Arguments),
    Completions(completions::Arguments),
    Man(man::Arguments),
    #[cfg(feature = "lab")]
    Lab(lab::Arguments),
}

/// What a command found.
#[derive(Debug, Default)]
pub struct Answer {
    /// For people.
    pub text: String,
    /// The same for programs.
    pub json: serde_json::Value,
    /// The command did its work, but its outcome is a failure: printed after the result, and decides the exit code.
    pub failure: Option<anyhow::Error>,
}

/// Parses the command line, runs the command, prints its answer or the chain of errors, and gives the exit code.
pub fn main() -> ExitCode {
    run_line(std::env::args_os().collect()).into()
}

/// [`main`] with a command line of any origin, the name of the program first. It sets up the whole process: signals,
/// allocator, what happens at its end.
pub fn run_line(line: Vec<OsString>) -> Exit {
    memory::map_large_allocations();
    let line = match config::complete(line, Arguments::command()) {
        Ok(line) => line,
        Err(error) => {
            console::write_error(&format!("error: {error}"));
            return Exit::BadInput;
        }
    };
    let arguments = Arguments::parse_from(&line);
    crate::run::folder::state_command(line);
    // Behind the parser, which ends the program itself.
    faults::watch();
    #[cfg(feature = "ceres")]
    crate::adjust::ceres::watch_exceptions(faults::memory_was_refused, || faults::end_by_memory());
    memory::watch_panics();
    interrupt::watch();
    // A panic is a bug; it must still end with a code that scripts know, after the default hook's message.
    let exit = std::panic::catch_unwind(|| execute(arguments)).unwrap_or_else(|_| {
        console::write_error(
            "error: internal error, described above: please report it with the command that led to it",
        );
        Exit::Other
    });
    faults::work_is_done();
    exit
}

fn execute(arguments: Arguments) -> Exit {
    let Arguments { global, command } = arguments;
    let console = Console::new(global.quiet);
    if let Some(width) = console::text_width().filter(|_| !global.wide) {
        tables::fit_text_to(width);
    }
    let threads = global.threads.map_or_else(available_threads, usize::from);
    let most = MOST_THREADS.max(available_threads());
    if threads > most {
        console::write_error(&format!(
            "error: --threads {threads}: this machine has {}, the most is {most}",
            available_threads()
        ));
        return Exit::BadInput;
    }
    let outcome = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .with_context(|| format!("{threads} threads cannot be started; allow more memory, or --threads with fewer"))
        .and_then(|()| command.run(&console, threads, global.json));
    let failure = match outcome {
        Err(error) => Some(error),
        Ok(answer) => match print(&answer, global.json) {
            // Whoever reads our output may stop reading; the work is done.
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => answer.failure,
            Err(error) => Some(anyhow::Error::from(error).context("cannot write to standard output")),
            Ok(()) => answer.failure,
        },
    };
    let Some(error) = failure else { return Exit::Done };
    console::write_error(&error_chain(&error));
    Exit::of(&error)
}

impl Command {
    fn run(self, console: &Console, threads: usize, as_json: bool) -> anyhow::Result<Answer> {
        match self {
            Command::Simulate(arguments) => simulate::run(&arguments, console),
            Command::Inject(arguments) => inject::run(&arguments),
            Command::Plan(arguments) => plan::run(&arguments, console, threads),
            Command::Check(arguments) => check::run(&arguments, console, threads),
            Command::Compare(arguments) => compare::run(&arguments),
            Command::Mend(arguments) => mend::run(&arguments, console, threads),
            Command::Adjust(arguments) => adjust::run(&arguments, console, threads),
            Command::Diagnose(arguments) => diagnose::run_diagnose(&arguments, console, threads),
            Command::Improve(arguments) => diagnose::run_improve(&arguments, console, threads),
            Command::Effects(arguments) => effects::run(&arguments, console),
            Command::Report(arguments) => report::run(&arguments),
            Command::Reproduce(arguments) => reproduce::run(&arguments, console, threads),
            Command::Campaign(arguments) => campaign::run(&arguments, console, threads),
            Command::Import(arguments) => import::run(&arguments, console, threads),
            Command::Export(arguments) => export::run(&arguments, console),
            Command::Validate(arguments) => validate::run(&arguments, console, threads),
            Command::Completions(arguments) => completions::run(&arguments, as_json),
            Command::Man(arguments) => man::run(&arguments),
            #[cfg(feature = "lab")]
            Command::Lab(arguments) => lab::run(&arguments, console, threads, as_json),
        }
    }
}

/// Threads that are allowed on any machine: results do not depend on their number, and tests of that need more than a
/// small one has.
const MOST_THREADS: usize = 64;

fn available_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn print(answer: &Answer, json: bool) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    if json {
        serde_json::to_writer_pretty(&mut out, &answer.json)?;
        writeln!(out)?;
    } else if !answer.text.is_empty() {
        writeln!(out, "{}", console::printable(answer.text.trim_end()))?;
    }
    out.flush()
}

/// `error: ...` and a line `  caused by: ...` per cause. A cause that its effect's message already ends with is not
/// repeated.
pub fn error_chain(error: &anyhow::Error) -> String {
    let mut text = format!("error: {error}");
    let mut last = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !last.ends_with(&cause) {
            text += &format!("\n  caused by: {cause}");
        }
        last = cause;
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn every_command_shows_examples() {
        for command in Arguments::command().get_subcommands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains(&format!("  misclosure {}", command.get_name())), "{}", command.get_name());
        }
    }

    #[test]
    fn error_chain_names_every_cause_once() {
        let error = anyhow::anyhow!("no such file").context("cannot read images.csv").context("block `dike`");
        assert_eq!(
            error_chain(&error),
            "error: block `dike`\n  caused by: cannot read images.csv\n  caused by: no such file"
        );
        let error = anyhow::anyhow!("no such file").context("cannot read images.csv: no such file");
        assert_eq!(error_chain(&error), "error: cannot read images.csv: no such file");
    }
}
