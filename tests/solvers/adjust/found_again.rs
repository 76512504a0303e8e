//! The contract from end to end: what was simulated is estimated.

use crate::common::{effect, preset, solve_both};
use misclosure::inject;
use misclosure::model::{Datum, Model};
use misclosure::scenario::{SurveyNoise, add_noise, add_survey_noise};

/// A cause is simulated by its own formula, its effect is estimated with everything else, and each parameter comes back
/// within its covariance.
fn found_again(cause: &str, id: &str, start: &[(&str, f64)], expected: &[(&str, f64)]) {
    let simulation = preset("dike", &[("points", 3000.0), ("check", 20.0)], 21);
    let injection = inject::parse(cause).unwrap_or_else(|error| panic!("{cause}: {error}"));
    let mut block = inject::apply(&simulation.block, &simulation.truth, &[injection], 22).expect("an injection").block;
    add_noise(&mut block, 0.3, 23).expect("noise");
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, 24);
    let plain = Model { datum: Datum::All, ..Model::default() };
    let without = solve_both(&block, &plain);
    let mut term = effect(id);
    term.values = start.iter().map(|(name, value)| (name.to_string(), *value)).collect();
    let with = solve_both(&block, &Model { effects: vec![term], ..plain });
    // A drop of chi-square by 100 for a handful of parameters is ten sigma.
    let drop = without.chi_square() - with.chi_square();
    assert!(drop > 100.0, "{cause}: chi-square drops by {drop}");
    assert!((with.sigma0() - 1.0).abs() < 0.03, "{cause} is explained: sigma0 {}", with.sigma0());
    let covariance = with.solution().covariance.as_ref().expect("a covariance");
    for (name, expected) in expected {
        let name = format!("{id}.{name}");
        let t = with.problem.theta.iter().position(|entry| entry.name == name).expect("the parameter");
        let (value, sigma) = (with.solution().state.theta[t], covariance.theta_variances[t].sqrt());
        assert!(sigma > 0.0 && sigma < 0.1 * expected.abs().max(1.0), "{name}: sigma {sigma}");
        // Five sigma: a false alarm in two million.
        assert!((value - expected).abs() < 5.0 * sigma, "{name} = {value} +- {sigma}, expected {expected}");
    }
}

#[test]
fn a_growing_focal_length_is_found_by_focal_time() {
    // f (1 + b)^n over the 113 images, in the order of the table.
    let expected = 5510.09 * ((1.0f64 + 2e-5).powi(112) - 1.0);
    found_again("focal-growth:b=2e-5", "focal-time", &[("against", 1.0)], &[("a", expected)]);
}

#[test]
fn a_lever_arm_is_found_by_gnss_lever_arm() {
    found_again(
        "gnss-lever-arm:x=0.05,y=0.12,z=-0.2",
        "gnss-lever-arm",
        &[],
        &[("lx", 0.05), ("ly", 0.12), ("lz", -0.2)],
    );
}

#[test]
fn a_flaw_of_the_sensor_is_found_by_local_flaw() {
    let cause = "local-flaw:centre_x=1500,centre_y=1200,lambda=10,sigma=400,smooth=1";
    let start = [("lambda", 6.0), ("centre_x", 1450.0), ("centre_y", 1260.0), ("sigma", 330.0), ("smooth", 1.0)];
    // The cause moves what the lens made, the effect what the camera model gives: the same place on the sensor.
    let expected = [("lambda", 10.0), ("centre_x", 1500.0), ("centre_y", 1200.0), ("sigma", 400.0)];
    found_again(cause, "local-flaw", &start, &expected);
}
