//! `misclosure diagnose` and `misclosure improve`: what is missing in the model, and the loop that adds it.

use super::diagnosis_text::text;
use super::host::{Host, Live, announce};
use super::mend::{Mended, mend, undone};
use super::mistakes::SIGNIFICANCE;
use super::model_options::{ModelOptions, Treatment};
use super::output::Output;
use super::plugins::with_faults;
use super::summary_text::{failure, one_solver_line, warning};
use super::text::without_part;
use super::{Answer, Console, Usage};
use crate::adjust::Options;
use crate::block::Block;
use crate::diagnose::handed_on::{HandedOn, Keep};
use crate::diagnose::pictures::Shown;
use crate::diagnose::run::{Diagnosed, diagnose};
use crate::diagnose::settings::Settings;
use crate::io::block::read_block;
use crate::model::Model;
use crate::report;
use crate::run::cost::Task;
use crate::run::folder::OutlierRow;
use crate::run::summary::Summary;
use crate::run::{self, Run, folder, residual_rows};
use anyhow::Context;
use std::path::{Path, PathBuf};

/// Adjusts a block and names the physical effect that the model lacks
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure diagnose block -o run                       everything free, control and GNSS as they are
  misclosure diagnose block -o run --tie dc=pp           the ten-parameter camera
  misclosure diagnose block -o run --datum control --json | jq .candidates[0]")]
pub struct DiagnoseArguments {
    #[command(flatten)]
    common: Common,
}

/// Diagnoses, adds missing effects and adjusts again, until no significant misfit remains
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure improve block -o run                        the whole loop; then open run/report.html
  misclosure improve block -o run --json | jq .ledger    the steps and their figures
  misclosure improve block -o run --mend                 undo the mistakes that can be undone first (as mend)
  misclosure adjust block -o again --model run/model.toml   the improved model once more")]
pub struct ImproveArguments {
    #[command(flatten)]
    common: Common,
    /// Undo mistakes that can be undone (as `mend`) in a copy of the block, and go on with that; RUN/mended.toml says
    /// what was changed
    #[arg(long)]
    mend: bool,
}

#[derive(Debug, clap::Args)]
struct Common {
    /// Folder of the block
    block: PathBuf,
    /// Folder of the run
    #[arg(short, long, value_name = "RUN")]
    output: PathBuf,
    #[command(flatten)]
    asked: Asked,
}

/// Options of a diagnosis on the command line.
#[derive(Debug, Clone, clap::Args)]
pub struct Asked {
    /// Significance level: the probability that a block without any misfit gets a finding
    #[arg(long, default_value_t = SIGNIFICANCE, value_name = "P")]
    significance: f64,
    /// Acceptable point error (mm). Remaining misfit below it is reported as harmless; without it, misfit is compared
    /// with the precision of the points
    #[arg(long, value_name = "MM")]
    tolerance_mm: Option<f64>,
    /// Estimate the weights of image measurements and of GNSS for each flight by itself
    #[arg(long)]
    weights_by_flight: bool,
    #[command(flatten)]
    model: ModelOptions,
}

/// Runs `misclosure diagnose`.
pub fn run_diagnose(arguments: &DiagnoseArguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    execute(&arguments.common, console, threads, Keep::Base, None)
}

/// Runs `misclosure improve`.
pub fn run_improve(arguments: &ImproveArguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    if !arguments.mend {
        return execute(&arguments.common, console, threads, Keep::Improved, None);
    }
    let copy = tempfile::tempdir().context("no temporary folder for the mended copy of the block")?;
    let progress = console.progress("improve");
    let mended = mend(&arguments.common.block, copy.path(), &[], threads, &|what| progress.step(what))?;
    drop(progress);
    let mended = (!mended.mended.is_empty()).then_some((copy.path(), &mended));
    execute(&arguments.common, console, threads, Keep::Improved, mended)
}

impl Asked {
    /// Refuses numbers that no diagnosis can use.
    ///
    /// # Errors
    /// [`Usage`].
    fn judge(&self) -> Result<(), Usage> {
        if !(self.significance > 0.0 && self.significance < 0.5) {
            let text = format!("--significance {}: expected a probability above 0 and below 0.5", self.significance);
            return Err(Usage(text));
        }
        match self.tolerance_mm.filter(|tolerance| !(*tolerance > 0.0 && tolerance.is_finite())) {
            Some(tolerance) => Err(Usage(format!("--tolerance-mm {tolerance}: expected a length above 0"))),
            None => Ok(()),
        }
    }
}

/// A diagnosis, and everything that its folder is written from.
pub struct Found {
    /// What the diagnosis found, and the block without what is set aside.
    pub diagnosed: Diagnosed,
    /// The model that is handed on.
    pub model: Model,
    /// Its adjustment.
    pub run: Run,
    /// What is set aside.
    pub outliers: Vec<OutlierRow>,
    /// Why the adjustment is no result: solvers that disagree.
    pub failure: Option<anyhow::Error>,
}

