//! `misclosure adjust`: one adjustment, with both solvers unless one is asked for.

use super::blunders;
use super::exit::Bent;
use super::host::{Host, Live, announce};
use super::mistakes::SIGNIFICANCE;
use super::model_options::ModelOptions;
use super::output::Output;
use super::plugins::with_faults;
use super::summary_text::{failure, text};
use super::text::without_part;
use super::{Answer, Console};
use crate::adjust::Options;
use crate::block::Block;
use crate::io::block::read_block;
use crate::model::{Datum, Model};
use crate::report::numbers::significant;
use crate::report::run::write_page_of;
use crate::run::cost::Task;
use crate::run::folder::OutlierRow;
use crate::run::summary::Summary;
use crate::run::{self, Run, TieResiduals, folder, gnss_residuals, residual_rows};
use crate::screening;
use std::borrow::Cow;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Adjusts a block once and compares it with control and check points
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure adjust dike -o run                                   everything free
  misclosure adjust dike -o run --tie dc=pp --fix affinity,k3     fewer camera parameters
  misclosure adjust dike -o run --add focal-time --datum all      with an effect, control and GNSS
  misclosure adjust dike -o again --model run/model.toml          the same model once more")]
pub struct Arguments {
    /// Folder of the block
    block: PathBuf,
    /// Folder of the run
    #[arg(short, long, value_name = "RUN")]
    output: PathBuf,
    #[command(flatten)]
    model: ModelOptions,
}

/// An adjustment, and everything that its folder is written from.
pub struct Adjusted {
    /// The block without what is set aside.
    pub block: Block,
    /// The model.
    pub model: Model,
    /// What the solvers gave.
    pub run: Run,
    /// What is set aside.
    pub outliers: Vec<OutlierRow>,
    /// Why the result is none, where it was computed all the same: solvers that disagree, blunders that bend it.
    pub failure: Option<anyhow::Error>,
}

/// Adjusts a block as the command does. `output`: where residuals go that explain a failure.
///
/// # Errors
/// Options that do not fit the block; an adjustment that fails.
pub fn adjust(
    block: Block,
    asked: &ModelOptions,
    options: &Options,
    output: Option<&Output>,
    host: &dyn Host,
) -> anyhow::Result<Adjusted> {
    announce(host, &block, Task::Adjust)?;
    let (whole, mut outliers) = asked.without_outliers(block.about_its_centre(), host)?;
    let model = asked.model(Datum::Free)?;
    asked.judge_start(&whole, &model, host)?;
    let (whole, model) = asked.started(whole, model, options, &|what| host.step(what))?;
    host.step("holding the survey against the shape that the images give");
    let mistakes = screening::mistakes(&whole, &model, SIGNIFICANCE, options);
    let search = blunders::search(&whole, &model, options, asked.outliers, &|what| host.step(what))?;
    let set_aside = search.outliers(&whole).rows(&whole);
    let changed = match search.block(&whole) {
        Cow::Owned(block) => Some(block),
        Cow::Borrowed(_) => None,
    };
    let block = changed.as_ref().unwrap_or(&whole);
    let run = run::adjust(block, &model, &asked.solvers(), options, &mut |solver, at| {
        let (cost, gradient) = (significant(at.cost, 9), significant(at.gradient_max, 2));
        host.step(&format!("{solver}: iteration {}, cost {cost}, gradient {gradient}, {:.1} s", at.number, at.seconds));
        ControlFlow::Continue(())
    });
    let run = match run {
        Ok(run) => Run { mistakes, ..run },
        Err(error) => {
            // An adjustment that failed says nothing of its reason; a mistake may be it.
            mistakes.iter().for_each(|mistake| host.message(&format!("{} {}", mistake.sentence, mistake.remedy)));
            let error = blunders::explain(error, block, &model, options, output);
            return Err(with_faults(error, model.effects.iter().map(|term| &term.effect), &whole));
        }
    };
    if !set_aside.is_empty() {
        host.message(&format!("{} measurements are set aside (outliers.csv)", set_aside.len()));
    }
    outliers.extend(set_aside);
    let named = blunders::named(block, &model, options, &run);
    let failure = match &named {
        // Whether solvers agree in a bent adjustment is chance, and says nothing of it.
        Some(named) if named.bent => Some(Bent(named.text.clone()).into()),
        _ => failure(&run),
    };
    if let (Some(named), None) = (&named, &failure) {
        host.message(&named.text);
    }
    asked.doubts(block, &run, host);
    if let Some(why) = run.why_not_compared(block) {
        host.message(&why);
    }
    let idle = run.problem.images_without_part();
    if !idle.is_empty() {
        host.message(&without_part(&idle));
    }
    Ok(Adjusted { block: changed.unwrap_or(whole), model, run, outliers, failure })
}

impl Adjusted {
    /// Writes everything that the folder of a run has into `dir`; `source`: the block that was read, where it lies in a
    /// folder.
    ///
    /// # Errors
    /// A model that cannot be projected; a file that cannot be written.
    pub fn write(&self, dir: &Path, source: Option<&Path>) -> anyhow::Result<Summary> {
        let Self { block, model, run, outliers, .. } = self;
        let (state, comparison) = (&run.solution().state, run.comparison.as_ref());
        let rows = residual_rows(block, &run.problem, state, comparison)?;
        let gnss = gnss_residuals(block, &run.problem, state, comparison)?;
        let summary = Summary::of(block, run, &rows);
        folder::write(dir, block, model, run, &rows, &gnss)?;
        let ties = TieResiduals::of(block, &rows);
        // Of millions of measurements: they are not needed any more.
        drop(rows);
        folder::write_outliers(dir, outliers.clone())?;
        if let Some(source) = source {
            folder::write_source(dir, source, &block.crs)?;
        }
        write_page_of(dir, ties)?;
        Ok(summary)
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    let output = Output::of_run(&arguments.output, &arguments.block)?;
    let loaded = read_block(&arguments.block)?;
    let host = Live::new(console, "adjust");
    if !loaded.set_aside.is_empty() {
        host.message(&format!("{}: set aside: {}", arguments.block.display(), loaded.set_aside));
    }
    let options = Options { threads, ..Options::default() };
    let adjusted = adjust(loaded.block, &arguments.model, &options, Some(&output), &host)?;
    drop(host);
    output.tell_replaced(console);
    let summary = output.write(&folder::FILES, folder::SUMMARY, |dir| adjusted.write(dir, Some(&arguments.block)))?;
    let text = text(&summary) + &format!("\nRun: {}\n", arguments.output.display());
    Ok(Answer { text, json: serde_json::to_value(&summary)?, failure: adjusted.failure })
}
