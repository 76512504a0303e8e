//! What it costs to test the whole catalogue beside what it costs to refit: part of `make bench`, or `cargo bench --bench screening`.
//! `MISCLOSURE_BENCH_THREADS` sets the number of threads (2).

use anyhow::{Context, Result};
use misclosure::adjust::Options;
use misclosure::diagnose::fit::fit;
use misclosure::diagnose::improve::Settings;
use misclosure::diagnose::linearised::{Added, linearise};
use misclosure::diagnose::run::diagnose;
use misclosure::model::Model;
use misclosure::report::numbers::fixed;
use misclosure::report::tables::Table;
use misclosure::run::default_diagnosis_datum;
use misclosure::scenario::{Scenario, SurveyNoise, add_noise, add_survey_noise, simulate};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

/// Blocks by preset and number of tie points; 0 for the preset's own.
const BLOCKS: [(&str, f64); 2] = [("dike", 0.0), ("corridor", 0.0)];
const SEED: u64 = 1;
/// px, as the block states.
const NOISE_PX: f64 = 0.3;
const SIGNIFICANCE: f64 = 1e-3;

fn main() -> Result<()> {
    let threads = match std::env::var("MISCLOSURE_BENCH_THREADS") {
        Ok(text) => text.parse().with_context(|| format!("MISCLOSURE_BENCH_THREADS = {text}: expected a number"))?,
        Err(_) => 2,
    };
    let mut table = Table::new("")
        .text("block", "")
        .number("measurements", "")
        .number("cold fit", "s")
        .number("screening", "s")
        .number("of two fits", "")
        .number("diagnosis", "s");
    for (preset, points) in BLOCKS {
        let parameters: BTreeMap<String, f64> =
            (points > 0.0).then(|| ("points".to_string(), points)).into_iter().collect();
        let mut block = simulate(&Scenario::preset(preset, &parameters)?, SEED)?.block;
        block.sigma.tie_px = NOISE_PX;
        add_noise(&mut block, NOISE_PX, SEED)?;
        add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, SEED);
        let model = Model { datum: default_diagnosis_datum(&block), ..Model::default() };
        let options = Options { threads, ..Options::default() };
        let settings = Settings { plugins: &[], options: options.clone(), significance: SIGNIFICANCE, tell: &|_| {} };
        let (base, of_fit) = timed(|| fit(&block, &model, None, &options));
        let base = base?;
        let (tested, of_screening) = timed(|| -> Result<usize> {
            let linearised = linearise(&block, &base, &Added::default(), false, &settings)?;
            let situation = linearised.situation(&settings, &BTreeSet::new());
            Ok(situation.judge_all(&situation.beside()).len())
        });
        tested?;
        let (diagnosed, of_diagnosis) = timed(|| diagnose(&block, &model, &settings));
        diagnosed?;
        table.row([
            preset.to_string(),
            block.ties.len().to_string(),
            fixed(of_fit, 2),
            fixed(of_screening, 2),
            fixed(of_screening / (2.0 * of_fit), 2),
            fixed(of_diagnosis, 2),
        ]);
    }
    println!("{threads} threads\n\n{}", table.to_text());
    Ok(())
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started = Instant::now();
    let value = work();
    (value, started.elapsed().as_secs_f64())
}
