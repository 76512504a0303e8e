//! Is there a distortion that a centre of distortion could be the centre of?
//!
//! At exactly zero distortion the columns of `dcx, dcy` vanish and the solvers see it. With noise the estimated
//! coefficients are not quite zero: the normal matrix is regular, and the centre is a number made of noise. So the
//! coefficients are tested jointly, at the estimated centre: where they are not significant the centre is not
//! determined either.

use super::Progress;
use crate::adjust::{AdjustError, CovarianceOf, Iteration, NullDirection, Options, Solution, Solver};
use crate::camera::{DCX, K1, PARAMETER_COUNT};
use crate::math::statistics::chi_square_ln_sf;
use crate::problem::Problem;
use nalgebra::DMatrix;
use std::ops::ControlFlow;

/// Positions of `dcx, dcy` and of the distortion's coefficients among the parameters of a camera.
const CENTRE: std::ops::Range<usize> = DCX..K1;
const COEFFICIENTS: std::ops::Range<usize> = K1..PARAMETER_COUNT;

/// Chance that no distortion looks like one. Far below any usual significance, as a lens with a distortion has a
/// statistic of thousands, and as the centre has been chosen to make it large.
const SIGNIFICANCE: f64 = 1e-9;

/// Errors: [`AdjustError::Singular`] that names the free centres of cameras without a significant distortion.
pub fn check(problem: &Problem, solver: &'static str, solution: &Solution) -> Result<(), AdjustError> {
    refuse(undetermined(problem, problem, solution), solver)
}

fn refuse(directions: Vec<NullDirection>, solver: &'static str) -> Result<(), AdjustError> {
    if directions.is_empty() { Ok(()) } else { Err(AdjustError::Singular { solver, directions }) }
}

/// A solver that does not converge may be in search of such a centre: with the centres held it tells.
pub fn explain(
    failure: AdjustError,
    problem: &Problem,
    solver: &dyn Solver,
    options: &Options,
    progress: &mut Progress<'_>,
) -> AdjustError {
    let AdjustError::NotConverged { .. } = failure else { return failure };
    let Some(held) = with_centres_held(problem) else { return failure };
    let options = Options { covariance: CovarianceOf::Shared, ..options.clone() };
    let name = solver.name();
    match solver.solve(&held, &options, &mut |iteration| progress(name, iteration)) {
        Ok(solution) => refuse(undetermined(problem, &held, &solution), name).err().unwrap_or(failure),
        Err(cancelled @ AdjustError::Cancelled { .. }) => cancelled,
        Err(_) => failure,
    }
}

/// Is it a centre of distortion that makes `problem` singular: is the problem regular where the centres are held?
pub fn makes_singular(problem: &Problem, solver: &dyn Solver, options: &Options) -> bool {
    let go_on = &mut |_: &Iteration| ControlFlow::Continue(());
    with_centres_held(problem).is_some_and(|held| solver.solve(&held, options, go_on).is_ok())
}

/// `None` where no centre is free.
fn with_centres_held(problem: &Problem) -> Option<Problem> {
    let is_free = problem.camera_free.iter().any(|free| free[CENTRE].contains(&true));
    is_free.then(|| {
        let mut held = problem.clone();
        held.camera_free.iter_mut().for_each(|free| free[CENTRE].fill(false));
        held
    })
}

/// The free centres of `problem` whose distortion is not significant in a solution of `solved`.
fn undetermined(problem: &Problem, solved: &Problem, solution: &Solution) -> Vec<NullDirection> {
    let (_, _, redundancy) = solved.redundancy();
    let variance = (2.0 * solution.cost / redundancy.max(1) as f64).max(1.0);
    let mut directions = Vec::new();
    for (c, free) in problem.camera_free.iter().enumerate() {
        let interior = &solution.state.interiors[c];
        // A coefficient that is held at a value is a distortion that is known.
        let known = COEFFICIENTS.clone().any(|k| !free[k] && interior[k] != 0.0);
        if known || !free[CENTRE].contains(&true) {
            continue;
        }
        let Some((statistic, count)) = statistic(solved, solution, c) else { continue };
        if chi_square_ln_sf(statistic / variance, (count + CENTRE.len()) as f64) > SIGNIFICANCE.ln() {
            let name = |k: usize| problem.unknown_name(problem.layout().camera(c, k));
            let free = CENTRE.clone().filter(|k| free[*k]);
            directions.extend(free.map(|k| NullDirection { components: vec![(name(k), 1.0)] }));
        }
    }
    directions
}

/// `x' N x` of the free coefficients of camera `c` at its estimated centre (all other unknowns eliminated), and their
/// number; `None` without a covariance or without free coefficients.
fn statistic(problem: &Problem, solution: &Solution, c: usize) -> Option<(f64, usize)> {
    let covariance = solution.covariance.as_ref()?;
    let positions = |range: std::ops::Range<usize>| -> Vec<(usize, usize)> {
        let position = |k: usize| {
            let unknown = problem.layout().camera(c, k);
            covariance.shared_unknowns.iter().position(|u| *u == unknown).map(|row| (k, row))
        };
        range.filter_map(position).collect()
    };
    let coefficients = positions(COEFFICIENTS);
    let count = coefficients.len();
    let members: Vec<(usize, usize)> = coefficients.into_iter().chain(positions(CENTRE)).collect();
    if count == 0 {
        return None;
    }
    let sigma = |row: usize| covariance.shared[(row, row)].sqrt();
    let unit = DMatrix::from_fn(members.len(), members.len(), |i, j| {
        covariance.shared[(members[i].1, members[j].1)] / (sigma(members[i].1) * sigma(members[j].1))
    });
    // The inverse of the whole, then its part of the coefficients: the information at a fixed centre.
    let information = unit.cholesky()?.inverse();
    let x = |i: usize| solution.state.interiors[c][members[i].0] / sigma(members[i].1);
    let sum = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
    Some((sum.map(|(i, j)| x(i) * information[(i, j)] * x(j)).sum(), count))
}
