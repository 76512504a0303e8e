//! `misclosure adjust`: one adjustment, with both solvers unless one is asked for.

use super::blunders;
use super::exit::Bent;
use super::mistakes::SIGNIFICANCE;
use super::model_options::ModelOptions;
use super::output::Output;
use super::plugins::with_faults;
use super::summary_text::{failure, text};
use super::{Answer, Console};
use crate::adjust::Options;
use crate::diagnose::screening;
use crate::io::block::read_block;
use crate::model::Datum;
use crate::report::numbers::significant;
use crate::report::run::write_page_of;
use crate::run::summary::Summary;
use crate::run::{self, Run, TieResiduals, folder, gnss_residuals, residual_rows};
use std::ops::ControlFlow;
use std::path::PathBuf;

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

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    let output = Output::of_run(&arguments.output, &arguments.block)?;
    let loaded = read_block(&arguments.block)?;
    if !loaded.set_aside.is_empty() {
        console.message(&format!("{}: set aside: {}", arguments.block.display(), loaded.set_aside));
    }
    let (whole, mut outliers) = arguments.model.without_outliers(loaded.block.about_its_centre(), console)?;
    let model = arguments.model.model(Datum::Free)?;
    let options = Options { threads, ..Options::default() };
    arguments.model.judge_start(&whole, &model, console)?;
    let progress = console.progress("adjust");
    let (whole, model) = arguments.model.started(whole, model, &options, &|what| progress.step(what))?;
    progress.step("holding the survey against the shape that the images give");
    let mistakes = screening::mistakes(&whole, &model, SIGNIFICANCE, &options);
    let search = blunders::search(&whole, &model, &options, arguments.model.outliers, &|what| progress.step(what))?;
    let block = &*search.block(&whole);
    let set_aside = search.outliers(&whole).rows(&whole);
    let run = run::adjust(block, &model, &arguments.model.solvers(), &options, &mut |solver, at| {
        let (cost, gradient) = (significant(at.cost, 9), significant(at.gradient_max, 2));
        progress
            .step(&format!("{solver}: iteration {}, cost {cost}, gradient {gradient}, {:.1} s", at.number, at.seconds));
        ControlFlow::Continue(())
    });
    drop(progress);
    let run = match run {
        Ok(run) => Run { mistakes, ..run },
        Err(error) => {
            // An adjustment that failed says nothing of its reason; a mistake may be it.
            mistakes.iter().for_each(|mistake| console.message(&format!("{} {}", mistake.sentence, mistake.remedy)));
            let error = blunders::explain(error, block, &model, &options, &output);
            return Err(with_faults(error, model.effects.iter().map(|term| &term.effect), &whole));
        }
    };
    if !set_aside.is_empty() {
        console.message(&format!("{} measurements are set aside (outliers.csv)", set_aside.len()));
    }
    outliers.extend(set_aside);
    let named = blunders::named(block, &model, &options, &run);
    let failure = match &named {
        // Whether solvers agree in a bent adjustment is chance, and says nothing of it.
        Some(named) if named.bent => Some(Bent(named.text.clone()).into()),
        _ => failure(&run),
    };
    if let (Some(named), None) = (&named, &failure) {
        console.message(&named.text);
    }
    arguments.model.doubts(block, &run, console);
    if let Some(why) = run.why_not_compared(block) {
        console.message(&why);
    }
    let idle = run.problem.images_without_part();
    if !idle.is_empty() {
        console.message(&format!("{} images have too few measurements to take part: {}", idle.len(), idle.join(", ")));
    }
    let (state, comparison) = (&run.solution().state, run.comparison.as_ref());
    let rows = residual_rows(block, &run.problem, state, comparison)?;
    let gnss = gnss_residuals(block, &run.problem, state, comparison)?;
    let summary = Summary::of(block, &run, &rows);
    output.tell_replaced(console);
    output.write(&folder::FILES, folder::SUMMARY, |dir| {
        folder::write(dir, block, &model, &run, &rows, &gnss)?;
        let ties = TieResiduals::of(block, &rows);
        // Of millions of measurements: they are not needed any more.
        drop(rows);
        folder::write_outliers(dir, outliers)?;
        folder::write_source(dir, &arguments.block, &block.crs)?;
        write_page_of(dir, ties)
    })?;
    let text = text(&summary) + &format!("\nRun: {}\n", arguments.output.display());
    Ok(Answer { text, json: serde_json::to_value(&summary)?, failure })
}
