//! `misclosure plan`: what a block would show before it is measured.

mod effects;
mod goals;
pub(super) mod mission;
mod mistakes;
mod page;
mod precision;

use super::model_options::{ModelOptions, Tie};
use super::output::writable_beside_blocks;
use super::simulate::{overrides, scenario, scenario_text};
use super::text::path_text;
use super::{Answer, Console, Usage};
use crate::adjust::Options;
use crate::block::Block;
use crate::diagnose::settings::Settings;
use crate::io::block::{is_block, read_block};
use crate::io::table::{TableWriter, write_json};
use crate::model::{Datum, Model};
use crate::plan::notice::Drawn;
use crate::plan::{Plan, PlanError, Size, plan};
use crate::report::html::Page;
use crate::run::default_diagnosis_datum;
use crate::scenario::{simulate, twin_of};
use anyhow::{Context, bail};
use goals::{Examined, GoalOptions};
use mission::{MissionOptions, Planned, with_mission};
use mistakes::MistakeOptions;
use std::path::{Path, PathBuf};

/// Says what a block would show, before it is measured: the smallest size of each effect that a diagnosis would find
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure plan dike                           a preset
  misclosure plan corridor --set length_m=500    with a parameter of the scenario
  misclosure plan my.toml -o planned             a flight of your own; a page with a map, and tables, in a folder
  misclosure plan dike --mission survey.plan     the images of a planned mission, all else as the scenario says
  misclosure plan block                          a block that was flown, as if it were measured without errors
  misclosure plan my.toml --goal 'height 10 mm' --goal 'focal-temperature 0.1 px/K' --extra more.toml
                                                 the cheapest additions of more.toml that reach two goals
  misclosure plan dike --mistake wrong-coordinate --mistake clock-offset
                                                 from which size two mistakes of people would be noticed

Nothing is random but mistakes: the sizes follow from the error-free block and the standard deviations that it states.
For mistakes, measurements are drawn with errors of these sizes.")]
pub struct Arguments {
    /// A preset (dike, corridor, mapping, closerange), a scenario's file, or the folder of a block
    #[arg(value_name = "PRESET|SCENARIO.toml|BLOCK")]
    what: PathBuf,
    /// Folder for report.html, plan.json, effects.csv and points.csv
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// A parameter of the scenario (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Seed of what is drawn: terrain, points and jitter of a scenario, and the errors for mistakes
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    mission: MissionOptions,
    #[command(flatten)]
    options: PlanOptions,
    #[command(flatten)]
    mistakes: MistakeOptions,
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
        let settings = self.settings(options, tell)?;
        plan(block, &self.model(block)?, &settings).map_err(|error| match error {
            PlanError::Refused(why) => Usage(why).into(),
            PlanError::Diagnose(error) => error.into(),
        })
    }

    /// What the diagnosis believes of the block.
    ///
    /// # Errors
    /// [`Usage`].
    pub fn model(&self, block: &Block) -> anyhow::Result<Model> {
        let Self { free, tie, datum, .. } = self;
        let model = ModelOptions { free: free.clone(), tie: *tie, datum: *datum, ..ModelOptions::default() };
        model.model(default_diagnosis_datum(block))
    }

    /// How it works.
    ///
    /// # Errors
    /// [`Usage`]: a significance that is no probability.
    pub fn settings<'a>(&self, options: Options, tell: &'a (dyn Fn(&str) + Sync)) -> anyhow::Result<Settings<'a>> {
        let significance = self.significance;
        if !(significance > 0.0 && significance < 1.0) {
            bail!(Usage(format!("--significance {significance}: expected a number between 0 and 1")));
        }
        Ok(Settings { plugins: &[], options, significance, snoop: true, tell })
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    let read = is_block(&arguments.what).then_some(arguments.what.as_path());
    if let Some(folder) = &arguments.output {
        writable_beside_blocks(folder, read)?;
    }
    arguments.goals.judge(read)?;
    arguments.mistakes.judge()?;
    arguments.mission.judge(read)?;
    let mission = arguments.mission.read(|| scenario(&arguments.what, &arguments.set))?;
    let told = mission.as_ref().map(|mission| mission.told(console)).transpose()?;
    let progress = console.progress("plan");
    let options = Options { threads, ..Options::default() };
    let planner = Planner { arguments, options, tell: &|what| progress.step(what) };
    let block = block(arguments, read, mission.as_ref())?;
    let base = planner.examined(&block)?;
    let reached = arguments.goals.reach(&base, |extras, chosen| {
        progress.step(&format!("planning with {}", extras.names(chosen).join(", ")));
        let (text, name) = scenario_text(&arguments.what)?;
        let scenario = extras.scenario(&text, &name, &overrides(&arguments.set)?, chosen)?;
        planner.examined(&simulate(&with_mission(scenario, mission.as_ref())?, arguments.seed)?.block)
    })?;
    let mistakes = match arguments.mistakes.any() {
        false => Vec::new(),
        true => planner.drawn(&block, |drawn| arguments.mistakes.noticed(drawn))?,
    };
    drop(progress);
    let base = base.plan;
    let mut json = serde_json::to_value(&base)?;
    let mut text = effects::text(&base) + &precision::text(&base);
    if !mistakes.is_empty() {
        text += &mistakes::text(&mistakes);
        json["mistakes"] = serde_json::to_value(&mistakes)?;
    }
    if let Some(reached) = &reached {
        text += &reached.text();
        json["goals"] = serde_json::to_value(reached)?;
    }
    if let Some(told) = told {
        json["mission"] = told;
    }
    if let Some(folder) = &arguments.output {
        write(&base, &json, &page::page(&base, &mistakes, reached.as_ref()), folder)?;
        text += &format!("\nPlan: {}\n", folder.join("report.html").display());
    }
    Ok(Answer { text, json, failure: None })
}

