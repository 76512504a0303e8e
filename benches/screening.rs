//! Processor time of testing the whole catalogue, and of a refit: part of `make bench`, or `cargo bench
//! --bench screening`. `MISCLOSURE_BENCH_THREADS` sets the number of threads (2); with `MISCLOSURE_BENCH_LARGE` a
//! corridor of two million measurements takes part. A text behind `--` runs those that have it in their name.

use anyhow::{Context, Result};
use misclosure::adjust::Options;
use misclosure::block::Block;
use misclosure::diagnose::added::Added;
use misclosure::diagnose::linearised::linearise;
use misclosure::diagnose::run::diagnose;
use misclosure::diagnose::settings::Settings;
use misclosure::inject;
use misclosure::io::block::read_block;
use misclosure::model::Model;
use misclosure::report::numbers::fixed;
use misclosure::report::tables::Table;
use misclosure::run::default_diagnosis_datum;
use misclosure::run::fit::fit;
use misclosure::scenario::{Scenario, SurveyNoise, add_survey_noise, simulate};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// Simulated blocks: preset, number of tie points (0 for the preset's own), and an error.
const SIMULATED: [(&str, f64, &str); 3] = [("dike", 0.0, ""), ("dike", 0.0, "focal-growth"), ("corridor", 0.0, "")];
/// The corridor of two million measurements, where `MISCLOSURE_BENCH_LARGE` is set: minutes.
const LARGE: (&str, f64, &str) = ("corridor", 340_000.0, "");
/// Real blocks, where they are at hand.
const REAL: [&str; 2] = ["../shared/data/uav-seneca", "../shared/data/uav-caliterra"];
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
        .number("images", "")
        .number("measurements", "")
        .number("columns", "")
        .number("fit", "s")
        .number("screening", "s")
        .number("of two fits", "")
        .number("improve", "s")
        .number("steps", "")
        .text("found", "");
    let texts: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let asked = |name: &str| texts.is_empty() || texts.iter().any(|text| name.contains(text));
    let large = std::env::var_os("MISCLOSURE_BENCH_LARGE").map(|_| LARGE);
    for (preset, points, error) in SIMULATED.into_iter().chain(large) {
        let name = if points > 0.0 { format!("{preset} of {points}") } else { format!("{preset} {error}") };
        if !asked(&name) {
            continue;
        }
        row(&mut table, &name, &simulated(preset, points, error)?, &Model::default(), threads)?;
    }
    for path in REAL.map(Path::new).into_iter().filter(|path| asked(&path.display().to_string())) {
        if !path.exists() {
            eprintln!("skipped: no {}", path.display());
            continue;
        }
        let block = read_block(path)?.block;
        let name = block.name.clone();
        row(&mut table, &name, &block, &Model { tie_dc_to_pp: true, ..Model::default() }, threads)?;
    }
    println!("{threads} threads\n\n{}", table.to_text());
    Ok(())
}

fn simulated(preset: &str, points: f64, error: &str) -> Result<Block> {
    let parameters: BTreeMap<String, f64> =
        (points > 0.0).then(|| ("points".to_string(), points)).into_iter().collect();
    let truth = simulate(&Scenario::preset(preset, &parameters)?, SEED)?.block;
    let mut errors = vec![inject::parse(&format!("noise:px={NOISE_PX}"))?];
    if !error.is_empty() {
        errors.push(inject::parse(error)?);
    }
    let mut block = inject::apply(&truth, &truth, &errors, SEED)?.block;
    block.sigma.tie_px = NOISE_PX;
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, SEED);
    Ok(block)
}

fn row(table: &mut Table, name: &str, block: &Block, model: &Model, threads: usize) -> Result<()> {
    let model = Model { datum: default_diagnosis_datum(block), ..model.clone() };
    let options = Options { threads, ..Options::default() };
    let settings =
        Settings { plugins: &[], options: options.clone(), significance: SIGNIFICANCE, snoop: true, tell: &|_| {} };
    let (base, of_fit) = timed(|| fit(block, &model, None, &options));
    let base = base?;
    let (columns, of_screening) = timed(|| -> Result<usize> {
        let linearised = linearise(block, &base, &Added::default(), &settings)?;
        let situation = linearised.situation(&settings);
        situation.judge_all(&situation.beside());
        Ok(linearised.scores.score.len())
    });
    let (diagnosed, of_diagnosis) = timed(|| diagnose(block, &model, &settings));
    let diagnosis = diagnosed?.diagnosis;
    table.row([
        name.to_string(),
        block.images.len().to_string(),
        block.ties.len().to_string(),
        columns?.to_string(),
        fixed(of_fit, 2),
        fixed(of_screening, 2),
        fixed(of_screening / (2.0 * of_fit), 2),
        fixed(of_diagnosis, 2),
        (diagnosis.ledger.len() - 1).to_string(),
        diagnosis.recommended.join(", "),
    ]);
    Ok(())
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started = Instant::now();
    let value = work();
    (value, started.elapsed().as_secs_f64())
}
