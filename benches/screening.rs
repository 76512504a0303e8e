//! What it costs to test the whole catalogue beside what it costs to refit its effects: part of `make bench`, or `cargo bench --bench screening`.
//! `MISCLOSURE_BENCH_THREADS` sets the number of threads (2).

use anyhow::{Context, Result};
use misclosure::adjust::Options;
use misclosure::diagnose::candidate::candidates;
use misclosure::diagnose::fit::{fit, fit_with_weights, screen_all};
use misclosure::diagnose::scan::best_place;
use misclosure::diagnose::score::Base;
use misclosure::model::Model;
use misclosure::report::numbers::fixed;
use misclosure::report::tables::Table;
use misclosure::run::default_diagnosis_datum;
use misclosure::scenario::{Scenario, SurveyNoise, add_noise, add_survey_noise, simulate};
use std::collections::BTreeMap;
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
    block.sigma.tie_px = NOISE_PX;
    add_noise(&mut block, NOISE_PX, SEED)?;
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, SEED);
    let model = Model { datum: default_diagnosis_datum(&block), ..Model::default() };
    let options = Options { threads, ..Options::default() };
    let base = fit_with_weights(&block, &model, None, &[], &options, SIGNIFICANCE)?;
    let (screening, all) = timed(|| screen_all(&block, &base, &[], threads, SIGNIFICANCE));
    let screening = screening?;
    let at = Base {
        block: &block,
        model: &base.model,
        problem: &base.problem,
        state: &base.solution.state,
        threads,
        significance: SIGNIFICANCE,
    };
    let scanned =
        candidates(&block, &base.problem, &base.model, &[]).into_iter().filter(|c| c.testable() && c.scanned());
    let (scans, of_scans) =
        timed(|| scanned.map(|candidate| best_place(&at, &candidate)).collect::<Result<Vec<_>, _>>());
    scans?;
    let mut table = Table::new("").text("refit of", "").number("time", "s");
    let mut refits = Vec::new();
    for score in screening.scores.iter().filter(|score| score.dof > 0.0) {
        let mut larger = base.model.clone();
        larger.effects.extend(score.start_term());
        let (refit, seconds) = timed(|| fit(&block, &larger, Some(&base), &options));
        // Where nothing is missing a scanned flaw or a random effect has no place to converge to; such are not counted.
        let how = if refit.is_err() { " (did not converge)" } else { "" };
        table.row([format!("{}{how}", score.candidate.id), fixed(seconds, 2)]);
        if refit.is_ok() {
            refits.push(seconds);
        }
    }
    let mean = refits.iter().sum::<f64>() / refits.len() as f64;
    println!("{}", table.to_text());
    println!(
        "{BLOCK}, {} measurements, {threads} threads: screening {} candidates {all:.2} s, of which {of_scans:.2} s search places on the sensor; \
         refitting two {:.2} s on average; ratio {:.2}",
        block.ties.len(),
        screening.scores.len(),
        2.0 * mean,
        all / (2.0 * mean)
    );
    Ok(())
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started = Instant::now();
    let value = work();
    (value, started.elapsed().as_secs_f64())
}