/// Diagnoses a block as the commands do.
///
/// # Errors
/// Options that do not fit the block; an adjustment that fails.
pub fn find(block: Block, asked: &Asked, keep: Keep, options: &Options, host: &dyn Host) -> anyhow::Result<Found> {
    asked.judge()?;
    announce(host, &block, Task::Diagnose)?;
    let (block, mut outliers) = asked.model.without_outliers(block.about_its_centre(), host)?;
    let mut model = asked.model.model(run::default_diagnosis_datum(&block))?;
    if asked.weights_by_flight {
        for flight in &block.flights {
            model.flight_factors.entry(flight.clone()).or_default();
        }
    }
    let snoop = asked.model.outliers.unwrap_or(Treatment::Snoop) == Treatment::Snoop;
    asked.model.judge_start(&block, &model, host)?;
    let tell = |what: &str| host.step(what);
    let (whole, model) = asked.model.started(block, model, options, &tell)?;
    let plugins = asked.model.plugin_effects()?;
    let settings =
        Settings { plugins: &plugins, options: options.clone(), significance: asked.significance, snoop, tell: &tell };
    let effects = || model.effects.iter().map(|term| &term.effect).chain(&plugins);
    let mut diagnosed =
        diagnose(&whole, &model, &settings).map_err(|error| with_faults(error.into(), effects(), &whole))?;
    outliers.extend(diagnosed.outliers.rows(&whole));
    // Of a large block one copy is enough.
    drop(whole);
    let tolerance_m = asked.tolerance_mm.map(|mm| 1e-3 * mm);
    let HandedOn { model: final_model, run, held } = diagnosed
        .hand_on(keep, &asked.model.solvers(), tolerance_m, &settings)
        .map_err(|error| with_faults(error.into(), effects(), &diagnosed.block))?;
    if let Some(held) = held {
        host.message(&held);
    }
    let block = &diagnosed.block;
    asked.model.doubts(block, &run, host);
    if let Some(why) = run.why_not_compared(block) {
        host.message(&why);
    }
    let idle = run.problem.images_without_part();
    if !idle.is_empty() {
        host.message(&without_part(&idle));
    }
    let failure = failure(&run);
    Ok(Found { diagnosed, model: final_model, run, outliers, failure })
}

impl Found {
    /// Writes everything that the folder of a run has into `dir`; `source`: the block that was read, where it lies in a
    /// folder.
    ///
    /// # Errors
    /// A model that cannot be projected; a file that cannot be written.
    pub fn write(&self, dir: &Path, source: Option<&Path>) -> anyhow::Result<()> {
        let Self { diagnosed, model, run, outliers, .. } = self;
        let Diagnosed { block, diagnosis, improvement, before, after, .. } = diagnosed;
        let before = (!diagnosis.recommended.is_empty()).then_some(before);
        let base = before.map(|_| &improvement.base);
        let shown = Shown { block, base, fit: &improvement.fit, added: &diagnosis.recommended, before, after };
        let outliers = outliers.clone();
        report::run::Diagnosed { source, block, model, run, outliers, diagnosis, shown }.write(dir)
    }
}

fn execute(
    arguments: &Common,
    console: &Console,
    threads: usize,
    keep: Keep,
    mended: Option<(&Path, &Mended)>,
) -> anyhow::Result<Answer> {
    arguments.asked.judge()?;
    let output = Output::of_run(&arguments.output, &arguments.block)?;
    let loaded = read_block(mended.map_or(arguments.block.as_path(), |(copy, _)| copy))?;
    let host = Live::new(console, "diagnose");
    if !loaded.set_aside.is_empty() {
        host.message(&format!("{}: set aside: {}", arguments.block.display(), loaded.set_aside));
    }
    let options = Options { threads, ..Options::default() };
    let found = find(loaded.block, &arguments.asked, keep, &options, &host)?;
    drop(host);
    output.tell_replaced(console);
    output.write(&folder::FILES, folder::SUMMARY, |dir| {
        found.write(dir, Some(&arguments.block))?;
        match mended {
            Some((copy, _)) => {
                std::fs::copy(copy.join(folder::MENDED), dir.join(folder::MENDED)).map(|_| ()).context(folder::MENDED)
            }
            None => Ok(()),
        }
    })?;
    let Found { diagnosed: Diagnosed { block, diagnosis, .. }, run, failure, .. } = found;
    let rows = residual_rows(&block, &run.problem, &run.solution().state, run.comparison.as_ref())?;
    let summary = Summary::of(&block, &run, &rows);
    let warning = warning(&summary);
    let next = match keep {
        Keep::Base if !diagnosis.recommended.is_empty() => {
            "\nThis run is of the base model; improve hands on the model of the last step.\n"
        }
        _ => "",
    };
    let undone = mended.map_or_else(String::new, |(_, mended)| undone(mended));
    let text = undone
        + &warning
        + &text(&diagnosis, summary.has_scale())
        + &one_solver_line(&summary)
        + next
        + &format!("\nRun: {}\n", arguments.output.display());
    Ok(Answer { text, json: serde_json::to_value(&diagnosis)?, failure })
}
