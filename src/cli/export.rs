//! `misclosure export`: a block, or what a run made of it, for another program.

use super::import::{notes_as_json, tell};
use super::output::Output;
use super::{Answer, Console, Usage};
use crate::io::block::read_block;
use crate::io::foreign::{ExportOptions, Exporter, registry, verification};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Writes a block, or what a run made of it, for another program
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure export colmap block -o model        the block as it is
  misclosure import --list                       which formats can be written

Beside the files stands verification.csv: ten points of the world and where images see them, for whoever
wants to see that the transfer is right; `misclosure import` looks.")]
pub struct Arguments {
    /// A format of `misclosure import --list`
    format: String,
    /// Folder of the block
    #[arg(value_name = "BLOCK")]
    source: PathBuf,
    /// Folder for the files
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Write the nearest camera where the format has not the same, however far off
    #[arg(long)]
    approximate: bool,
    /// Say everything, not guesses and losses alone
    #[arg(long)]
    verbose: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console) -> anyhow::Result<Answer> {
    let exporter = exporter(&arguments.format)?;
    let output = Output::of_block(&arguments.output, Some(&arguments.source))?;
    let block = read_block(&arguments.source)?.block;
    let options = ExportOptions { approximate: arguments.approximate };
    let mut notes = Vec::new();
    output.write(&[], verification::FILE, |dir| {
        notes.append(&mut exporter.export(&block, dir, &options)?);
        Ok(())
    })?;
    notes.iter().for_each(tell(console, arguments.verbose));
    let folder = output.folder();
    let files = files(folder)?;
    let text = format!(
        "Block `{}` as {}: {}\n\nFolder: {}\n",
        block.name,
        arguments.format,
        files.join(", "),
        folder.display()
    );
    let json = json!({ "format": 1, "to": arguments.format, "block": block.name, "folder": folder, "files": files,
                       "notes": notes_as_json(&notes) });
    Ok(Answer { text, json, failure: None })
}

fn exporter(name: &str) -> Result<&'static dyn Exporter, Usage> {
    let written: Vec<&str> =
        registry().iter().filter(|format| format.exporter().is_some()).map(|format| format.name()).collect();
    let exporter = registry().iter().find(|format| format.name() == name).map(|format| format.exporter());
    match exporter {
        Some(Some(exporter)) => Ok(exporter),
        Some(None) => Err(Usage(format!("{name} is read, not written; written are {}", written.join(", ")))),
        None => Err(Usage(format!("no format is called `{name}`; written are {}", written.join(", ")))),
    }
}

fn files(folder: &Path) -> std::io::Result<Vec<String>> {
    let name = |entry: std::io::Result<std::fs::DirEntry>| Ok(entry?.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = std::fs::read_dir(folder)?.map(name).collect::<std::io::Result<_>>()?;
    names.sort();
    Ok(names)
}
