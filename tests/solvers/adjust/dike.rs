//! The study's block without noise: the truth comes back, from wrong start values.

use crate::common::{SOLVERS, effect, preset, solve_both, tie_rms_px};
use misclosure::adjust::Options;
use misclosure::model::{Datum, Model};
use misclosure::scenario::{Perturbation, Simulation, add_noise};
use std::ops::ControlFlow;

/// What must hold of an error-free block: the measurements agree to 1e-9 px, so a millionth is the solver's.
const CHECK_RMS_M: f64 = 1e-6;
const TIE_RMS_PX: f64 = 1e-6;

/// Focal length wrong by 0.5 %, poses by 0.1 m and 0.1 degree, no object points.
fn wrong_start(simulation: &mut Simulation) {
    let perturbation =
        Perturbation { focal_fraction: 0.005, position_m: 0.1, angle_rad: 0.1f64.to_radians(), points: true };
    simulation.perturb_start(perturbation, 7).expect("a perturbation");
}

fn truth_comes_back(datum: Datum) {
    let mut simulation = preset("dike", &[], 1);
    wrong_start(&mut simulation);
    let run = solve_both(&simulation.block, &Model { datum, ..Model::default() });
    let comparison = run.comparison.as_ref().expect("check points are compared");
    assert_eq!(comparison.failed.len(), 0);
    let check = comparison.check.as_ref().expect("statistics of check points");
    assert_eq!(check.n, 5000);
    assert!(check.rms_m.xyz < CHECK_RMS_M, "{datum:?}: check points {:e} m", check.rms_m.xyz);
    let rms = tie_rms_px(&simulation.block, &run);
    assert!(rms < TIE_RMS_PX, "{datum:?}: tie points {rms:e} px");
    // Every camera parameter, to a part of what moves a corner of the sensor by a thousandth of a pixel.
    for (found, camera) in run.solution().state.interiors.iter().zip(&simulation.truth.cameras) {
        for (k, scale) in camera.scales().iter().enumerate() {
            let error = (found[k] - camera.interior[k]) / scale;
            assert!(error.abs() < 1e-3, "{datum:?}: {}: {error:e}", misclosure::camera::PARAMETERS[k]);
        }
    }
}

#[test]
fn without_noise_the_truth_comes_back_in_the_free_datum() {
    truth_comes_back(Datum::Free);
}

#[test]
fn without_noise_the_truth_comes_back_with_control_and_gnss() {
    truth_comes_back(Datum::All);
}

/// The refits of a diagnosis start where the fit before ended, which puts images into another order along the block.
#[test]
fn a_problem_that_starts_where_another_ended_has_the_same_solution() {
    let mut simulation = preset("dike", &[("points", 2000.0), ("check", 0.0)], 3);
    add_noise(&mut simulation.block, 0.3, 3).expect("noise");
    // As far off as the images of neighbouring strips are apart along the block.
    let perturbation = Perturbation { position_m: 2.0, ..Perturbation::default() };
    simulation.perturb_start(perturbation, 7).expect("a perturbation");
    let run = solve_both(&simulation.block, &Model::default());
    let mut problem = run.problem.clone();
    problem.start = run.solution().state.clone();
    for solver in SOLVERS {
        let again = solver.solve(&problem, &Options::default(), &mut |_| ControlFlow::Continue(())).expect("converges");
        assert!(again.iterations <= 2, "{}: {} iterations from the solution", solver.name(), again.iterations);
        assert!((again.cost / run.solution().cost - 1.0).abs() < 1e-9, "{}: another minimum", solver.name());
    }
}

/// An unflat sensor and a high radial term beside a free centre of distortion: products of these count, so the valley
/// of the cost bends. With straight steps alone the native solver takes as many as Ceres, 96.
#[test]
fn a_valley_that_bends_is_followed() {
    let mut simulation = preset("dike", &[("points", 1500.0), ("check", 0.0)], 1);
    add_noise(&mut simulation.block, 0.3, 1).expect("noise");
    let model = Model { effects: vec![effect("unflatness"), effect("radial-high")], ..Model::default() };
    let run = solve_both(&simulation.block, &model);
    let steps = |name: &str| run.solutions.iter().find(|(solver, _)| *solver == name).expect("it solved").1.iterations;
    assert!(2 * steps("native") < steps("ceres"), "{} and {}", steps("native"), steps("ceres"));
}
