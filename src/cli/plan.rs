//! `misclosure plan`: what a block would show before it is measured.

use super::model_options::{ModelOptions, Tie};
use super::output::writable_beside_blocks;
use super::plan_goals::GoalOptions;
use super::simulate::{overrides, scenario, scenario_text};
use super::text::{listed, paragraph, path_text};
use super::{Answer, Console, Usage};
use crate::adjust::Options;
use crate::block::Block;
use crate::diagnose::settings::Settings;
use crate::io::block::{is_block, read_block};
use crate::io::table::{TableWriter, write_json};
use crate::model::Datum;
use crate::plan::{Plan, PlanError, Size, Visible, plan};
use crate::report::numbers::{or_dash, significant, unit_of};
use crate::report::tables::Table;
use crate::run::default_diagnosis_datum;
use crate::scenario::{simulate, twin_of};
use anyhow::{Context, bail};
use std::path::{Path, PathBuf};

/// Parameters of an effect, and names of others, that the table shows one by one.
const SHOWN: usize = 3;

/// Says what a block would show, before it is measured: the smallest size of each effect that a diagnosis would find
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure plan dike                           a preset
  misclosure plan corridor --set length_m=500    with a parameter of the scenario
  misclosure plan my.toml -o planned             a flight of your own; effects.csv and plan.json in a folder
  misclosure plan block                          a block that was flown, as if it were measured without errors
  misclosure plan my.toml --goal 'height 10 mm' --goal 'focal-temperature 0.1 px/K' --extra more.toml
                                                 the cheapest additions of more.toml that reach two goals

Nothing is random: the sizes follow from the error-free block and the standard deviations that it states.")]
pub struct Arguments {
    /// A preset (dike, corridor, mapping, closerange), a scenario's file, or the folder of a block
    #[arg(value_name = "PRESET|SCENARIO.toml|BLOCK")]
    what: PathBuf,
    /// Folder for plan.json and effects.csv
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// A parameter of the scenario (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Seed of what a scenario draws: terrain, points, jitter
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    options: PlanOptions,
    #[command(flatten)]
    goals: GoalOptions,
}

/// How the block will be diagnosed.
#[derive(Debug, clap::Args)]
pub struct PlanOptions {
    /// Probability that a diagnosis of a block without any misfit names a cause
    #[arg(long, value_name = "P", default_value_t = 1e-3)]
    significance: f64,
    /// Free camera parameters, as for `adjust` [default: all]
    #[arg(long, value_name = "LIST")]
    free: Vec<String>,
    /// `dc=pp`: the centre of distortion is the principal point
    #[arg(long, value_name = "dc=pp")]
    tie: Option<Tie>,
    /// What defines position, orientation and scale [default: all that the block has]
    #[arg(long)]
    datum: Option<Datum>,
}

