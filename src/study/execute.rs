//! Carries one case out: simulate, put the errors in, adjust with the solvers, compare with the truth.

use super::blocks::Blocks;
use super::case::Case;
use super::outcome::Outcome;
use super::{flights, judge};
use crate::adjust::{AdjustError, CovarianceOf, Options, Solver};
use crate::block::Block;
use crate::inject::{self, Injection};
use crate::model::Model;
use crate::problem::{Problem, ProblemError};
use crate::run::{self, RunError};
use crate::scenario::{Scenario, Simulation, simulate};
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, OnceLock};

/// Seed of the random part of the errors; those of the study have none.
const ERROR_SEED: u64 = 1;

/// Blocks that several cases begin from, made once.
#[derive(Default)]
pub struct Simulations(Mutex<BTreeMap<String, Arc<Made>>>);

/// A block that is being made, or the reason why it cannot be.
type Made = OnceLock<Result<Arc<Simulation>, String>>;

impl Simulations {
    /// The error-free block of a case.
    ///
    /// # Errors
    /// What the scenario refuses.
    pub fn of(&self, case: &Case) -> Result<Arc<Simulation>> {
        let key = serde_json::to_string(&(&case.preset, &case.settings, case.seed))?;
        // A thread that panicked left no half-made entry: each is set at once.
        let mut map = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let entry = map.entry(key).or_default().clone();
        drop(map);
        let make = || -> Result<Arc<Simulation>> {
            Ok(Arc::new(simulate(&Scenario::preset(&case.preset, &case.settings)?, case.seed)?))
        };
        entry.get_or_init(|| make().map_err(|error| format!("{error:#}"))).clone().map_err(anyhow::Error::msg)
    }
}

/// Carries out a case with one or two solvers, each on `threads` threads.
///
/// # Errors
/// A case that cannot be set up, and failures that are no finding. That the measurements do not determine the unknowns,
/// or that nothing converges, is a finding: [`Outcome::Impossible`].
pub fn execute(case: &Case, simulations: &Simulations, solvers: &[&dyn Solver], threads: usize) -> Result<Outcome> {
    let simulation = simulations.of(case)?;
    let injections = case.errors.iter().map(|text| inject::parse(text)).collect::<Result<Vec<_>>>()?;
    let erroneous = part(case, measure(&simulation, injections.clone())?)?;
    let exact = |role: &str| -> Result<Block> {
        let exact_marks = inject::parse(&format!("exact-marks:role={role}"))?;
        part(case, measure(&simulation, [injections.clone(), vec![exact_marks]].concat())?)
    };
    let (exact_check, exact_all) = (exact("check")?, exact("both")?);
    let blocks = Blocks {
        truth: &simulation.truth,
        exact: &simulation.block,
        erroneous: &erroneous,
        exact_check: &exact_check,
        exact_all: &exact_all,
    };
    let model = case.model()?;
    let run = match adjust(&erroneous, &model, solvers, threads) {
        Ok(run) if run.failures.is_empty() => run,
        Ok(_) => return impossible(&erroneous, &model, solvers, threads),
        Err(error) if is_finding(&error) => return impossible(&erroneous, &model, solvers, threads),
        Err(error) => return Err(error).context("the case failed"),
    };
    judge::judge(case, &blocks, &run).map(|adjusted| Outcome::Adjusted(Box::new(adjusted)))
}

fn measure(simulation: &Simulation, injections: Vec<Injection>) -> Result<Block> {
    Ok(inject::apply(&simulation.block, &simulation.truth, &injections, ERROR_SEED)?.block)
}

fn part(case: &Case, block: Block) -> Result<Block> {
    if case.flights.is_empty() { Ok(block) } else { flights::only(&block, &case.flights) }
}

fn adjust(block: &Block, model: &Model, solvers: &[&dyn Solver], threads: usize) -> Result<run::Run, RunError> {
    let problem = Problem::new(block, model)?;
    // Poses and points need no covariance here: cameras and effects are what the tables show.
    let options = Options { threads, covariance: CovarianceOf::Shared, ..Options::default() };
    run::solve(block, problem, solvers, &options, &mut |_, _| ControlFlow::Continue(()))
}

/// A failure that says something about the block.
fn is_finding(error: &RunError) -> bool {
    matches!(
        error,
        RunError::Adjust(
            AdjustError::Singular { .. } | AdjustError::RaysDoNotMeet { .. } | AdjustError::NotConverged { .. }
        ) | RunError::Problem(ProblemError::Empty)
            | RunError::Similarity(_)
    )
}

/// What each solver says of a block that one of them could not adjust.
fn impossible(block: &Block, model: &Model, solvers: &[&dyn Solver], threads: usize) -> Result<Outcome> {
    let (mut reasons, mut agreed) = (Vec::new(), true);
    for solver in solvers {
        match adjust(block, model, &[*solver], threads) {
            Ok(_) => {
                agreed = false;
                reasons.push(format!("{}: adjusted", solver.name()));
            }
            Err(error) if is_finding(&error) => reasons.push(error.to_string()),
            Err(error) => return Err(error).context("the case failed"),
        }
    }
    reasons.dedup();
    Ok(Outcome::Impossible { reason: reasons.join("; "), agreed })
}