/// Computes the plan of a block, and draws its measurements where a goal or an option asks about mistakes.
struct Planner<'a> {
    arguments: &'a Arguments,
    options: Options,
    tell: &'a (dyn Fn(&str) + Sync),
}

impl Planner<'_> {
    fn examined(&self, block: &Block) -> anyhow::Result<Examined> {
        let plan = self.arguments.options.planned(block, self.options.clone(), self.tell)?;
        let said = match self.arguments.goals.mistakes()?.as_slice() {
            [] => Vec::new(),
            asked => {
                self.drawn(block, |drawn| Ok(asked.iter().map(|own| drawn.said_of(own)).collect::<Result<_, _>>()?))?
            }
        };
        Ok(Examined { plan, said })
    }

    fn drawn<T>(&self, block: &Block, act: impl FnOnce(&Drawn<'_>) -> anyhow::Result<T>) -> anyhow::Result<T> {
        let options = &self.arguments.options;
        let (model, settings) = (options.model(block)?, options.settings(self.options.clone(), self.tell)?);
        act(&Drawn::of(block, self.arguments.seed, &model, &settings)?)
    }
}

/// The error-free block.
fn block(arguments: &Arguments, read: Option<&Path>, mission: Option<&Planned>) -> anyhow::Result<Block> {
    let Some(folder) = read else {
        let scenario = with_mission(scenario(&arguments.what, &arguments.set)?, mission)?;
        return Ok(simulate(&scenario, arguments.seed)?.block);
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

/// `plan.json`, the tables, and the page.
fn write(planned: &Plan, json: &serde_json::Value, page: &Page, folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
    write_json(&folder.join("plan.json"), json)?;
    let header = [
        "effect",
        "parameter",
        "size",
        "named_size",
        "unit",
        "moves_m",
        "moves_height_m",
        "looks_like",
        "plausible",
        "size_alone",
    ];
    let mut table = TableWriter::create(&folder.join("effects.csv"), &header)?;
    for own in &planned.effects {
        for Size { parameter, size, named_size, looks_like, unit, size_alone, plausible, moves_m, moves_height_m } in
            &own.sizes
        {
            table.text(&own.effect).text(parameter).number(*size).optional(*named_size).text(unit);
            table.optional(*moves_m).optional(*moves_height_m).text(&looks_like.join(" "));
            table.optional(*plausible).optional(*size_alone);
            table.end_row()?;
        }
    }
    table.finish()?;
    if !planned.precision.points.is_empty() {
        let mut table = TableWriter::create(&folder.join("points.csv"), &["point", "x", "y", "z", "sx", "sy", "sz"])?;
        for own in &planned.precision.points {
            table.text(&own.name);
            own.position.iter().chain(own.sigma_m.iter()).for_each(|value| {
                table.number(*value);
            });
            table.end_row()?;
        }
        table.finish()?;
    }
    page.write(folder)
}