impl PlanOptions {
    /// What an error-free block would show.
    ///
    /// # Errors
    /// [`Usage`]; a block that cannot be adjusted.
    pub fn planned(&self, block: &Block, options: Options, tell: &(dyn Fn(&str) + Sync)) -> anyhow::Result<Plan> {
        let Self { significance, free, tie, datum } = self;
        if !(*significance > 0.0 && *significance < 1.0) {
            bail!(Usage(format!("--significance {significance}: expected a number between 0 and 1")));
        }
        let model = ModelOptions { free: free.clone(), tie: *tie, datum: *datum, ..ModelOptions::default() };
        let model = model.model(default_diagnosis_datum(block))?;
        let settings = Settings { plugins: &[], options, significance: *significance, snoop: false, tell };
        plan(block, &model, &settings).map_err(|error| match error {
            PlanError::Refused(why) => Usage(why).into(),
            PlanError::Diagnose(error) => error.into(),
        })
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    let read = is_block(&arguments.what).then_some(arguments.what.as_path());
    if let Some(folder) = &arguments.output {
        writable_beside_blocks(folder, read)?;
    }
    arguments.goals.judge(read)?;
    let progress = console.progress("plan");
    let options = Options { threads, ..Options::default() };
    let planned = |block: &Block| arguments.options.planned(block, options.clone(), &|what| progress.step(what));
    let base = planned(&block(arguments, read)?)?;
    let reached = arguments.goals.reach(&base, |extras, chosen| {
        progress.step(&format!("planning with {}", extras.names(chosen).join(", ")));
        let (text, name) = scenario_text(&arguments.what)?;
        let scenario = extras.scenario(&text, &name, &overrides(&arguments.set)?, chosen)?;
        planned(&simulate(&scenario, arguments.seed)?.block)
    })?;
    drop(progress);
    let (mut text, mut json) = (text(&base), serde_json::to_value(&base)?);
    if let Some(reached) = reached {
        text += &reached.text();
        json["goals"] = serde_json::to_value(reached)?;
    }
    if let Some(folder) = &arguments.output {
        write(&base, &json, folder)?;
        text += &format!("\nPlan: {}\n", folder.display());
    }
    Ok(Answer { text, json, failure: None })
}

/// The error-free block.
fn block(arguments: &Arguments, read: Option<&Path>) -> anyhow::Result<Block> {
    let Some(folder) = read else {
        return Ok(simulate(&scenario(&arguments.what, &arguments.set)?, arguments.seed)?.block);
    };
    if !arguments.set.is_empty() {
        bail!(Usage(format!("--set: {} is a block; parameters belong to a scenario", path_text(folder))));
    }
    error_free(read_block(folder)?.block)
}

/// A block as if it had been measured without errors.
///
/// # Errors
/// A block of which no tie point can be intersected.
pub fn error_free(block: Block) -> anyhow::Result<Block> {
    let block = block.about_its_centre();
    Ok(Block { origin: block.origin, ..twin_of(&block)?.block })
}

fn write(planned: &Plan, json: &serde_json::Value, folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
    write_json(&folder.join("plan.json"), json)?;
    let header = ["effect", "parameter", "size", "named_size", "unit", "moves_m", "moves_height_m", "looks_like"];
    let mut table = TableWriter::create(&folder.join("effects.csv"), &header)?;
    for own in &planned.effects {
        for Size { parameter, size, named_size, looks_like, unit, moves_m, moves_height_m } in &own.sizes {
            table.text(&own.effect).text(parameter).number(*size).optional(*named_size).text(unit);
            table.optional(*moves_m).optional(*moves_height_m).text(&looks_like.join(" "));
            table.end_row()?;
        }
    }
    Ok(table.finish()?)
}

fn text(planned: &Plan) -> String {
    let Plan { block, images, tie_points, tie_measurements, control, check, gnss, .. } = planned;
    let mut text = format!(
        "Plan `{block}`: {images} images ({gnss} with GNSS), {tie_points} tie points with {tie_measurements} \
         measurements, {control} control and {check} check points\n\n"
    );
    text += &format!(
        "SMALLEST EFFECTS THAT IT WOULD SHOW (found with {:.0} %, at a significance of {})\n\n",
        1e2 * planned.power,
        planned.significance
    );
    let mut table = Table::new("")
        .text("effect", "")
        .text("parameter", "")
        .number("seen from", "")
        .number("named from", "")
        .text("unit", "")
        .number("unseen it moves points by", "mm")
        .text("till then it may be called", "");
    for own in &planned.effects {
        rows(own, &mut table);
    }
    text += &table.to_text();
    for (needs, effects) in by_needs(planned) {
        text += &paragraph("", 2, &format!("Not to be seen: {}; needed: {needs}.", effects.join(", ")));
    }
    let told = planned.effects.iter().filter_map(|own| Some((own, own.tell.as_ref()?)));
    for (own, tell) in told {
        let others = listed(&others(&own.sizes), SHOWN);
        text += &paragraph("", 2, &format!("To tell {} from {others}: {tell}.", own.effect));
    }
    if !planned.blind.is_empty() {
        let names: Vec<&str> = planned.blind.iter().map(String::as_str).collect();
        text += &format!("\nToo few measurements to take part: {} images ({}).\n", names.len(), listed(&names, SHOWN));
    }
    if planned.tied_centre {
        text += "\nThe block does not determine the centre of distortion: it is tied to the principal point.\n";
    }
    let precision = &planned.precision;
    if let (Some(plan), Some(height)) = (precision.plan_m, precision.height_m) {
        text += &format!(
            "\nIf nothing is wrong, tie points have standard deviations of {} mm in plan and {} mm in height \
             (median).\n95 % of them stay below {} mm and {} mm.\n",
            short_mm(plan.typical),
            short_mm(height.typical),
            short_mm(plan.worst),
            short_mm(height.worst)
        );
    }
    text
}

/// Effects that cannot be shown, by what they need.
fn by_needs(planned: &Plan) -> Vec<(String, Vec<&str>)> {
    let mut all: Vec<(String, Vec<&str>)> = Vec::new();
    for hidden in &planned.hidden {
        let needs = hidden.needs.join("; ");
        match all.iter_mut().find(|(own, _)| *own == needs) {
            Some((_, effects)) => effects.push(&hidden.effect),
            None => all.push((needs, vec![&hidden.effect])),
        }
    }
    all
}

/// A row for each parameter; of many parameters one with their range.
fn rows(own: &Visible, table: &mut Table) {
    let alike = |sizes: &[Size]| match others(sizes) {
        none if none.is_empty() => "-".into(),
        others => listed(&others, SHOWN),
    };
    let named = |size: &Size| or_dash(size.named_size, |own| significant(own, 3));
    let unit = |size: &Size| unit_of(&size.unit).to_owned();
    if own.sizes.len() <= SHOWN {
        for size in &own.sizes {
            let alike = alike(std::slice::from_ref(size));
            let numbers = [significant(size.size, 3), named(size), unit(size), or_dash(size.moves_m, short_mm), alike];
            table.row([own.effect.clone(), size.parameter.clone()].into_iter().chain(numbers));
        }
        return;
    }
    let by_size = |a: &&Size, b: &&Size| a.size.total_cmp(&b.size);
    let (Some(least), Some(most)) = (own.sizes.iter().min_by(by_size), own.sizes.iter().max_by(by_size)) else {
        return;
    };
    let range = match own.sizes.iter().all(|size| size.unit == least.unit) {
        true => format!("{} to {}", significant(least.size, 3), significant(most.size, 3)),
        false => format!("from {}", significant(least.size, 3)),
    };
    let count = format!("{} parameters", own.sizes.len());
    let alike = alike(&own.sizes);
    table.row([own.effect.clone(), count, range, "-".into(), unit(least), or_dash(own.worst_m(), short_mm), alike]);
}

/// Effects that may be named in the place of some sizes.
fn others(sizes: &[Size]) -> Vec<&str> {
    let mut all: Vec<&str> = Vec::new();
    for other in sizes.iter().flat_map(|size| &size.looks_like) {
        if !all.contains(&other.as_str()) {
            all.push(other);
        }
    }
    all
}

fn short_mm(metres: f64) -> String {
    significant(1e3 * metres, 2)
}
