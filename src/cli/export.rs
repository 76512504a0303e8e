//! `misclosure export`: a block, or what a run made of it, for another program.

use super::import::{notes_as_json, tell};
use super::output::Output;
use super::text::path_text;
use super::{Answer, Console, Usage};
use crate::block::Block;
use crate::io::block::{is_block, read_block};
use crate::io::foreign::{ExportOptions, Exporter, Note, registry, verification, with_cameras_of};
use crate::report::numbers::significant;
use crate::run::folder::{Adjusted, SUMMARY, read_source};
use serde_json::json;
use std::path::{Path, PathBuf};

/// What effects do below this (px) is lost in the rounding of what other programs write.
const INVISIBLE_PX: f64 = 1e-6;

/// Writes a block, or what a run made of it, for another program
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure export colmap block -o model        the block as it is
  misclosure export colmap run -o model          with the cameras, poses and points of a run
  misclosure export colmap run -o model --correct-measurements
                                                 what effects do is taken out of the measurements
  misclosure import --list                       which formats can be written

Measurements that a run set aside are not written. Effects of its model have no place in other programs, and
are refused. With --correct-measurements the program writes the image measurements that a camera without them
would have made. It takes the prediction with effects away and adds that without, at the adjusted solution.

Beside the files stands verification.csv: ten points of the world and where images see them. They show whether
the transfer is right; `misclosure import` compares them.")]
pub struct Arguments {
    /// A format of `misclosure import --list`
    format: String,
    /// Folder of the block, or of a run
    #[arg(value_name = "BLOCK|RUN")]
    source: PathBuf,
    /// The block that the run adjusted, where it is no longer where it was
    #[arg(long, value_name = "BLOCK")]
    block: Option<PathBuf>,
    /// Folder for the files
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Write the nearest camera where the format has not the same, however far off
    #[arg(long)]
    approximate: bool,
    /// Take out of the measurements what the effects of the run's model do to them, and what of its cameras the format
    /// does not hold
    #[arg(long)]
    correct_measurements: bool,
    /// Say everything, not guesses and losses alone
    #[arg(long)]
    verbose: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console) -> anyhow::Result<Answer> {
    let exporter = exporter(&arguments.format)?;
    let output = Output::of_block(&arguments.output, Some(&arguments.source))?;
    let mut notes = Vec::new();
    let block = match arguments.source.join(SUMMARY).exists() {
        true => adjusted(arguments, exporter, &mut notes)?,
        false => read_block(&arguments.source)?.block,
    };
    let options = ExportOptions { approximate: arguments.approximate };
    output.write(&[], verification::FILE, |dir| {
        let made = exporter.export(&block, dir, &options).map_err(|error| error.moved(dir, &arguments.output));
        notes.append(&mut made?);
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
    let json = json!({ "format": 1, "to": arguments.format, "block": block.name, "folder": path_text(folder),
        "files": files,
                       "notes": notes_as_json(&notes) });
    Ok(Answer { text, json, failure: None })
}

/// The block of a run with its results; effects are taken out of the measurements, or not there, or refused.
fn adjusted(arguments: &Arguments, exporter: &dyn Exporter, notes: &mut Vec<Note>) -> anyhow::Result<Block> {
    let run = &arguments.source;
    let noted = || Ok::<_, anyhow::Error>(arguments.block.clone().or(read_source(run)?));
    let folder =
        noted()?.ok_or_else(|| Usage(format!("{}: name the block that it adjusted: --block", run.display())))?;
    if !is_block(&folder) {
        let text =
            format!("{} adjusted {}, where no block is; --block names another place", run.display(), folder.display());
        return Err(Usage(text).into());
    }
    let whole = read_block(&folder)?.block;
    let measurements = whole.ties.len();
    let adjusted = Adjusted::read(whole, run)?;
    let left_out = measurements - adjusted.block.ties.len();
    if left_out > 0 {
        notes.push(Note::fact(format!("{left_out} measurements that took no part in the run are not written")));
    }
    let (largest_px, effects) = (adjusted.largest_px(), adjusted.effects.join(", "));
    if !arguments.correct_measurements && largest_px < INVISIBLE_PX {
        return Ok(adjusted.block);
    }
    if !arguments.correct_measurements {
        return Err(Usage(format!(
            "the model of {} has effects that other programs do not know: {effects}; they move measurements by up to \
             {} px. --correct-measurements writes the measurements without them",
            run.display(),
            significant(largest_px, 3)
        ))
        .into());
    }
    let (mut block, kept) = adjusted.without_effects();
    let camera_px = with_cameras_of(exporter, &mut block)?;
    let causes = [(largest_px, effects.as_str()), (camera_px, "camera parameters that the format lacks")];
    for (largest_px, cause) in causes.into_iter().filter(|(largest_px, _)| *largest_px >= INVISIBLE_PX) {
        let largest = significant(largest_px, 3);
        let text = format!(
            "measurements are corrected for {cause}, by up to {largest} px: they differ from the measured values"
        );
        notes.push(Note::fact(text));
    }
    if kept > 0 && largest_px >= INVISIBLE_PX {
        let text = format!("{kept} marks are written as measured: the run has no corrections of marks");
        notes.push(Note::loss(text));
    }
    Ok(block)
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
