//! `misclosure import`: a block from another program, or something of one that is added to a block.

use super::diagnosis_text::mistakes_text;
use super::mistakes::{of_block, of_imported};
use super::output::{Output, usable};
use super::text::{paragraph, path_text};
use super::{Answer, Console, Usage};
use crate::block::Block;
use crate::io::block::{BLOCK_FILE, SetAside, is_block, read_block, write_block};
use crate::io::foreign::{self, Addition, Format, ImportOptions, Kind, Note, additions, registry, write_imported};
use crate::io::write_atomically;
use crate::mistakes::Mistake;
use crate::report::tables::Table;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Makes a block from files of another program
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure import --list                                what can be read, written and added
  misclosure import colmap sparse/0 -o block              a COLMAP model, text or binary
  misclosure import sparse/0 -o block                     the same: the format is guessed where that is safe
  misclosure import bundler bundle.out --size 4000x3000 -o block

Each guess and each loss is one line on standard error, and a comment at the top of block.toml. The import
then looks for mistakes as `check` does, and compares tie points with their own coordinates. It writes the
block in either case.")]
pub struct Arguments {
    /// A format (may be left out where the files tell), then its files or folders
    #[arg(value_name = "[FORMAT] PATH", required_unless_present = "list")]
    words: Vec<PathBuf>,
    /// Folder of the new block
    #[arg(short, long, value_name = "BLOCK", required_unless_present_any = ["list", "into"])]
    output: Option<PathBuf>,
    /// Block that is added to
    #[arg(long, value_name = "BLOCK", conflicts_with = "output")]
    into: Option<PathBuf>,
    /// List the formats
    #[arg(long)]
    list: bool,
    /// Standard deviation of a tie-point image coordinate, px, where the files have none
    #[arg(long, value_name = "PX")]
    tie_px: Option<f64>,
    /// Width and height of the images, px, where the files do not have them
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Take the nearest camera where none is the same, however far off
    #[arg(long)]
    approximate: bool,
    /// Say everything, not guesses and losses alone
    #[arg(long)]
    verbose: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    if arguments.list {
        return Ok(list());
    }
    if arguments.tie_px.is_some_and(|sigma| !(sigma > 0.0 && sigma.is_finite())) {
        return Err(Usage("--tie-px: expected a number above zero".into()).into());
    }
    let options =
        ImportOptions { approximate: arguments.approximate, tie_px: arguments.tie_px, size_px: arguments.size };
    let (name, paths) = name_and_paths(&arguments.words);
    if let Some(block) = &arguments.into {
        let addition = addition(name)?;
        let made = add(addition, given(name, paths)?, block, &options, &tell(console, arguments.verbose))?;
        return screened(made, console, |block| of_block(block, threads));
    }
    // Clap asks for it where the other two are absent.
    let output = Output::of_block(arguments.output.as_deref().unwrap_or(Path::new("")), None)?;
    let (format, mut notes) = format(name, paths)?;
    let mut imported = format.import(given(name, paths)?, &options)?;
    notes.append(&mut imported.notes);
    notes.extend(foreign::single_marks(&imported.block));
    notes.extend(foreign::sides_exchanged(&imported.block));
    notes.iter().for_each(tell(console, arguments.verbose));
    imported.notes.clone_from(&notes);
    let reported_px = imported.reported_px;
    let block = output.write(&[], BLOCK_FILE, |dir| {
        write_imported(&imported, dir)?;
        // Before the block is read: there are some with ten million measurements.
        drop(imported);
        usable(dir)
    })?;
    let answer = answer(format.name(), &block, &notes, output.folder());
    screened((answer, block), console, |block| of_imported(block, reported_px, threads))
}

/// The answer with the mistakes in the block, which come first. The block is there in any case, and the exit code is
/// that of an import.
fn screened(
    (answer, block): (Answer, Block),
    console: &Console,
    find: impl FnOnce(Block) -> Vec<Mistake>,
) -> anyhow::Result<Answer> {
    let progress = console.progress("import");
    progress.step("looking for mistakes in the block");
    let mistakes = find(block);
    drop(progress);
    let Answer { mut text, mut json, failure } = answer;
    json["mistakes"] = serde_json::to_value(&mistakes)?;
    if !mistakes.is_empty() {
        let found = kinds(&mistakes);
        console.message(&format!("MISTAKES in the block: {found}; it is written as it came (see `misclosure mend`)"));
        let folder = json["folder"].as_str().unwrap_or("BLOCK");
        let undo = advice(&mistakes, folder);
        text = format!("MISTAKES\n{}{}\n{text}", mistakes_text(&mistakes), paragraph("", 0, &undo));
    }
    Ok(Answer { text, json, failure })
}

