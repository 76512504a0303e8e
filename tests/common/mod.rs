//! The one way in which tests solve: with every solver, which must agree.

#![allow(dead_code, reason = "every test program uses a part of it")]

use misclosure::adjust::agreement::{COST_REL, COVARIANCE_REL, JACOBIAN_REL, PARAMETER_SIGMA, RESIDUAL_PX};
use misclosure::adjust::native::Native;
use misclosure::adjust::{AdjustError, Options, Solution, Solver};
use misclosure::block::Block;
use misclosure::model::{EffectRef, EffectTerm, Model};
use misclosure::problem::Problem;
use misclosure::run::{self, Run};
use misclosure::scenario::{Scenario, Simulation, simulate};
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Every solver of the program.
pub const SOLVERS: [&dyn Solver; 2] = [&Native, &misclosure::adjust::ceres::Ceres];

/// A preset with some of its parameters given.
pub fn preset(name: &str, overrides: &[(&str, f64)], seed: u64) -> Simulation {
    let overrides: BTreeMap<String, f64> = overrides.iter().map(|(key, value)| (key.to_string(), *value)).collect();
    let scenario = Scenario::preset(name, &overrides).expect("a preset with its parameters");
    simulate(&scenario, seed).expect("a preset can be simulated")
}

/// An effect at its nominal values.
pub fn effect(id: &str) -> EffectTerm {
    let effect = misclosure::effects::find(id).unwrap_or_else(|| panic!("no effect {id}"));
    EffectTerm { effect: EffectRef::Builtin(effect), values: BTreeMap::new(), held: Vec::new() }
}

/// Adjusts with every solver from the same start; they must agree in everything that [`misclosure::adjust::agreement`] compares.
pub fn solve_both(block: &Block, model: &Model) -> Run {
    solve_both_with(block, model, &Options::default())
}

/// [`solve_both`] with options.
pub fn solve_both_with(block: &Block, model: &Model, options: &Options) -> Run {
    let run = run::adjust(block, model, &SOLVERS, options, &mut |_, _| ControlFlow::Continue(()))
        .unwrap_or_else(|error| panic!("block {}: {error}", block.name));
    assert_agreement(&run, &block.name);
    run
}

/// Fails with the worst of each comparison unless the solvers of a run agree.
pub fn assert_agreement(run: &Run, what: &str) {
    for (name, solution) in &run.solutions {
        assert!(solution.converged, "{what}: {name} did not converge");
    }
    assert_eq!(run.solutions.len(), SOLVERS.len(), "{what}: every solver ran");
    let Some(a) = &run.agreement else {
        assert_eq!(SOLVERS.len(), 1, "{what}: two solvers ran and were not compared");
        return;
    };
    assert!(a.compared_measurements > 0, "{what}: nothing was compared");
    assert!(
        a.agree,
        "{what}: the solvers disagree: residuals {:.3e} px (allowed {RESIDUAL_PX:e}); Jacobian {:.3e} in column {} (allowed \
         {JACOBIAN_REL:e}); parameters {:.3e} sigma at {} (allowed {PARAMETER_SIGMA:e}); cost {:.3e} (allowed {COST_REL:e}); \
         standard deviations {:.3e} (allowed {COVARIANCE_REL:e})",
        a.residual_max_px,
        a.jacobian_max_rel,
        a.worst_column,
        a.parameter_max_sigma,
        a.worst_unknown,
        a.cost_rel,
        a.covariance_max_rel,
    );
}

/// What each solver says of a problem that cannot be solved.
pub fn errors_of_both(block: &Block, model: &Model) -> Vec<AdjustError> {
    let problem = Problem::new(block, model).expect("a problem");
    let solve = |solver: &&dyn Solver| -> Result<Solution, AdjustError> {
        solver.solve(&problem, &Options::default(), &mut |_| ControlFlow::Continue(()))
    };
    let failed = |solver: &&dyn Solver| match solve(solver) {
        Ok(_) => panic!("{} solved what cannot be solved", solver.name()),
        Err(error) => error,
    };
    SOLVERS.iter().map(failed).collect()
}

/// The native solver alone, where only the statistics of many seeds are asked for.
pub fn solve_native(block: &Block, model: &Model, options: &Options) -> Run {
    run::adjust(block, model, &[&Native], options, &mut |_, _| ControlFlow::Continue(()))
        .unwrap_or_else(|error| panic!("block {}: {error}", block.name))
}

/// Root mean square of the coordinates of tie-point residuals, px.
pub fn tie_rms_px(block: &Block, run: &Run) -> f64 {
    let rows =
        run::residual_rows(block, &run.problem, &run.solution().state, run.comparison.as_ref()).expect("residuals");
    let ties = rows.iter().filter(|row| row.kind == run::ResidualKind::Tie);
    let (sum, n) =
        ties.fold((0.0, 0usize), |(sum, n), row| (sum + row.residual[0].powi(2) + row.residual[1].powi(2), n + 2));
    assert!(n > 0, "no tie-point residuals");
    (sum / n as f64).sqrt()
}
