//! What it costs to test the residuals for structure beside the adjustment itself: part of `make bench`, or `cargo
//! bench --bench structure`. `MISCLOSURE_BENCH_THREADS` sets the number of threads (2).

use anyhow::{Context, Result};
use misclosure::adjust::native::Native;
use misclosure::adjust::{CovarianceOf, Options};
use misclosure::model::Model;
use misclosure::null_model::SharedBase;
use misclosure::residuals::analyse;
use misclosure::residuals::check_points::{Adjusted, heights};
use misclosure::run::{adjust, default_diagnosis_datum};
use misclosure::scenario::{Scenario, SurveyNoise, add_noise, add_survey_noise, simulate};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Instant;

const BLOCK: &str = "dike";
const SEED: u64 = 1;
/// px, as the block states.
const NOISE_PX: f64 = 0.3;
const SIGNIFICANCE: f64 = 1e-3;

fn main() -> Result<()> {
    let threads = match std::env::var("MISCLOSURE_BENCH_THREADS") {
        Ok(text) => text.parse().with_context(|| format!("MISCLOSURE_BENCH_THREADS = {text}: expected a number"))?,
        Err(_) => 2,
    };
    let mut block = simulate(&Scenario::preset(BLOCK, &BTreeMap::new())?, SEED)?.block;
    add_noise(&mut block, NOISE_PX, SEED)?;
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, SEED);
    let model = Model { datum: default_diagnosis_datum(&block), ..Model::default() };
    let options = Options { threads, covariance: CovarianceOf::Nothing, ..Options::default() };
    let started = Instant::now();
    let run = adjust(&block, &model, &[&Native], &options, &mut |_, _| ControlFlow::Continue(()))?;
    let adjusted = started.elapsed().as_secs_f64();
    let started = Instant::now();
    let (problem, state, comparison) = (&run.problem, &run.solution().state, run.comparison.as_ref());
    let null_base = &SharedBase::default();
    let adjusted_block = Adjusted { block: &block, model: &model, problem, state, comparison, null_base };
    let heights = heights(&adjusted_block, SIGNIFICANCE, threads)?;
    let propagated = started.elapsed().as_secs_f64();
    let structure = analyse(problem, state, &heights, SIGNIFICANCE, threads)?;
    let analysed = started.elapsed().as_secs_f64();
    println!(
        "{BLOCK}, {} measurements, {threads} threads: {} tests {analysed:.2} s, {propagated:.2} s of it for check \
         points; adjusting {adjusted:.2} s; ratio {:.2}",
        run.problem.observations.len(),
        structure.tests.len(),
        analysed / adjusted
    );
    Ok(())
}
