//! Without noise everything free comes back to the truth, and what is held stays.

use super::*;
use crate::camera::{self, DCX, DCY, PARAMETER_COUNT, PPX, PPY};

/// Noise-free problems come back to the truth up to the stopping rule: 1e-4 sigma.
pub(super) const RECOVERED_SIGMAS: f64 = 1e-4;

/// Every estimated number against the truth, in units of its own sigma.
pub(super) fn assert_recovered(problem: &Problem, truth: &State, solution: &Solution, sigmas: f64) {
    let layout = problem.layout();
    let covariance = solution.covariance.as_ref().expect("asked for");
    let compare = |name: String, found: f64, expected: f64, variance: f64| {
        let error = (found - expected).abs();
        let allowed = sigmas * variance.sqrt() + 1e-12 * expected.abs();
        assert!(error <= allowed, "{name}: {found} instead of {expected}, sigma {}", variance.sqrt());
    };
    for (row, &unknown) in covariance.shared_unknowns.iter().enumerate() {
        let value = |state: &State| match layout.camera_parameter(unknown) {
            Some((c, k)) => state.interiors[c][k],
            None => state.theta[unknown - layout.theta(0)],
        };
        compare(problem.unknown_name(unknown), value(&solution.state), value(truth), covariance.shared[(row, row)]);
    }
    for i in 0..layout.images {
        let turn = (solution.state.poses[i].rotation * truth.poses[i].rotation.inverse()).scaled_axis();
        let shift = solution.state.poses[i].centre - truth.poses[i].centre;
        for k in 0..3 {
            // Angles are known to 1e-15 rad at best.
            compare(format!("w{k} of {i}"), turn[k], 0.0, covariance.poses[i][(k, k)].max(1e-22));
            compare(format!("c{k} of {i}"), shift[k], 0.0, covariance.poses[i][(3 + k, 3 + k)].max(1e-22));
        }
    }
    for j in 0..layout.points {
        for k in 0..3 {
            let difference = solution.state.points[j][k] - truth.points[j][k];
            compare(format!("point {j}"), difference, 0.0, covariance.points[j][(k, k)]);
        }
    }
}

#[test]
fn noise_free_everything_free() {
    let (truth, mut problem) = problem();
    disturb(&mut problem, 3);
    for linear_solver in [LinearSolver::Auto, LinearSolver::Dense, LinearSolver::Sparse, LinearSolver::Iterative] {
        let options = Options { linear_solver, ..options() };
        let solution = solve_with(&problem, &options).unwrap();
        // Nothing is left but what the stopping rule allows; the inexact steps of the iterative solver use some of
        // that.
        assert!(
            solution.converged && solution.cost < 0.5 * options.chi_square_change,
            "{linear_solver:?}: {}",
            solution.cost
        );
        assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
    }
}

#[test]
fn fixed_subsets_stay_to_the_last_bit() {
    for (name, indices) in crate::camera::GROUPS {
        let (truth, mut problem) = problem();
        for &k in indices {
            problem.camera_free[0][k] = false;
        }
        disturb(&mut problem, 4);
        let solution = solve(&problem).unwrap();
        for &k in indices {
            assert_eq!(solution.state.interiors[0][k], truth.interiors[0][k], "{name}");
        }
        assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
    }
}

#[test]
fn nothing_of_the_camera_free() {
    let (truth, mut problem) = problem();
    problem.camera_free[0] = [false; PARAMETER_COUNT];
    disturb(&mut problem, 4);
    let solution = solve(&problem).unwrap();
    assert_eq!(solution.state.interiors, truth.interiors);
    assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
}

#[test]
fn poses_held_leave_an_intersection() {
    let (truth, mut problem) = problem();
    problem.camera_free[0] = [false; PARAMETER_COUNT];
    problem.pose_free = vec![[false; 6]; IMAGES];
    disturb(&mut problem, 5);
    let solution = solve(&problem).unwrap();
    assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
}

#[test]
fn one_angle_held() {
    let (truth, mut problem) = problem();
    problem.pose_free[3][1] = false;
    // From a start that differs by turns about the other two axes, that angle is not quite held at the truth's: start
    // at the truth.
    add_noise(&mut problem, 0.5, 9);
    let solution = solve(&problem).unwrap();
    let turn = (solution.state.poses[3].rotation * truth.poses[3].rotation.inverse()).scaled_axis();
    assert!(turn.y.abs() < 1e-3 * turn.norm(), "{turn}");
    assert_eq!(solution.covariance.unwrap().poses[3].column(1).norm(), 0.0);
}

#[test]
fn centre_of_distortion_tied_to_the_principal_point() {
    let mut interior = INTERIOR;
    camera::tie_centre(&mut interior);
    let (truth, mut problem) = problem_with(interior);
    tie_centre(&mut problem);
    disturb(&mut problem, 6);
    let solution = solve(&problem).unwrap();
    let found = solution.state.interiors[0];
    assert_eq!((found[DCX], found[DCY]), (found[PPX], found[PPY]));
    assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
}
