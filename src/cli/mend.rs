//! `misclosure mend`: a copy of a block in which mistakes are undone.

use super::mistakes::{of_adjusted, screened};
use super::output::{Output, usable};
use super::text::paragraph;
use super::{Answer, Console, Usage};
use crate::block::edit::Edit;
use crate::io::block::BLOCK_FILE;
use crate::io::edit::edited;
use crate::io::write_atomically;
use crate::mistakes::{MOST_MENDS, Mistake, mending_stopped};
use crate::run::folder::MENDED;
use anyhow::Context;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Of the text beside what became of a mistake.
const INDENT: usize = 8;

/// Writes a copy of a block in which mistakes are undone
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure check block                                  which mistakes are there
  misclosure mend block -o mended                         undo all that can be undone; mended/mended.toml says what \
  was changed
  misclosure mend block -o mended --only height-offset    undo this kind alone
  misclosure improve block -o run --mend                  the same before a diagnosis")]
pub struct Arguments {
    /// Folder of the block
    block: PathBuf,
    /// Folder of the copy
    #[arg(short, long, value_name = "BLOCK2")]
    output: PathBuf,
    /// Kind of mistake to undo (repeatable) [default: all]
    #[arg(long, value_name = "KIND")]
    only: Vec<String>,
}

/// Mistakes that were undone, and those that a person has to look at.
#[derive(Debug, Default, Serialize)]
pub struct Mended {
    /// Version of this file.
    pub format: u32,
    /// Undone, in this order.
    pub mended: Vec<Mistake>,
    /// Still there.
    pub left: Vec<Mistake>,
    /// Did it end at [`MOST_MENDS`] rounds, with mistakes left that can be undone?
    pub stopped: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    let output = Output::of_block(&arguments.output, Some(&arguments.block))?;
    let progress = console.progress("mend");
    let tell = |what: &str| progress.step(what);
    let mended = output.write(&[], BLOCK_FILE, |dir| {
        let mended = mend(&arguments.block, dir, &arguments.only, threads, &tell)?;
        if mended.mended.is_empty() {
            return Err(Usage(nothing(&mended.left, &arguments.only)).into());
        }
        Ok(mended)
    })?;
    drop(progress);
    let text = text(&mended) + &format!("\nBlock: {}\n", output.folder().display());
    Ok(Answer { text, json: serde_json::to_value(&mended)?, failure: None })
}

/// Writes a copy of the block `from` into the folder `to`, with the mistakes undone that can be. `only` names their
/// kinds; none: all kinds. Where there are none it writes nothing.
///
/// # Errors
/// A file that cannot be read or written.
pub fn mend(from: &Path, to: &Path, only: &[String], threads: usize, tell: &dyn Fn(&str)) -> anyhow::Result<Mended> {
    let wanted = |mistake: &Mistake| !mistake.mend.is_empty() && (only.is_empty() || only.contains(&mistake.kind));
    let mut mended = Mended { format: 1, ..Mended::default() };
    let mut edits: Vec<Edit> = Vec::new();
    for round in 0..=MOST_MENDS {
        tell("looking for mistakes");
        let block = if round == 0 { from } else { to };
        let (mut now, left): (Vec<Mistake>, Vec<Mistake>) = screened(block, threads)?.into_iter().partition(wanted);
        mended.left = left;
        if now.is_empty() {
            tell("adjusting the block");
            match of_adjusted(block, threads) {
                Ok(found) => now.extend(found.into_iter().filter(wanted)),
                Err(error) => tell(&format!("two cameras under one name were not looked for: {error}")),
            }
        }
        if now.is_empty() || round == MOST_MENDS {
            mended.stopped = !now.is_empty();
            mended.left.extend(now);
            break;
        }
        now.iter().for_each(|mistake| tell(&format!("undoing {}", mistake.kind)));
        edits.extend(now.iter().flat_map(|mistake| mistake.mend.clone()));
        mended.mended.extend(now);
        edited(from, to, &edits)?;
        usable(to).context("without the mistakes the block cannot be read")?;
    }
    if mended.mended.is_empty() {
        return Ok(mended);
    }
    let list = toml::to_string_pretty(&json_without_numbers(&mended)?)?;
    write_atomically(&to.join(MENDED), list.as_bytes())?;
    Ok(mended)
}

/// Why there is nothing to write.
fn nothing(left: &[Mistake], only: &[String]) -> String {
    let mut kinds: Vec<&str> = left.iter().map(|mistake| mistake.kind.as_str()).collect();
    kinds.dedup();
    match (kinds.is_empty(), only.is_empty()) {
        (true, _) => "no mistake was found in this block: there is nothing to mend".into(),
        (false, true) => {
            format!(
                "the mistakes of this block ({}) cannot be undone without a look; `check` says what to do",
                kinds.join(", ")
            )
        }
        (false, false) => {
            format!("no mistake of the kind {} can be undone; found: {}", only.join(", "), kinds.join(", "))
        }
    }
}

/// TOML has no word for a number that is not there.
fn json_without_numbers(mended: &Mended) -> anyhow::Result<serde_json::Value> {
    fn strip(value: &mut serde_json::Value) {
        match value {
            serde_json::Value::Object(map) => {
                map.retain(|_, own| !own.is_null());
                map.values_mut().for_each(strip);
            }
            serde_json::Value::Array(list) => list.iter_mut().for_each(strip),
            _ => {}
        }
    }
    let mut value = serde_json::to_value(mended)?;
    strip(&mut value);
    Ok(value)
}

/// What was undone, in words, and whether it came to an end.
pub fn undone(mended: &Mended) -> String {
    let each =
        |own: &Mistake| paragraph("undone", INDENT, &format!("{} of {}: {}", own.kind, own.subject, own.sentence));
    let stopped = if mended.stopped { paragraph("", 0, &mending_stopped()) } else { String::new() };
    mended.mended.iter().map(each).collect::<String>() + &stopped
}

fn text(mended: &Mended) -> String {
    let mut text = undone(mended);
    for mistake in &mended.left {
        text += &paragraph("left", INDENT, &format!("{} {}", mistake.sentence, mistake.remedy));
    }
    if mended.left.is_empty() {
        text += "The copy shows no mistake.\n";
    }
    text
}
