//! The one way in which tests solve: with every solver, which must agree.

#![allow(dead_code, reason = "every test program uses a part of it")]

use misclosure::adjust::agreement::{COST_REL, COVARIANCE_REL, JACOBIAN_REL, PARAMETER_SIGMA, RESIDUAL_PX};
#[cfg(feature = "ceres")]
use misclosure::adjust::ceres::Ceres;
use misclosure::adjust::native::Native;
use misclosure::adjust::{AdjustError, Options, Solver};
use misclosure::block::Block;
use misclosure::model::{EffectRef, EffectTerm, Model};
use misclosure::run::{self, Run};
use misclosure::scenario::{Scenario, Simulation, Terrain, simulate};
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Every solver of the program: of two the first is not the one that the program takes its results from.
#[cfg(feature = "ceres")]
pub const SOLVERS: [&dyn Solver; 2] = [&Ceres, &Native];
/// The one solver of the program.
#[cfg(not(feature = "ceres"))]
pub const SOLVERS: [&dyn Solver; 1] = [&Native];

/// Values of `--solver`.
pub const CHOICES: &[&str] = if cfg!(feature = "ceres") { &["both", "native", "ceres"] } else { &["native"] };

/// Set to a number of blocks (as `make test-null` does), it replaces that of tests of the distribution of p-values.
const NULL_BLOCKS: &str = "MISCLOSURE_NULL_BLOCKS";

/// Number of blocks without a cause, by seeds from 1: `usually`, or what the environment says.
pub fn null_blocks(usually: u64) -> u64 {
    let text = std::env::var(NULL_BLOCKS).unwrap_or_default();
    if text.is_empty() {
        return usually;
    }
    let blocks = text.parse().unwrap_or_else(|_| panic!("{NULL_BLOCKS}={text} is no number of blocks"));
    assert!(blocks >= usually, "{NULL_BLOCKS}={text}: fewer than {usually} blocks show nothing");
    blocks
}

/// A preset with some of its parameters given.
pub fn preset(name: &str, overrides: &[(&str, f64)], seed: u64) -> Simulation {
    let overrides: BTreeMap<String, f64> = overrides.iter().map(|(key, value)| (key.to_string(), *value)).collect();
    let scenario = Scenario::preset(name, &overrides).expect("a preset with its parameters");
    simulate(&scenario, seed).expect("a preset can be simulated")
}

/// Half of the preset `dike`: all its flights over 100 m, each with half of its images. An adjustment takes a quarter
/// of the time.
pub fn half_dike(points: f64, check: f64, seed: u64) -> Simulation {
    let overrides = [("points", points), ("check", check)].map(|(key, value)| (key.to_string(), value));
    let mut scenario = Scenario::preset("dike", &BTreeMap::from(overrides)).expect("a preset with its parameters");
    let Terrain::Dike { length_m, .. } = &mut scenario.terrain else { panic!("the terrain of a dike") };
    *length_m /= 2.0;
    let strips = scenario.flights.iter_mut().filter_map(|flight| flight.images.as_mut()).flatten();
    strips.for_each(|images| *images = images.div_ceil(2));
    simulate(&scenario, seed).expect("half a preset can be simulated")
}

/// An effect at its nominal values.
pub fn effect(id: &str) -> EffectTerm {
    let effect = misclosure::effects::find(id).unwrap_or_else(|| panic!("no effect {id}"));
    EffectTerm { effect: EffectRef::Builtin(effect), values: BTreeMap::new(), held: Vec::new() }
}

/// Adjusts with every solver from the same start; they must agree in everything that [`misclosure::adjust::agreement`]
/// compares.
pub fn solve_both(block: &Block, model: &Model) -> Run {
    solve_both_with(block, model, &Options::default())
}

/// [`solve_both`] with options.
pub fn solve_both_with(block: &Block, model: &Model, options: &Options) -> Run {
    try_both(block, model, options).unwrap_or_else(|text| panic!("block {}: {text}", block.name))
}

