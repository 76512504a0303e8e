//! `misclosure inject`: measures a simulated block anew under known errors.

use super::output::{Output, usable};
use super::plugins::load_plugins;
use super::text::paragraph;
use super::words::effect_term;
use super::{Answer, Usage};
use crate::block::Block;
use crate::inject::recipe::{self, Made};
use crate::inject::{self, Cause, Injected, Injection, Other, ParameterSpec, Report};
use crate::io::block::{BLOCK_FILE, read_block, write_block};
use crate::io::table::write_json;
use crate::kit::inject::ByFormula;
use crate::model::{EffectRef, EffectTerm};
use crate::report::numbers::significant;
use crate::report::tables::Table;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Of everything random where none is given.
const DEFAULT_SEED: u64 = 1;

/// Measures a simulated block anew under known errors
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure inject --list
  misclosure inject dike -o drift --error focal-growth
  misclosure inject dike -o bad --error rolling-shutter:readout=0.03 --error noise:px=0.3 --seed 7
  misclosure inject data/hidden/dike-local-flaw.toml -o flaw     a recipe: scenario, errors and seed in one file
  misclosure inject dike -o mine --plugin my-effect.so --error my-effect:a=0.5     an effect of one's own, by its formula

The block needs its truth (truth/, as `simulate` writes it). Every measurement is made anew:
name all errors, noise too, in one call. The new block has the same truth, and
truth/errors.json says what was done.")]
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
    /// Shared library of an effect, to be named with --error as `ID:parameter=value` (repeatable). It acts by its own formula, which
    /// the estimator has too; the truth says so
    #[arg(long, value_name = "FILE.so")]
    plugin: Vec<PathBuf>,
    /// Seed of everything random; the same seed gives the same bytes [default: 1]
    #[arg(long)]
    seed: Option<u64>,
    /// List the errors with their parameters and units
    #[arg(long)]
    list: bool,
}

/// What a block with an effect that was injected by its own formula proves, and what it does not.
const SHARED: &str = "was injected by its own formula, which the estimator has too: that it is found again shows what the block can tell, \
                      not that the formula is true";

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<Answer> {
    // Clap asks for both folders where `--list` is absent.
    let (Some(folder), Some(output)) = (&arguments.block, &arguments.output) else { return Ok(list()) };
    if folder.extension().is_some_and(|extension| extension == "toml") {
        return follow_recipe(folder, output, arguments);
    }
    let output = Output::of_block(output, Some(folder))?;
    if arguments.errors.is_empty() {
        return Err(Usage(
            "the following required arguments were not provided: --error (`misclosure inject --list` lists them)"
                .into(),
        )
        .into());
    }
    let seed = arguments.seed.unwrap_or(DEFAULT_SEED);
    let (injections, terms) = errors(arguments)?;
    let block = read_block(folder)?.block;
    let truth_folder = folder.join("truth");
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
    write(&block, &truth, &report, seed, &output)
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
    if arguments.seed.is_some() || !arguments.errors.is_empty() || !arguments.plugin.is_empty() {
        return Err(Usage(format!("{}: a recipe has its own seed and errors", file.display())).into());
    }
    let output = Output::of_block(output, None)?;
    let recipe = recipe::read(file).map_err(bad_input)?;
    let Made { block, truth, report } = recipe.build().map_err(bad_input)?;
    write(&block, &truth, &report, recipe.seed, &output)
}

fn write(block: &Block, truth: &Block, report: &Report, seed: u64, output: &Output) -> anyhow::Result<Answer> {
    let json = as_json(report, seed);
    output.write(&[], BLOCK_FILE, |dir| {
        write_block(truth, &dir.join("truth"))?;
        write_json(&dir.join("truth").join("errors.json"), &json)?;
        write_block(block, dir)?;
        usable(dir)
    })?;
    Ok(Answer { text: text(report) + &format!("\nBlock: {}\n", output.folder().display()), json, failure: None })
}

/// Whatever the registry refuses was asked for on the command line.
fn bad_input(error: anyhow::Error) -> Usage {
    Usage(format!("{error:#}"))
}

