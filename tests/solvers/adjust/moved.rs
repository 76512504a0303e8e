//! A block in national coordinates, with times since 1970: nothing that is found in it depends on where its zero is.

use crate::common::{effect, half_dike, preset, solve_both};
use misclosure::block::Block;
use misclosure::camera::PARAMETER_COUNT;
use misclosure::effects::{self, Role};
use misclosure::model::{Datum, Model};
use misclosure::run::Run;
use misclosure::scenario::{SurveyNoise, add_noise, add_survey_noise};
use nalgebra::{UnitQuaternion, Vector3};

/// Easting, northing and height of the zero, m.
const NATIONAL: [f64; 3] = [500_000.0, 5_000_000.0, 100.0];
/// Seconds from 1970 to the autumn of 2023.
const SINCE_1970: f64 = 1_700_000_000.0;
/// A northing is known to half a nanometre, a time since 1970 to a tenth of a microsecond; neither is a thousandth of
/// any sigma.
const ALLOWED_SIGMA: f64 = 1e-3;

/// The block as a surveyor has it, and as a command adjusts it.
fn moved(block: &Block) -> Block {
    let mut national = block.clone().about(-Vector3::from(NATIONAL));
    national.origin = Vector3::zeros();
    for image in &mut national.images {
        image.time_s = image.time_s.map(|time| time + SINCE_1970);
    }
    let reduced = national.about_its_centre();
    let largest = reduced.images.iter().map(|image| image.pose.centre.amax()).fold(0.0, f64::max);
    assert!(largest < 10_000.0, "{}: coordinates up to {largest} m", block.name);
    assert_ne!(reduced.origin, Vector3::zeros());
    reduced
}

fn noisy(mut block: Block) -> Block {
    let px = block.sigma.tie_px;
    add_noise(&mut block, px, 1).expect("noise");
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: true }, 1);
    block
}

/// Largest difference of a camera or effect parameter, in its standard deviations, with its name.
fn largest_difference(a: &Run, b: &Run) -> (f64, String) {
    let covariance = a.solution().covariance.as_ref().expect("a covariance");
    let mut largest = (0.0, String::new());
    for (k, unknown) in covariance.shared_unknowns.iter().enumerate() {
        let value = |run: &Run| {
            let state = &run.solution().state;
            let cameras = PARAMETER_COUNT * state.interiors.len();
            match *unknown {
                u if u < cameras => state.interiors[u / PARAMETER_COUNT][u % PARAMETER_COUNT],
                u => state.theta[u - cameras],
            }
        };
        let sigma = covariance.shared[(k, k)].sqrt();
        let difference = (value(a) - value(b)).abs() / sigma;
        if difference.is_nan() || difference > largest.0 {
            largest = (difference, a.problem.unknown_name(*unknown));
        }
    }
    largest
}

fn same_in_national_coordinates(block: &Block, model: &Model) {
    println!(
        "{} with {:?}",
        block.name,
        model.effects.iter().map(|term| &term.effect.descriptor().id).collect::<Vec<_>>()
    );
    let (here, there) = (solve_both(block, model), solve_both(&moved(block), model));
    let (difference, name) = largest_difference(&here, &there);
    assert!(difference < ALLOWED_SIGMA, "{}: {name} differs by {difference:.2e} sigma", block.name);
    let costs = [here.chi_square(), there.chi_square()];
    assert!((costs[0] / costs[1] - 1.0).abs() < 1e-6, "{}: {costs:?}", block.name);
}

#[test]
fn every_preset() {
    let few: &[(&str, f64)] = &[("points", 600.0)];
    for (name, parameters) in [("dike", few), ("corridor", few), ("mapping", few), ("closerange", &[])] {
        for datum in [Datum::Free, Datum::All] {
            same_in_national_coordinates(
                &noisy(preset(name, parameters, 1).block),
                &Model { datum, ..Model::default() },
            );
        }
    }
}

#[test]
fn every_effect() {
    let block = noisy(half_dike(400.0, 0.0, 1).block);
    for known in effects::catalogue() {
        let id = &known.descriptor().id;
        // Weak priors: some effects this block does not determine, and it is their numbers that are compared.
        let mut term = effect(id);
        // Places, widths and lags of what is not there have no minimum.
        let searched = known.descriptor().parameters.iter().filter(|p| matches!(p.role, Role::Searched(_)));
        term.held.extend(searched.map(|p| p.name.to_string()));
        term.values.insert(misclosure::model::PRIOR_KEY.to_string(), 3.0);
        let model = Model { datum: Datum::All, effects: vec![term], ..Model::default() };
        same_in_national_coordinates(&block, &model);
    }
}

/// Poses as another program leaves them: smaller, turned over or about the vertical, and somewhere else.
#[test]
fn poses_in_a_system_of_their_own_are_brought_into_that_of_control() {
    let block = noisy(preset("mapping", &[("points", 600.0)], 1).block);
    let model = Model { datum: Datum::Control, ..Model::default() };
    let there = solve_both(&block, &model);
    for turn in [Vector3::z() * 3.1, Vector3::x() * 2.9, Vector3::new(1.0, 1.0, 1.0) * 1.7] {
        let turn = UnitQuaternion::from_scaled_axis(turn);
        let move_into = |place: Vector3<f64>| 0.2 * (turn * place) + Vector3::new(40.0, -30.0, 5.0);
        let mut own = block.clone();
        for image in &mut own.images {
            image.pose.rotation *= turn.inverse();
            image.pose.centre = move_into(image.pose.centre);
        }
        for position in own.tie_points.iter_mut().filter_map(|point| point.position.as_mut()) {
            *position = move_into(*position);
        }
        let here = solve_both(&own, &model);
        let (difference, name) = largest_difference(&there, &here);
        assert!(difference < ALLOWED_SIGMA, "turned by {turn}: {name} by {difference:e} sigma");
    }
}
