//! `misclosure report RUN`: the page of a run, again; as PDF, and as one page for a client.

use super::text::path_text;
use super::{Answer, pdf, staging};
use crate::report::run::{CLIENT, write_page};
use anyhow::Context;
use serde_json::json;
use std::path::PathBuf;

/// Writes the page of a run again, from the files of its folder
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure report run                          run/report.html and run/figures from the tables of the run
  misclosure report run --pdf report.pdf         the same, and printed (A4) by an installed Chromium
  misclosure report run --client --pdf one.pdf   one page to hand on: the finding, before and after, what remains")]
pub struct Arguments {
    /// Folder of the run
    run: PathBuf,
    /// Print the page into FILE; needs Chromium or Google Chrome (the environment variable CHROMIUM names another one)
    #[arg(long, value_name = "FILE")]
    pdf: Option<PathBuf>,
    /// Write RUN/client.html, too: the first page alone. With --pdf, that page is printed
    #[arg(long)]
    client: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<Answer> {
    let cannot_write = || format!("{}: cannot write", arguments.run.display());
    // Where a program was killed while its results took their names.
    staging::finish(&arguments.run).with_context(cannot_write)?;
    if arguments.run.is_dir() {
        staging::writable(&arguments.run).with_context(cannot_write)?;
    }
    write_page(&arguments.run, arguments.client)?;
    let page = arguments.run.join("report.html");
    let mut text = format!("Report: {}\n", page.display());
    let mut json = json!({ "report": path_text(&page) });
    let client = arguments.run.join(CLIENT);
    if arguments.client {
        text += &format!("One page: {}\n", client.display());
        json["client"] = path_text(&client).into();
    }
    if let Some(file) = &arguments.pdf {
        pdf::print(if arguments.client { &client } else { &page }, file)?;
        text += &format!("PDF: {}\n", file.display());
        json["pdf"] = path_text(file).into();
    }
    Ok(Answer { text, json, failure: None })
}
