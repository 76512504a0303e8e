//! Weights that the residuals ask for, of a flight by itself and of all together.

use super::*;
use crate::adjust::{BUILT, Options};
use crate::block::Role;
use crate::diagnose::imprecise;
use crate::diagnose::run::{base, diagnose};
use crate::inject;
use crate::model::{Datum, FlightFactors};
use crate::run::adjust_from;
use crate::scenario::{Scenario, SurveyNoise, add_noise, add_survey_noise, simulate};
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// px.
const NOISE: f64 = 0.3;
const WORSE: &str = "nadir50";

/// A block whose flight `WORSE` is `times` as noisy as stated, in images and antenna positions.
fn block(times: f64) -> Block {
    let parameters = [("points".into(), 800.0)].into();
    let scenario = Scenario::preset("dike", &parameters).expect("a preset");
    let exact = simulate(&scenario, 1).expect("a block").block;
    let mut block = exact.clone();
    add_noise(&mut block, NOISE, 1).expect("noise");
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: true }, 1);
    let worse = block.flights.iter().position(|flight| flight == WORSE).expect("a flight");
    let is_worse = |image: usize| exact.images[image].flight.index() == worse;
    for (own, exact) in block.ties.iter_mut().zip(&exact.ties).filter(|(own, _)| is_worse(own.image.index())) {
        (own.x, own.y) = (exact.x + times * (own.x - exact.x), exact.y + times * (own.y - exact.y));
    }
    for (own, exact) in block.images.iter_mut().zip(&exact.images).filter(|(own, _)| own.flight.index() == worse) {
        let (own, exact) = (own.gnss.as_mut().expect("GNSS"), exact.gnss.as_ref().expect("GNSS"));
        own.position = exact.position + times * (own.position - exact.position);
    }
    block
}

/// A block of vertical images at one height, whose focal lengths and antenna heights vary by image.
fn vertical(focal_px: f64, times_height: f64) -> Block {
    vertical_of(1, focal_px, times_height)
}

fn vertical_of(seed: u64, focal_px: f64, times_height: f64) -> Block {
    let parameters = [("points".into(), 800.0)].into();
    let scenario = Scenario::preset("mapping", &parameters).expect("a preset");
    let exact = simulate(&scenario, seed).expect("a block").block;
    let hunting = inject::parse(&format!("focus-hunting:size={focal_px}")).expect("a cause");
    let mut block = inject::apply(&exact, &exact, &[hunting], seed).expect("a block").block;
    add_noise(&mut block, NOISE, seed).expect("noise");
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: true }, seed);
    for (own, exact) in block.images.iter_mut().zip(&exact.images) {
        let (own, exact) = (own.gnss.as_mut().expect("GNSS"), exact.gnss.as_ref().expect("GNSS"));
        own.position.z = exact.position.z + times_height * (own.position.z - exact.position.z);
    }
    block
}

#[test]
fn focal_lengths_that_vary_do_not_pass_for_imprecise_heights_nor_these_for_focal_lengths() {
    let settings = Settings {
        plugins: &[],
        options: Options { threads: 1, ..Options::default() },
        significance: 0.001,
        snoop: false,
        tell: &|_| {},
    };
    let model = Model { datum: Datum::All, ..Model::default() };
    let hunting = vertical(5.0, 1.0);
    // The same where images are half as precise as stated.
    let mut optimistic = hunting.clone();
    optimistic.sigma.tie_px = 0.5 * NOISE;
    optimistic.sigma.mark_px = 0.5 * NOISE;
    let diagnosed = diagnose(&hunting, &model, &settings).expect("a diagnosis");
    assert_eq!(diagnosed.diagnosis.recommended, ["focal-image"]);
    let factors = diagnosed.improvement.fit.model.sigma_factors;
    assert_eq!(factors.gnss_z, 1.0, "{factors:?}");
    // There both explain as much of this small block: one of them is named, never neither.
    let diagnosed = diagnose(&optimistic, &model, &settings).expect("a diagnosis");
    let factors = diagnosed.improvement.fit.model.sigma_factors;
    assert!(diagnosed.diagnosis.recommended == ["focal-image"] || factors.gnss_z > 1.2, "{factors:?}");
    let factors = |focal_px, times| based(&vertical(focal_px, times), false).model.sigma_factors;
    let imprecise = factors(0.0, 2.0);
    // The variance of some ninety heights is known to a sixth.
    assert!((imprecise.gnss_z / 2.0 - 1.0).abs() < 0.3, "{imprecise:?}");
}

fn based(block: &Block, by_flight: bool) -> Fit {
    let flights = block.flights.iter().filter(|_| by_flight);
    let flight_factors = flights.map(|flight| (flight.clone(), FlightFactors::default())).collect();
    let model = Model { datum: Datum::All, flight_factors, ..Model::default() };
    let options = Options { threads: 1, ..Options::default() };
    let settings = Settings { plugins: &[], options, significance: 0.001, snoop: false, tell: &|_| {} };
    let fit = base(block, &model, &settings).expect("a base").fit;
    let near = Some(fit.solved());
    let run = adjust_from(block, &fit.model, near, BUILT, &settings.options, &mut |_, _| ControlFlow::Continue(()));
    let run = run.expect("a run");
    assert!(BUILT.len() == 1 || run.agreement.expect("two solvers").agree);
    fit
}

