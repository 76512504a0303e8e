//! What it costs to test the whole catalogue beside what it costs to refit its effects: part of `make bench`, or `cargo bench --bench screening`.
//! `MISCLOSURE_BENCH_THREADS` sets the number of threads (2).

use anyhow::{Context, Result};
use misclosure::adjust::ceres::Ceres;
use misclosure::adjust::native::Native;
use misclosure::adjust::{Options, Solver};
use misclosure::diagnose::candidate::candidates;
use misclosure::diagnose::fit::{fit, refit, screen_all, with_weights};
use misclosure::diagnose::models::with_candidate;
use misclosure::diagnose::scan::best_place;
use misclosure::diagnose::score::Base;
use misclosure::model::{Model, SigmaFactors};
use misclosure::report::numbers::fixed;
use misclosure::report::tables::Table;
use misclosure::run::{self, default_diagnosis_datum};
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
    block.sigma.tie_px = NOISE_PX;
    add_noise(&mut block, NOISE_PX, SEED)?;
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, SEED);
    let model = Model { datum: default_diagnosis_datum(&block), ..Model::default() };
    let options = Options { threads, ..Options::default() };
    let base = fit(&block, &model, None, &options)?;
    let base = with_weights(&block, base, SigmaFactors::default(), &[], &options, SIGNIFICANCE)?;
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
    let mut table = Table::new("").text("refit of", "").number("diagnosis", "s").number("both solvers", "s");
    let solvers: [&dyn Solver; 2] = [&Native, &Ceres];
    let (mut refits, mut adjustments) = (Vec::new(), Vec::new());
    for score in screening.scores.iter().filter(|score| score.dof > 0.0) {
        let larger = with_candidate(&base.model, score);
        let (refitted, of_refit) = timed(|| refit(&block, &larger, &base, &options));
        let adjust = || run::adjust(&block, &larger, &solvers, &options, &mut |_, _| ControlFlow::Continue(()));
        let (adjusted, of_adjustment) = timed(adjust);
        // Where nothing is missing a random effect has no size to converge to; such are not counted.
        let row = |ok: bool, seconds: f64| if ok { fixed(seconds, 2) } else { "fails".into() };
        let (refits_too, adjusts_too) = (refitted.is_ok(), adjusted.is_ok());
        table.row([score.candidate.id.clone(), row(refits_too, of_refit), row(adjusts_too, of_adjustment)]);
        refits.extend(refits_too.then_some(of_refit));
        adjustments.extend(adjusts_too.then_some(of_adjustment));
    }
    let two = |seconds: &[f64]| 2.0 * seconds.iter().sum::<f64>() / seconds.len() as f64;
    println!("{}", table.to_text());
    println!(
        "{BLOCK}, {} measurements, {threads} threads: screening {} candidates {all:.2} s, of which {of_scans:.2} s search places on the sensor; \
         two of their refits {:.2} s on average (ratio {:.2}), as the diagnosis makes them from the base solution; {:.2} s (ratio {:.2}) with both \
         solvers from the block's start values",
        block.ties.len(),
        screening.scores.len(),
        two(&refits),
        all / two(&refits),
        two(&adjustments),
        all / two(&adjustments),
    );
    Ok(())
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started = Instant::now();
    let value = work();
    (value, started.elapsed().as_secs_f64())
}
