//! `misclosure inject`: measures a simulated block anew under known errors, and makes mistakes of people in its files.

use super::inject_list::list;
use super::inject_text::{errors_json, errors_text, mistake_json, mistakes_text};
use super::output::{Output, usable};
use super::plugins::load_plugins;
use super::words::effect_term;
use super::{Answer, Usage};
use crate::block::Block;
use crate::inject::mistakes::{self, Mistake};
use crate::inject::recipe;
use crate::inject::{self, Injected, Injection, Other, Report};
use crate::io::block::{BLOCK_FILE, read_block, write_block};
use crate::io::table::write_json;
use crate::io::{open, read_text};
use crate::kit::inject::ByFormula;
use crate::model::{EffectRef, EffectTerm};
use anyhow::Context;
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Of everything random where none is given.
const DEFAULT_SEED: u64 = 1;
/// Folder of the truth, in a block.
const TRUTH: &str = "truth";
/// What was done, in the folder of the truth.
const ERRORS: &str = "errors.json";

/// Measures a simulated block anew under known errors, and makes mistakes of people in its files
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure inject --list
  misclosure inject dike -o drift --error focal-growth
  misclosure inject dike -o bad --error rolling-shutter:readout=0.03 --error noise:px=0.3 --seed 7
  misclosure inject data/hidden/dike-local-flaw.toml -o flaw     a recipe: scenario, errors and seed in one file
  misclosure inject dike -o mine --plugin my-effect.so --error my-effect:a=0.5   an effect of one's own, by its formula
  misclosure inject dike -o feet --error noise:px=0.3 --mistake scale:of=control,unit=feet     a mistake on top
  misclosure inject block -o heights --mistake height-offset:of=gnss,by=47.3     a mistake alone, in any block

For errors the block needs its truth (truth/, as `simulate` writes it). The command computes every
measurement again: name all errors, noise too, in one call. The new block has the same truth, and
truth/errors.json lists the errors. Mistakes rewrite the files, last of all and in the order given:
without errors the measurements stay as they are.")]
pub struct Arguments {
    /// Folder of a simulated block, or a recipe
    #[arg(required_unless_present = "list", value_name = "BLOCK|RECIPE.toml")]
    block: Option<PathBuf>,
    /// Folder of the new block
    #[arg(short, long, value_name = "BLOCK2", required_unless_present = "list")]
    output: Option<PathBuf>,
    /// Error to inject (repeatable); errors act in the order of the list, whatever the order here
    #[arg(long = "error", value_name = "ID[:key=value,...]")]
    errors: Vec<String>,
    /// Mistake of a person to make in the files (repeatable); mistakes come last, in the order given
    #[arg(long = "mistake", value_name = "KIND[:key=value,...]")]
    mistakes: Vec<String>,
    /// Shared library of an effect, to be named with --error as `ID:parameter=value` (repeatable). It acts by its own
    /// formula, which the estimator has too; the truth says so
    #[arg(long, value_name = "FILE.so")]
    plugin: Vec<PathBuf>,
    /// Seed of the errors; the same seed gives the same bytes [default: 1]
    #[arg(long)]
    seed: Option<u64>,
    /// List the errors and the mistakes with their parameters and units
    #[arg(long)]
    list: bool,
}