/// The kinds of mistakes with their subjects.
fn kinds(mistakes: &[Mistake]) -> String {
    mistakes.iter().map(|own| format!("{} of {}", own.kind, own.subject)).collect::<Vec<_>>().join(", ")
}

/// What undoes mistakes.
fn advice(mistakes: &[Mistake], folder: &str) -> String {
    let undone = mistakes.iter().filter(|own| !own.mend.is_empty()).count();
    let copy = format!("`misclosure mend {folder} -o MENDED`");
    match mistakes.len() - undone {
        0 => format!("{copy} writes a copy of the block in which they are undone."),
        left if undone > 0 => {
            format!("{copy} writes a copy of the block in which {undone} of them are undone; {left} need a person.")
        }
        _ => format!("{copy} cannot undo them: correct the files, and import them again."),
    }
}

/// Says notes as they come.
pub(super) fn tell(console: &Console, verbose: bool) -> impl Fn(&Note) {
    move |note| {
        if verbose || note.kind != Kind::Detail {
            console.message(&note.to_string());
        }
    }
}

/// Notes for programs.
pub(super) fn notes_as_json(notes: &[Note]) -> Value {
    notes.iter().map(|note| json!({ "kind": note.kind.name(), "text": note.text })).collect()
}

/// The first word where it is a name of the registry, and the others.
fn name_and_paths(words: &[PathBuf]) -> (Option<&str>, &[PathBuf]) {
    let is_name = |word: &str| {
        registry().iter().any(|format| format.name() == word) || additions().iter().any(|a| a.name() == word)
    };
    match words.split_first() {
        Some((first, rest)) => match first.to_str().filter(|word| is_name(word)) {
            Some(name) => (Some(name), rest),
            None => (None, words),
        },
        None => (None, words),
    }
}

fn given<'a>(name: Option<&str>, paths: &'a [PathBuf]) -> Result<&'a [PathBuf], Usage> {
    match paths.iter().find(|path| !path.exists()) {
        Some(missing) => Err(Usage(format!(
            "{}: there is no such file, folder or format; `misclosure import --list` lists the formats",
            missing.display()
        ))),
        None if paths.is_empty() => Err(Usage(format!("import {}: name its files", name.unwrap_or_default()))),
        None => Ok(paths),
    }
}

/// The format that is named, or the one that the first path is surely of.
fn format(name: Option<&str>, paths: &[PathBuf]) -> Result<(&'static dyn Format, Vec<Note>), Usage> {
    if let Some(name) = name {
        let named = registry().iter().find(|format| format.name() == name);
        let added = || Usage(format!("{name} is added to a block: `misclosure import {name} SOURCE --into BLOCK`"));
        return named.map(|format| (*format, Vec::new())).ok_or_else(added);
    }
    let first = given(name, paths)?.first().map_or(Path::new(""), PathBuf::as_path);
    let fitting: Vec<_> = registry().iter().filter(|format| format.recognises(first)).collect();
    match &fitting[..] {
        [format] => {
            let text = format!("{} is read as {}: {}", first.display(), format.name(), format.about());
            Ok((**format, vec![Note::guess(text)]))
        }
        _ => Err(Usage(format!(
            "{}: the format cannot be told; name it: `misclosure import FORMAT {}` (`misclosure import --list` lists \
             them)",
            first.display(),
            first.display()
        ))),
    }
}

fn addition(name: Option<&str>) -> Result<&'static dyn Addition, Usage> {
    let named = name.and_then(|name| additions().iter().find(|addition| addition.name() == name));
    let names: Vec<&str> = additions().iter().map(|addition| addition.name()).collect();
    named.copied().ok_or_else(|| Usage(format!("--into needs one of {} before the files", names.join(", "))))
}

