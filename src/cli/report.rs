//! `misclosure report RUN`: the page of a run, again.

use super::text::path_text;
use super::{Answer, staging};
use crate::report::run::write_page;
use anyhow::Context;
use serde_json::json;
use std::path::PathBuf;

/// Writes the page of a run again, from the files of its folder
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure report run          run/report.html and run/figures from the tables of the run")]
pub struct Arguments {
    /// Folder of the run
    run: PathBuf,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<Answer> {
    let cannot_write = || format!("{}: cannot write", arguments.run.display());
    // Where a program was killed while its results took their names.
    staging::finish(&arguments.run).with_context(cannot_write)?;
    if arguments.run.is_dir() {
        staging::writable(&arguments.run).with_context(cannot_write)?;
    }
    write_page(&arguments.run)?;
    let page = arguments.run.join("report.html");
    Ok(Answer {
        text: format!("Report: {}\n", page.display()),
        json: json!({ "report": path_text(&page) }),
        failure: None,
    })
}