/// A block that errors gave.
struct Measured {
    block: Block,
    truth: Block,
    report: Report,
    seed: u64,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<Answer> {
    // Clap asks for both folders where `--list` is absent.
    let (Some(folder), Some(output)) = (&arguments.block, &arguments.output) else { return Ok(list()) };
    if folder.extension().is_some_and(|extension| extension == "toml") {
        return follow_recipe(folder, output, arguments);
    }
    let output = Output::of_block(output, Some(folder))?;
    if arguments.errors.is_empty() && arguments.mistakes.is_empty() {
        return Err(Usage(
            "the following required arguments were not provided: --error or --mistake \
             (`misclosure inject --list` lists them)"
                .into(),
        )
        .into());
    }
    if arguments.errors.is_empty() && arguments.seed.is_some() {
        let message = "--seed: without --error nothing is random; mistakes are made the same way each time";
        return Err(Usage(message.into()).into());
    }
    let (injections, terms) = errors(arguments)?;
    let mistakes = arguments.mistakes.iter().map(|text| mistakes::parse(text)).collect::<anyhow::Result<Vec<_>>>();
    let mistakes = mistakes.map_err(bad_input)?;
    let block = read_block(folder)?.block;
    if arguments.errors.is_empty() {
        return rewrite(folder, &mistakes, &output);
    }
    let seed = arguments.seed.unwrap_or(DEFAULT_SEED);
    let truth_folder = folder.join(TRUTH);
    if !truth_folder.is_dir() {
        let message =
            format!("{} has no truth/: errors are injected into simulated blocks and twins", folder.display());
        return Err(Usage(message).into());
    }
    let truth = read_block(&truth_folder)?.block;
    let by_formula = |term: &EffectTerm| -> anyhow::Result<Other> {
        let (applied, action) = ByFormula::new(&block, &truth, term, seed)?;
        Ok((applied, Box::new(action)))
    };
    let others = terms.iter().map(by_formula).collect::<anyhow::Result<Vec<_>>>().map_err(bad_input)?;
    let Injected { block, report } =
        inject::apply_with(&block, &truth, &injections, others, seed).map_err(bad_input)?;
    write(&Measured { block, truth, report, seed }, &mistakes, &output)
}

/// What `--error` names: causes, and effects of plug-ins.
fn errors(arguments: &Arguments) -> anyhow::Result<(Vec<Injection>, Vec<EffectTerm>)> {
    let plugins: Vec<EffectRef> = load_plugins(&arguments.plugin)?.into_iter().map(EffectRef::Plugin).collect();
    let id_of = |effect: &EffectRef| effect.descriptor().id.to_string();
    if let Some(taken) = plugins.iter().map(id_of).find(|id| inject::find(id).is_some()) {
        return Err(
            Usage(format!("--plugin: `{taken}` is an error of this program: give the effect another id")).into()
        );
    }
    let find = |id: &str| plugins.iter().find(|effect| effect.descriptor().id == id).cloned();
    let (mut injections, mut terms) = (Vec::new(), Vec::new());
    for text in &arguments.errors {
        let id = text.split(':').next().unwrap_or_default();
        match find(id) {
            Some(_) => terms.push(effect_term("--error", text, &find)?),
            None => injections.push(inject::parse(text).map_err(bad_input)?),
        }
    }
    let idle = plugins.iter().map(id_of).find(|id| !terms.iter().any(|term| term.effect.descriptor().id == *id));
    if let Some(id) = idle {
        return Err(Usage(format!("--plugin: no --error names its effect, `{id}`")).into());
    }
    Ok((injections, terms))
}

/// Makes the block of a recipe.
fn follow_recipe(file: &Path, output: &Path, arguments: &Arguments) -> anyhow::Result<Answer> {
    let is_given = [&arguments.errors, &arguments.mistakes].iter().any(|list| !list.is_empty());
    if arguments.seed.is_some() || is_given || !arguments.plugin.is_empty() {
        return Err(Usage(format!(
            "{}: a recipe has its own seed, errors and mistakes: leave out --seed, --error, --mistake, --plugin",
            file.display()
        ))
        .into());
    }
    let output = Output::of_block(output, None)?;
    let recipe = recipe::read(file).map_err(bad_input)?;
    let mistakes = recipe.mistakes().map_err(bad_input)?;
    let recipe::Made { block, truth, report } = recipe.build().map_err(bad_input)?;
    write(&Measured { block, truth, report, seed: recipe.seed }, &mistakes, &output)
}

/// Writes a block that was measured anew, with mistakes in its files.
fn write(measured: &Measured, mistakes: &[Mistake], output: &Output) -> anyhow::Result<Answer> {
    let Measured { block, truth, report, seed } = measured;
    output.write(&[], BLOCK_FILE, |dir| {
        write_block(truth, &dir.join(TRUTH))?;
        write_block(block, dir)?;
        // Errors alone must give a block that can be read.
        usable(dir)?;
        let mut json = errors_json(report, *seed);
        let text = made(dir, mistakes, &mut json)?;
        write_json(&dir.join(TRUTH).join(ERRORS), &json)?;
        let place = format!("\nBlock: {}\n", output.folder().display());
        Ok(Answer { text: errors_text(report) + &text + &place, json, failure: None })
    })
}

/// Writes the files of a block as they are, but for mistakes.
fn rewrite(from: &Path, mistakes: &[Mistake], output: &Output) -> anyhow::Result<Answer> {
    let truth = from.join(TRUTH);
    let mut json = before(&truth.join(ERRORS))?;
    output.write(&[], BLOCK_FILE, |dir| {
        copy(from, dir)?;
        let mut text = made(dir, mistakes, &mut json)?;
        if truth.is_dir() {
            fs::create_dir_all(dir.join(TRUTH)).with_context(|| format!("{}: cannot write", dir.display()))?;
            copy(&truth, &dir.join(TRUTH))?;
            write_json(&dir.join(TRUTH).join(ERRORS), &json)?;
        } else {
            text += "The block has no truth/: no file of the new block says that they were made.\n";
        }
        text += &format!("\nBlock: {}\n", output.folder().display());
        Ok(Answer { text, json, failure: None })
    })
}

/// Copies the files of a block.
fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    for file in mistakes::FILES.iter().filter(|file| from.join(file).is_file()) {
        // A copy of a file that nobody may write to can be written to.
        let copied = || io::copy(&mut open(&from.join(file))?, &mut File::create(to.join(file))?);
        copied().with_context(|| format!("{}: cannot copy", from.join(file).display()))?;
    }
    Ok(())
}

/// What was done to a block before.
fn before(errors: &Path) -> anyhow::Result<Value> {
    if !errors.is_file() {
        return Ok(json!({ "format": 1, "errors": [] }));
    }
    let unreadable = || format!("{}: cannot read", errors.display());
    let json: Value = serde_json::from_str(&read_text(errors).with_context(unreadable)?).with_context(unreadable)?;
    if !json.is_object() {
        return Err(Usage(format!("{}: expected an object", errors.display())).into());
    }
    Ok(json)
}

/// Makes mistakes in the block in `dir`: adds them to `json`, behind those of before, and says what was done.
fn made(dir: &Path, mistakes: &[Mistake], json: &mut Value) -> anyhow::Result<String> {
    let made = mistakes::make(dir, mistakes).map_err(bad_input)?;
    let mut all = json["mistakes"].as_array().cloned().unwrap_or_default();
    all.extend(made.iter().map(mistake_json));
    json["mistakes"] = all.into();
    if made.is_empty() {
        return Ok(String::new());
    }
    // Some mistakes are refused when the block is read: the block is to show just that.
    let refused = read_block(dir).err().map(|error| error.to_string());
    let text = mistakes_text(&made, refused.as_deref());
    json["refused"] = refused.into();
    Ok(text)
}

/// Whatever the registry refuses was asked for on the command line.
fn bad_input(error: anyhow::Error) -> Usage {
    Usage(format!("{error:#}"))
}