fn list() -> Answer {
    let mut text = String::new();
    for cause in inject::registry() {
        text += &format!("{}: {}\n", cause.id(), cause.summary());
        let mut table =
            (Table::new("").text("    parameter", "").text("unit", "").text("default", "")).text("meaning", "");
        for p in cause.parameters() {
            table.row([format!("    {}", p.name), p.unit.into(), p.default.to_string(), p.help.into()]);
        }
        if !cause.parameters().is_empty() {
            text += &table.to_text();
        }
        text.push('\n');
    }
    let parameter =
        |p: &ParameterSpec| json!({ "name": p.name, "unit": p.unit, "default": p.default.to_string(), "help": p.help });
    let cause = |cause: &&Cause| {
        let parameters: Vec<Value> = cause.parameters().iter().map(parameter).collect();
        json!({ "error": cause.id(), "summary": cause.summary(), "parameters": parameters })
    };
    let errors: Vec<Value> = inject::registry().iter().map(cause).collect();
    Answer { text, json: json!({ "format": 1, "errors": errors }), failure: None }
}

fn text(report: &Report) -> String {
    let mut table = Table::new("").text("error", "").text("parameters", "").text("drawn or derived", "");
    for applied in &report.applied {
        let list = |pairs: Vec<String>| pairs.join(", ");
        let parameters = applied.parameters.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let notes = applied.notes.iter().map(|(name, value)| format!("{name}: {value}")).collect();
        table.row([applied.id.to_string(), list(parameters), list(notes)]);
    }
    let mut text = table.to_text();
    for applied in &report.applied {
        if let Some(whose) = &applied.shared_formula {
            text += "\n";
            text += &paragraph("", 0, &format!("`{}` {SHARED} ({whose})", applied.id));
        }
    }
    text += &format!(
        "\n{} measurements were made anew; their errors: {} px RMS per coordinate, at most {} px. (They replace errors of {} px RMS.)\n",
        report.measurements,
        significant(report.change_rms_px, 3),
        significant(report.change_max_px, 3),
        significant(report.replaced_rms_px, 3),
    );
    for (what, change) in [("GNSS position", report.gnss_change_max_m), ("surveyed point", report.survey_change_max_m)]
    {
        if change > 0.0 {
            text += &format!("Largest error of a {what}: {} m\n", significant(change, 3));
        }
    }
    let dropped = &report.dropped;
    if dropped.total() > 0 {
        text += &format!(
            "Measurements that are no longer there: {} behind the camera, {} off the sensor, {} without a light path or an \
             instant of exposure, {} left alone\n",
            dropped.behind, dropped.off_sensor, dropped.no_solution, dropped.left_alone
        );
    }
    if !report.dropped_tie_points.is_empty() {
        text += &format!("Tie points that went with them: {}\n", report.dropped_tie_points.len());
    }
    text
}

fn as_json(report: &Report, seed: u64) -> Value {
    let pairs = |pairs: Vec<(String, String)>| -> Value {
        pairs.into_iter().map(|(name, value)| (name, Value::String(value))).collect::<serde_json::Map<_, _>>().into()
    };
    let errors = report.applied.iter().map(|applied| {
        let parameters = applied.parameters.iter().map(|(name, value)| (name.to_string(), value.clone())).collect();
        let mut error =
            json!({ "error": applied.id, "parameters": pairs(parameters), "notes": pairs(applied.notes.clone()) });
        if let Some(whose) = &applied.shared_formula {
            error["shared_formula"] = json!(format!("{SHARED} ({whose})"));
        }
        error
    });
    json!({
        "format": 1, "seed": seed, "errors": errors.collect::<Vec<_>>(), "measurements": report.measurements,
        "replaced_rms_px": report.replaced_rms_px, "change_rms_px": report.change_rms_px, "change_max_px": report.change_max_px,
        "gnss_change_max_m": report.gnss_change_max_m, "survey_change_max_m": report.survey_change_max_m,
        "dropped_measurements": report.dropped.total(), "dropped_tie_points": report.dropped_tie_points,
    })
}
