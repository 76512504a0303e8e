//! The number of threads changes how long it takes, not what comes out.

use crate::common::{preset, solve_both_with};
use misclosure::adjust::ceres::Ceres;
use misclosure::adjust::native::Native;
use misclosure::adjust::{Options, Solution, Solver};
use misclosure::block::Block;
use misclosure::model::{Datum, Model};
use misclosure::problem::Problem;
use misclosure::scenario::add_noise;
use std::ops::ControlFlow;

/// Enough measurements for several chunks of work.
fn block() -> Block {
    let mut block = preset("dike", &[("points", 9000.0), ("check", 10.0)], 31).block;
    add_noise(&mut block, 0.3, 32).expect("noise");
    assert!(block.ties.len() > 3 * 16_384, "several chunks");
    block
}

fn solve(solver: &dyn Solver, block: &Block, threads: usize) -> Solution {
    let problem = Problem::new(block, &Model { datum: Datum::All, ..Model::default() }).expect("a problem");
    let options = Options { threads, ..Options::default() };
    solver.solve(&problem, &options, &mut |_| ControlFlow::Continue(())).expect("a solution")
}

/// Every bit of estimates, cost and covariance.
fn bits(solution: &Solution) -> Vec<u64> {
    let state = &solution.state;
    let covariance = solution.covariance.as_ref().expect("a covariance");
    let mut numbers: Vec<f64> = state.interiors.iter().flatten().copied().collect();
    for pose in &state.poses {
        numbers.extend(pose.rotation.coords.iter().chain(pose.centre.iter()));
    }
    numbers.extend(state.points.iter().flat_map(|point| point.iter().copied().collect::<Vec<_>>()));
    numbers.extend(covariance.shared.iter().copied());
    numbers.extend(covariance.poses.iter().flat_map(|block| block.iter().copied().collect::<Vec<_>>()));
    numbers.extend(covariance.points.iter().flat_map(|block| block.iter().copied().collect::<Vec<_>>()));
    numbers.push(solution.cost);
    numbers.into_iter().map(f64::to_bits).collect()
}

#[test]
fn native_gives_the_same_bits_on_any_number_of_threads() {
    let block = block();
    let one = solve(&Native, &block, 1);
    for threads in [2, 3] {
        let other = solve(&Native, &block, threads);
        assert_eq!(one.iterations, other.iterations);
        assert!(bits(&one) == bits(&other), "{threads} threads change bits");
    }
}

/// Ceres sums in the order in which its threads finish; on one thread the order is fixed, on several the rounding is not.
#[test]
fn ceres_repeats_itself_on_one_thread_and_agrees_on_several() {
    let block = block();
    let one = solve(&Ceres, &block, 1);
    assert!(bits(&one) == bits(&solve(&Ceres, &block, 1)), "one thread repeats its bits");
    let two = solve(&Ceres, &block, 2);
    let covariance = &one.covariance.as_ref().expect("a covariance").shared;
    for k in 0..12 {
        let difference = (one.state.interiors[0][k] - two.state.interiors[0][k]).abs() / covariance[(k, k)].sqrt();
        assert!(difference < misclosure::adjust::agreement::PARAMETER_SIGMA, "{difference:e} sigma");
    }
    assert!((one.cost / two.cost - 1.0).abs() < misclosure::adjust::agreement::COST_REL);
}

#[test]
fn both_solvers_agree_whatever_the_threads() {
    let block = block();
    for threads in [1, 3] {
        solve_both_with(&block, &Model::default(), &Options { threads, ..Options::default() });
    }
}
