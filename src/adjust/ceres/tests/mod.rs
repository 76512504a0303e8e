//! The Ceres side alone: a small convergent block whose measurements follow the formula of the block format, written
//! here once more.

mod block;
mod covariance;
mod datum;
mod effects;
mod errors;
mod jacobian;
mod losses;
mod recovery;
mod threads;

use super::*;
use crate::problem::*;
use block::*;
use std::ops::ControlFlow;

fn options() -> Options {
    Options { threads: 2, ..Options::default() }
}

fn solve_with(problem: &Problem, options: &Options) -> Result<Solution, AdjustError> {
    Ceres.solve(problem, options, &mut |_| ControlFlow::Continue(()))
}

fn solve(problem: &Problem) -> Result<Solution, AdjustError> {
    solve_with(problem, &options())
}

/// The largest component of each direction that nothing fixes.
fn null_directions(problem: &Problem) -> Vec<String> {
    match solve(problem) {
        Err(AdjustError::Singular { solver: NAME, directions }) => {
            directions.into_iter().map(|direction| direction.components[0].0.clone()).collect()
        }
        other => panic!("{other:?}"),
    }
}
