//! What cannot be solved is an error that names its cause.

use super::*;
use crate::camera::{K1, PARAMETER_COUNT};
use std::sync::Arc;

#[test]
fn cancel_from_the_callback() {
    let (_, mut problem) = problem();
    disturb(&mut problem, 12);
    let mut calls = 0;
    let result = Ceres.solve(&problem, &options(), &mut |iteration| {
        assert_eq!(iteration.number, calls);
        calls += 1;
        if calls == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(result, Err(AdjustError::Cancelled { solver: "ceres" })), "{result:?}");
    assert_eq!(calls, 2);
}

#[test]
fn panic_in_the_callback_is_an_error() {
    let (_, problem) = problem();
    let error = Ceres.solve(&problem, &options(), &mut |_| panic!("out of patience")).unwrap_err();
    assert_eq!(error.to_string(), "ceres: the progress callback panicked: out of patience");
}

#[test]
fn iteration_limit_is_not_success() {
    let (_, mut problem) = problem();
    disturb(&mut problem, 12);
    let options = Options { max_iterations: 1, ..options() };
    let result = solve_with(&problem, &options);
    assert!(matches!(result, Err(AdjustError::NotConverged { iterations: 1, .. })), "{result:?}");
}

#[test]
fn wrong_arrays_are_named() {
    let wrong = |change: &dyn Fn(&mut Problem), message: &str| {
        let (_, mut problem) = problem();
        change(&mut problem);
        let error = Ceres.evaluate(&problem, &problem.start).unwrap_err().to_string();
        assert_eq!(error, format!("ceres: {message}"));
        assert_eq!(solve(&problem).unwrap_err().to_string(), error);
    };
    wrong(
        &|problem| Arc::make_mut(&mut problem.observations)[5].image = 77,
        "array `observation_image`: entry 5 is 77, expected less than 8",
    );
    wrong(
        &|problem| Arc::make_mut(&mut problem.observations)[5].x = f64::NAN,
        "array `observation_xy`: entry 10 is not finite",
    );
    wrong(
        &|problem| Arc::make_mut(&mut problem.observations)[5].inverse_sigma = 0.0,
        "array `observation_weight`: entry 5 is 0.000000, expected more than 0",
    );
    wrong(&|problem| Arc::make_mut(&mut problem.point_start)[1] = 1000, "array `point_start`: falls at entry 2");
    wrong(
        &|problem| Arc::make_mut(&mut problem.point_start)[POINTS] = 639,
        "array `point_start`: ends at 639, expected 640",
    );
    wrong(
        &|problem| problem.image_contexts[2].camera = 1,
        "array `contexts`: entry 2: camera is 1, expected less than 1",
    );
    wrong(
        &|problem| {
            let sigma = Vector3::repeat(0.01);
            problem.control.push(PositionObservation { index: 80, position: Vector3::zeros(), sigma });
        },
        "array `control_point`: entry 0 is 80, expected less than 80",
    );
    wrong(
        &|problem| {
            problem.camera_priors.push(CameraPrior {
                camera: 0,
                parameter: PARAMETER_COUNT as u32,
                value: 0.0,
                sigma: 1.0,
            });
        },
        "array `prior_parameter`: entry 0 is 12, expected less than 12",
    );
    wrong(
        &|problem| {
            add_effect(problem, builtin("focal-time"), &[0.0, 0.0]);
            problem.effects[0].slots[0].1 = 9;
        },
        "array `slot_base`: entry 0 needs 10 values of theta, there are 2",
    );
    wrong(
        &|problem| {
            problem.start.points.pop();
        },
        "array `point_start`: has 81 entries, expected 80",
    );
}

#[test]
fn point_behind_the_camera_is_named() {
    let (_, mut problem) = problem();
    problem.start.points[7].z = 100.0;
    let error = solve(&problem).unwrap_err();
    match &error {
        AdjustError::BadStart { image, point, reason } => {
            assert_eq!((image.as_deref(), point.as_deref()), (Some("img0"), Some("p7")));
            assert!(reason.starts_with("it lies behind the camera"), "{reason}");
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(Ceres.evaluate(&problem, &problem.start).unwrap_err().to_string(), error.to_string());
}

#[test]
fn zero_distortion_names_its_centre() {
    let mut interior = INTERIOR;
    interior[K1..].fill(0.0);
    for noise in [0.0, 0.03] {
        let (_, mut problem) = problem_with(interior);
        if noise > 0.0 {
            add_noise(&mut problem, noise, 13);
        }
        let mut names = null_directions(&problem);
        names.sort();
        assert_eq!(names, ["dcx", "dcy"], "noise {noise}");
    }
}

#[test]
fn a_point_on_one_ray_is_named() {
    let (_, mut problem) = problem();
    // Point 3 loses all rays but one.
    let (begin, end) = (problem.point_start[3] + 1, problem.point_start[4]);
    Arc::make_mut(&mut problem.observations).drain(begin..end);
    Arc::make_mut(&mut problem.point_start)[4..].iter_mut().for_each(|start| *start -= end - begin);
    let names = null_directions(&problem);
    assert!(names[0].starts_with("p3."), "{names:?}");
}