/// [`solve_both_with`], with what went wrong in words: an error of a solver, or the worst of each comparison.
pub fn try_both(block: &Block, model: &Model, options: &Options) -> Result<Run, String> {
    // Without any covariance the solutions could not be compared in units of their sigma.
    let covariance = options.covariance.max(misclosure::adjust::CovarianceOf::Shared);
    let options = &Options { covariance, ..options.clone() };
    let run = run::adjust(block, model, &SOLVERS, options, &mut |_, _| ControlFlow::Continue(()))
        .map_err(|error| error.to_string())?;
    disagreement(&run).map_or(Ok(run), Err)
}

/// The worst of each comparison, unless the solvers of a run agree.
pub fn disagreement(run: &Run) -> Option<String> {
    if let Some((name, error)) = run.failures.first() {
        return Some(format!("{name} found no solution, where another solver did: {error}"));
    }
    assert_eq!(run.solutions.len(), SOLVERS.len(), "every solver ran");
    assert!(run.solutions.iter().all(|(_, solution)| solution.converged), "a solution that has not converged");
    if SOLVERS.len() == 1 {
        return None;
    }
    let a = run.agreement.as_ref().expect("two solvers are compared");
    assert!(a.compared_measurements > 0, "nothing was compared");
    let text = format!(
        "the solvers disagree: residuals {:.3e} px (allowed {RESIDUAL_PX:e}); Jacobian {:.3e} in column {} (allowed \
         {JACOBIAN_REL:e}); parameters {:.3e} sigma at {} (allowed {PARAMETER_SIGMA:e}); cost {:.3e} (allowed \
         {COST_REL:e}); standard deviations {:.3e} (allowed {COVARIANCE_REL:e}); iterations {:?}",
        a.residual_max_px,
        a.jacobian_max_rel,
        a.worst_column,
        a.parameter_max_sigma,
        a.worst_unknown,
        a.cost_rel,
        a.covariance_max_rel,
        run.solutions.iter().map(|(name, solution)| (*name, solution.iterations)).collect::<Vec<_>>(),
    );
    // Not by `agree` alone: whoever writes that flag must not be the only one who reads the numbers.
    let within = a.residual_max_px < RESIDUAL_PX
        && a.jacobian_max_rel < JACOBIAN_REL
        && a.parameter_max_sigma < PARAMETER_SIGMA
        && a.cost_rel < COST_REL
        && a.covariance_max_rel < COVARIANCE_REL;
    assert_eq!(within, a.agree, "{text}");
    (!within).then_some(text)
}

/// What a run with each solver alone says of what cannot be adjusted.
pub fn errors_of_both(block: &Block, model: &Model) -> Vec<AdjustError> {
    let failed =
        |solver: &&'static dyn Solver| match run::adjust(block, model, &[*solver], &Options::default(), &mut |_, _| {
            ControlFlow::Continue(())
        }) {
            Ok(_) => panic!("{} solved what cannot be solved", solver.name()),
            Err(run::RunError::Adjust(error)) => error,
            Err(other) => panic!("{}: {other}", solver.name()),
        };
    SOLVERS.iter().map(failed).collect()
}

/// The native solver alone, where only the statistics of many seeds are asked for.
pub fn solve_native(block: &Block, model: &Model, options: &Options) -> Run {
    run::adjust(block, model, &[&Native], options, &mut |_, _| ControlFlow::Continue(()))
        .unwrap_or_else(|error| panic!("block {}: {error}", block.name))
}

/// RMS of tie residuals per coordinate, px.
pub fn tie_rms_px(block: &Block, run: &Run) -> f64 {
    let rms = run::tie_rms_px(block, &run.problem, &run.solution().state).expect("residuals");
    assert!(!rms.is_nan(), "no tie-point residuals");
    rms
}
