//! Residuals against the block format, the Jacobian against differences.

use super::effects::turning;
use super::*;
use crate::camera;
use crate::effects::{Scope, Stage};

/// Central differences of residuals in their hundreds: steps that move image points by about 1e-3 px leave 1e-7.
const DERIVATIVE: f64 = 1e-6;

#[test]
fn residuals_follow_the_block_format() {
    let (truth, problem) = problem();
    let evaluation = Ceres.evaluate(&problem, &truth).unwrap();
    assert_eq!(evaluation.residuals.len(), problem.residual_count());
    for residual in &evaluation.residuals {
        assert!(residual.abs() < 1e-9 / SIGMA_PX, "{residual}");
    }
}

fn check_jacobian(problem: &Problem) {
    let layout = problem.layout();
    let evaluation = Ceres.evaluate(problem, &problem.start).unwrap();
    let jacobian = dense(problem, &evaluation);
    for window in 0..evaluation.residuals.len() {
        let row = &evaluation.columns[evaluation.row_start[window]..evaluation.row_start[window + 1]];
        assert!(row.windows(2).all(|pair| pair[0] < pair[1]), "ascending columns");
    }
    let free = problem.free();
    for unknown in 0..layout.total() {
        if !free[unknown] {
            assert_eq!(jacobian.column(unknown).norm(), 0.0, "{} is held", problem.unknown_name(unknown));
            continue;
        }
        let step = if let Some((c, k)) = layout.camera_parameter(unknown) {
            1e-3 * problem.camera_scales[c][k]
        } else if unknown < layout.pose(0, 0) {
            1e-5 * problem.theta[unknown - layout.theta(0)].scale
        } else {
            1e-5
        };
        let residuals = |by: f64| {
            let mut state = moved(problem, &problem.start, unknown, by);
            if problem.tie_dc_to_pp {
                state.interiors.iter_mut().for_each(camera::tie_centre);
            }
            Ceres.evaluate(problem, &state).unwrap().residuals
        };
        let (above, below) = (residuals(step), residuals(-step));
        let scale = jacobian.column(unknown).amax();
        for row in 0..evaluation.residuals.len() {
            let numeric = (above[row] - below[row]) / (2.0 * step);
            let difference = (numeric - jacobian[(row, unknown)]).abs();
            assert!(
                difference <= DERIVATIVE * scale.max(1e-3),
                "d residual {row} / d {}: {} instead of {numeric}",
                problem.unknown_name(unknown),
                jacobian[(row, unknown)]
            );
        }
    }
}

#[test]
fn jacobian_by_differences_with_every_kind_of_residual() {
    check_jacobian(&full_problem());
}

#[test]
fn jacobian_by_differences_where_the_row_follows() {
    let (_, mut problem) = problem();
    for (i, image) in problem.image_contexts.iter_mut().enumerate() {
        image.velocity = Vector3::new(5.0, -3.0 + i as f64, 0.5);
        image.angular_velocity = Vector3::new(0.2, -0.1, 0.1 * i as f64);
    }
    // Ten times as slow as any: from row to row the point moves by a tenth of a row.
    add_effect(&mut problem, builtin("rolling-shutter"), &[0.3, 0.1, -0.2, 0.05]);
    check_jacobian(&problem);
}

#[test]
fn jacobian_by_differences_with_tied_centre() {
    let mut problem = full_problem();
    tie_centre(&mut problem);
    check_jacobian(&problem);
}

#[test]
fn jacobian_by_differences_through_every_stage_twice() {
    let (_, mut problem) = problem();
    for (k, stage) in Stage::ALL.into_iter().chain(Stage::ALL).enumerate() {
        add_effect(&mut problem, turning(stage, Scope::Global), &[0.01 * (k + 1) as f64]);
    }
    observe_point(&mut problem, 7);
    observe_image(&mut problem, 3);
    check_jacobian(&problem);
}