/// Adds to a block in its place: only the files that the addition may change are replaced, and no image measurement.
fn add(
    addition: &dyn Addition,
    paths: &[PathBuf],
    folder: &Path,
    options: &ImportOptions,
    tell: &dyn Fn(&Note),
) -> anyhow::Result<(Answer, Block)> {
    if !is_block(folder) {
        return Err(Usage(format!("--into {}: this is no block", folder.display())).into());
    }
    let output = Output::into_block(folder)?;
    let loaded = read_block(folder)?;
    // The tables that an addition writes anew would lack what the reader sets aside; those of tie points stay as they
    // are.
    let lost = SetAside { one_ray_points: 0, unmeasured_points: 0, ..loaded.set_aside };
    if !lost.is_empty() {
        let problem = "its tables have what serves nothing, and would lose it";
        return Err(Usage(format!("--into {}: {problem} ({lost}); take it out first", folder.display())).into());
    }
    let mut block = loaded.block;
    let notes = addition.add(&mut block, paths, options)?;
    notes.iter().for_each(tell);
    output.write(&[], BLOCK_FILE, |dir| {
        write_block(&block, dir)?;
        usable(dir)?;
        keep_comments(folder, dir)?;
        // The others stay as they are.
        for entry in std::fs::read_dir(dir)? {
            let entry = entry?;
            if !addition.changes().iter().any(|name| entry.file_name() == *name) {
                std::fs::remove_file(entry.path())?;
            }
        }
        Ok(())
    })?;
    Ok((answer(addition.name(), &block, &notes, folder), block))
}

/// What an import said stands at the top of `block.toml`, and stays there.
fn keep_comments(folder: &Path, staged: &Path) -> anyhow::Result<()> {
    let old = crate::files::read_text(&folder.join(BLOCK_FILE))?;
    let comments: String = old.split_inclusive('\n').take_while(|line| line.starts_with('#')).collect();
    let new = crate::files::read_text(&staged.join(BLOCK_FILE))?;
    Ok(write_atomically(&staged.join(BLOCK_FILE), (comments + &new).as_bytes())?)
}

fn answer(from: &str, block: &Block, notes: &[Note], folder: &Path) -> Answer {
    let (images, cameras, points) = (block.images.len(), block.cameras.len(), block.tie_points.len());
    let (ties, surveyed, marks) = (block.ties.len(), block.surveyed.len(), block.marks.len());
    let text = format!(
        "Block `{}` from {from}: {images} images, {cameras} cameras, {points} tie points with {ties} measurements, \
         {surveyed} surveyed points with {marks} marks; coordinate system `{}`",
        block.name, block.crs
    );
    let json = json!({
        "format": 1, "from": from, "block": block.name, "crs": block.crs, "folder": path_text(folder),
        "images": images, "cameras": cameras,
        "tie_points": points, "tie_measurements": ties, "surveyed": surveyed, "marks": marks,
        "notes": notes_as_json(notes),
    });
    Answer { text: paragraph("", 0, &text) + &format!("\nBlock: {}\n", folder.display()), json, failure: None }
}

fn list() -> Answer {
    let mut table = Table::new("").text("format", "").text("import", "").text("export", "").text("what it is", "");
    let mark = |yes: bool| if yes { "yes" } else { "-" }.to_string();
    for format in registry() {
        table.row([format.name().into(), mark(true), mark(format.exporter().is_some()), format.about().into()]);
    }
    let mut text = table.to_text();
    let mut table = Table::new("").text("added to a block (--into)", "").text("what it is", "");
    for addition in additions() {
        table.row([addition.name().to_string(), addition.about().to_string()]);
    }
    if !additions().is_empty() {
        text += &format!("\n{}", table.to_text());
    }
    let formats: Vec<Value> = registry()
        .iter()
        .map(|format| {
            json!({ "name": format.name(), "about": format.about(), "import": true,
                "export": format.exporter().is_some() })
        })
        .collect();
    let additions: Vec<Value> =
        additions().iter().map(|addition| json!({ "name": addition.name(), "about": addition.about() })).collect();
    Answer { text, json: json!({ "format": 1, "formats": formats, "additions": additions }), failure: None }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |side: &str| side.parse::<u32>().ok().filter(|side| *side > 0);
    let sides = text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?]));
    sides.ok_or_else(|| "expected WIDTHxHEIGHT in px, as 4000x3000".to_string())
}
