//! `misclosure compare RUN RUN...`: runs side by side, as table, JSON and page.

use super::text::path_text;
use super::{Answer, Usage};
use crate::compare::compare;
use crate::report;
use crate::run::folder::write_atomically;
use anyhow::{Context, bail};
use std::path::PathBuf;

/// Compares runs: cameras, poses, points, check points and findings of each with those of the first
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure compare plain improved                   what the second run changes in the first
  misclosure compare spring autumn -o compared.html   two flights with one camera, as a page with the fields
  misclosure compare a b c --json                     for a script: differences of b and c from a

Cameras are compared as fields over the sensor: how the image point of one viewing ray differs. Coefficients may differ
much where cameras hardly do. Orientations absorb a rotation of all rays, flying heights most of a change of f. Both are
fitted and taken out, and the table has the field before and after. Images, tie points and check points are compared
by name; where a run has no scale, images and tie points after a similarity.")]
pub struct Arguments {
    /// Folders of runs; the first is the one that the others are compared with
    #[arg(required = true, num_args = 2.., value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Write the comparison as a page, too
    #[arg(short, long, value_name = "FILE.html")]
    output: Option<PathBuf>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<Answer> {
    if let Some(folder) = arguments.runs.iter().find(|folder| !folder.is_dir()) {
        bail!(Usage(format!("{}: no such folder; expected the folder of a run", folder.display())));
    }
    let compared = compare(&arguments.runs)?;
    let mut text = report::compare::text(&compared);
    let mut json = serde_json::to_value(&compared)?;
    if let Some(file) = &arguments.output {
        if file.is_dir() {
            bail!(Usage(format!(
                "-o {}: this is a folder; expected the name of a page, as compared.html",
                file.display()
            )));
        }
        write_atomically(file, report::compare::page(&compared).as_bytes())
            .with_context(|| format!("-o {}: cannot write", file.display()))?;
        text += &format!("\nPage: {}\n", file.display());
        json["page"] = path_text(file).into();
    }
    Ok(Answer { text, json, failure: None })
}