#[test]
fn the_weights_of_a_flight_are_its_own_where_they_are_asked_for() {
    let times = 2.0;
    let block = block(times);
    let fit = based(&block, true);
    let factors = fit.model.sigma_factors;
    assert_eq!((factors.image, factors.gnss, factors.gnss_z), (1.0, 1.0, 1.0), "all is said by flight");
    for (flight, own) in &fit.model.flight_factors {
        let is = if flight == WORSE { times } else { 1.0 };
        // The least redundant flight has some sixty, of which a standard deviation is known to a tenth.
        assert!((own.image / is - 1.0).abs() < 0.1, "{flight}: {own:?}");
        // Of a few dozen positions no more than this is known.
        assert!((own.gnss / is - 1.0).abs() < 0.3 && (own.gnss_z / is - 1.0).abs() < 0.4, "{flight}: {own:?}");
    }
    let chi_square = fit.chi_square() / fit.problem.redundancy().2 as f64;
    // One standard deviation of 6000 degrees of freedom is 0.018.
    assert!((chi_square - 1.0).abs() < 0.03, "{chi_square}");

    let together = based(&block, false).model;
    assert!(together.flight_factors.is_empty() && together.sigma_factors.image > 1.2, "{together:?}");
}

#[test]
fn a_flight_far_less_precise_than_stated_is_named_with_its_worst_images() {
    let times = 6.0;
    let block = block(times);
    let fit = based(&block, true);
    let named = imprecise::beyond(&block, &fit, 1e-3).expect("predictions");
    let of = |group: &str| named.iter().find(|of| of.group == format!("{group} of flight {WORSE}")).expect("it");
    assert!(of("image measurements").factor > 5.0, "of images nothing is held back: {named:?}");
    for group in ["GNSS in plan", "GNSS in height", "image measurements"] {
        let of = of(group);
        assert!((of.factor / times - 1.0).abs() < 0.4 && of.worst.len() == 3, "{of:?}");
        assert!(of.worst.iter().all(|image| image.starts_with(WORSE)), "{of:?}");
    }
    assert_eq!(named.len(), 3, "{named:?}");
}

#[test]
fn control_points_far_less_precise_than_stated_are_named_the_worst_first() {
    let mut block = block(1.0);
    let sigma = block.sigma.control_xy_m;
    let control: Vec<usize> = (0..block.surveyed.len()).filter(|k| block.surveyed[*k].role == Role::Control).collect();
    for (number, k) in control.iter().enumerate() {
        // To all sides; the third of them is off by far the most.
        let off = sigma * if number == 2 { 60.0 } else { 8.0 };
        let (sin, cos) = (2.4 * number as f64).sin_cos();
        block.surveyed[*k].position += Vector3::new(off * cos, off * sin, 0.0);
    }
    let named = imprecise::beyond(&block, &based(&block, false), 1e-3).expect("predictions");
    assert_eq!(named.len(), 1, "{named:?}");
    assert_eq!((named[0].group.as_str(), named[0].worst.len()), ("control in plan", 3));
    // Nine by 8 and one by 60 standard deviations in two coordinates each: 14 in the mean of squares.
    assert!((named[0].factor / 14.4 - 1.0).abs() < 0.4, "{named:?}");
    assert_eq!(named[0].worst[0], block.surveyed[control[2]].name);
}

#[test]
fn marks_that_pull_their_images_are_known_to_be_imprecise_and_control_is_not_blamed() {
    let times = 10.0;
    for seed in [1, 2] {
        let mut block = vertical_of(seed, 0.0, 1.0);
        block.sigma.mark_px = NOISE / times;
        let fit = based(&block, false);
        let factors = fit.model.sigma_factors;
        // Some hundred marks, of which half of the coordinates are redundant.
        assert!((factors.mark / times - 1.0).abs() < 0.2 && (factors.image - 1.0).abs() < 0.1, "{seed}: {factors:?}");
        let survey = [factors.control, factors.control_z, factors.gnss, factors.gnss_z];
        assert_eq!(survey, [1.0; 4], "{seed}");
        let named = imprecise::beyond(&block, &fit, 1e-3).expect("predictions");
        let groups: Vec<&str> = named.iter().map(|of| of.group.as_str()).collect();
        assert_eq!(groups, ["marks of control points"], "{seed}");
    }

    // The survey's errors are none of the marks'.
    let mut block = vertical(0.0, 1.0);
    let control = block.surveyed.iter_mut().find(|own| own.role == Role::Control).expect("control");
    control.position.z += 40.0 * block.sigma.control_z_m;
    let factors = based(&block, false).model.sigma_factors;
    assert!(factors.mark < 1.3 && factors.control_z > 3.0, "{factors:?}");
}
