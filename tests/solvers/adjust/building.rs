//! What both solvers share and therefore cannot prove by agreeing: reading the block into the problem, weights, order,
//! datum.

use crate::common::{preset, solve_both_with};
use misclosure::adjust::Options;
use misclosure::block::{Block, Gnss, Measurement, Role};
use misclosure::model::{Datum, Model, Prior, TieWeights};
use misclosure::problem::{MeasurementKind, PointSource, Problem, ProblemError};
use misclosure::run::Run;
use misclosure::scenario::{SurveyNoise, add_noise, add_survey_noise};
use nalgebra::Vector3;

/// A small noisy dike.
fn dike() -> Block {
    let mut block = preset("dike", &[("points", 1500.0), ("check", 20.0)], 5).block;
    add_noise(&mut block, 0.3, 6).expect("noise");
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, 7);
    block
}

fn datum(datum: Datum) -> Model {
    Model { datum, ..Model::default() }
}

/// Adjusts on one thread, where both solvers repeat their bits.
fn solve(block: &Block, model: &Model) -> Run {
    solve_both_with(block, model, &Options { threads: 1, ..Options::default() })
}

/// Every bit that each solver estimates.
fn bits(run: &Run) -> Vec<u64> {
    let mut numbers: Vec<f64> = Vec::new();
    for (_, solution) in &run.solutions {
        let state = &solution.state;
        numbers.extend(state.interiors.iter().flatten().chain(&state.theta));
        for pose in &state.poses {
            numbers.extend(pose.rotation.coords.iter().chain(pose.centre.iter()));
        }
        state.points.iter().for_each(|point| numbers.extend(point.iter()));
        numbers.push(solution.cost);
    }
    numbers.into_iter().map(f64::to_bits).collect()
}

#[test]
fn every_observation_is_counted_once() {
    let block = dike();
    let (ties, points, images) = (block.ties.len(), block.tie_points.len(), block.images.len());
    let control = block.count(Role::Control);
    let control_marks =
        block.marks.iter().filter(|mark| block.surveyed[mark.point.index()].role == Role::Control).count();
    assert!(control == 10 && control_marks > 30 && block.marks.len() > control_marks, "the block has both roles");
    let counts = |kind| Problem::new(&block, &datum(kind)).expect("a problem").redundancy();
    let (n, u) = (2 * ties, 12 + 6 * images + 3 * points);
    assert_eq!(counts(Datum::Free), (n, u, (n - u + 7) as i64));
    assert_eq!(counts(Datum::Gnss), (n + 3 * images, u, (n + 3 * images - u) as i64));
    let (n, u) = (n + 2 * control_marks + 3 * control, u + 3 * control);
    assert_eq!(counts(Datum::Control), (n, u, (n - u) as i64));
    assert_eq!(counts(Datum::All), (n + 3 * images, u, (n + 3 * images - u) as i64));
}

#[test]
fn points_stand_as_ties_then_control_with_their_own_measurements() {
    let block = dike();
    let problem = Problem::new(&block, &datum(Datum::All)).expect("a problem");
    let mut seen_control = false;
    let mut seen = 0;
    for (j, source) in problem.point_sources.iter().enumerate() {
        let rows = &problem.observations[problem.point_start[j]..problem.point_start[j + 1]];
        let (table, id, kind): (&[Measurement], _, _) = match source {
            PointSource::Tie(id) => (&block.ties, id, MeasurementKind::Tie),
            PointSource::Control(id) => (&block.marks, id, MeasurementKind::Mark),
        };
        seen_control |= kind == MeasurementKind::Mark;
        assert_eq!(seen_control, kind == MeasurementKind::Mark, "control points stand last");
        let mut expected: Vec<_> = table.iter().filter(|m| m.point == *id).map(|m| (m.image.0, m.x, m.y)).collect();
        let mut found: Vec<_> = rows.iter().map(|row| (row.image, row.x, row.y)).collect();
        expected.sort_by_key(|row| row.0);
        found.sort_by_key(|row| row.0);
        assert_eq!(found, expected);
        assert!(rows.iter().all(|row| row.kind == kind));
        seen += rows.len();
    }
    assert!(seen_control);
    assert_eq!(seen, problem.observations.len());
    // Each control coordinate stands by its own point.
    for observation in &problem.control {
        let PointSource::Control(id) = problem.point_sources[observation.index as usize] else { panic!("a tie point") };
        assert_eq!(observation.position, block.surveyed[id.index()].position);
    }
}

#[test]
fn a_row_s_own_sigma_goes_before_the_block_s() {
    let mut block = dike();
    let mark =
        block.marks.iter().position(|mark| block.surveyed[mark.point.index()].role == Role::Control).expect("a mark");
    block.ties[3].sigma = Some(0.9);
    block.marks[mark].sigma = Some(0.7);
    let surveyed = block.marks[mark].point.index();
    block.surveyed[surveyed].sigma_xy = Some(0.002);
    let gnss = block.images[4].gnss.expect("a position");
    block.images[4].gnss = Some(Gnss { sigma_xy: Some(0.5), sigma_z: None, ..gnss });
    block.images[5].gnss = Some(Gnss { sigma_xy: None, sigma_z: Some(0.6), ..gnss });
    (block.sigma.tie_px, block.sigma.mark_px, block.sigma.control_xy_m, block.sigma.control_z_m) =
        (0.31, 0.41, 0.011, 0.022);
    (block.sigma.gnss_xy_m, block.sigma.gnss_z_m) = (0.033, 0.044);
    let problem = Problem::new(&block, &datum(Datum::All)).expect("a problem");
    let row_sigma = |x: f64| 1.0 / problem.observations.iter().find(|row| row.x == x).expect("the row").inverse_sigma;
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-14, "{a} is not {b}");
    close(row_sigma(block.ties[3].x), 0.9);
    close(row_sigma(block.ties[9].x), 0.31);
    close(row_sigma(block.marks[mark].x), 0.7);
    close(row_sigma(block.marks[mark + 1].x), 0.41);
    let control_sigma = |k: usize| {
        let of = |o: &&misclosure::problem::PositionObservation| o.position == block.surveyed[k].position;
        problem.control.iter().find(of).expect("the control point").sigma
    };
    let other = (0..block.surveyed.len())
        .find(|k| *k != surveyed && block.surveyed[*k].role == Role::Control)
        .expect("another");
    assert_eq!(control_sigma(surveyed), Vector3::new(0.002, 0.002, 0.022));
    assert_eq!(control_sigma(other), Vector3::new(0.011, 0.011, 0.022));
    assert_eq!(problem.gnss[4].sigma, Vector3::new(0.5, 0.5, 0.044));
    assert_eq!(problem.gnss[5].sigma, Vector3::new(0.033, 0.033, 0.6));
    assert_eq!(problem.gnss[6].sigma, Vector3::new(0.033, 0.033, 0.044));
}

#[test]
fn tie_weights_grow_with_the_rays_as_named() {
    let block = dike();
    for (weights, weight) in [
        (TieWeights::Unit, (|_| 1.0) as fn(f64) -> f64),
        (TieWeights::Multi, |m| m * (m - 1.0)),
        (TieWeights::Pairs, |m| m * (m - 1.0) * (m - 1.0)),
    ] {
        let model = Model { tie_weights: weights, datum: Datum::Control, ..Model::default() };
        let problem = Problem::new(&block, &model).expect("a problem");
        let mut multiplicities = std::collections::BTreeSet::new();
        for (j, source) in problem.point_sources.iter().enumerate() {
            let rows = &problem.observations[problem.point_start[j]..problem.point_start[j + 1]];
            // Marks are measured one by one, whatever ties weigh.
            let expected = match source {
                PointSource::Tie(_) => weight(rows.len() as f64),
                PointSource::Control(_) => 1.0,
            };
            multiplicities.insert(rows.len());
            for row in rows {
                let found = (row.inverse_sigma * block.sigma.tie_px).powi(2);
                assert!((found / expected - 1.0).abs() < 1e-12, "{weights:?}: {found} for {} rays", rows.len());
            }
        }
        assert!(multiplicities.len() > 3, "{multiplicities:?}");
    }
}

#[test]
fn check_points_never_take_part_in_any_estimation() {
    let block = dike();
    let mut other = block.clone();
    for (k, point) in other.surveyed.iter_mut().enumerate().filter(|(_, point)| point.role == Role::Check) {
        point.position += Vector3::new(3.0, -2.0, 1.0 + k as f64);
        point.sigma_xy = Some(1e-9);
    }
    for mark in other.marks.iter_mut().filter(|mark| block.surveyed[mark.point.index()].role == Role::Check) {
        mark.x += 25.0;
    }
    let scaled = Model { effects: vec![crate::common::effect("map-scale")], ..datum(Datum::All) };
    for model in [datum(Datum::Free), datum(Datum::Control), datum(Datum::All), scaled] {
        let (a, b) = (solve(&block, &model), solve(&other, &model));
        assert!(bits(&a) == bits(&b), "{:?}", model.datum);
        let rms = |run: &Run| run.comparison.as_ref().and_then(|c| c.check).expect("check points").rms_m.xyz;
        assert!(rms(&b) > 10.0 * rms(&a), "the change shows where it should");
    }
}

#[test]
fn a_free_adjustment_knows_no_survey_and_no_gnss() {
    let block = dike();
    let mut other = block.clone();
    other.surveyed.iter_mut().for_each(|point| point.position *= 1.01);
    other.images.iter_mut().for_each(|image| image.gnss = None);
    let (a, b) = (solve(&block, &Model::default()), solve(&other, &Model::default()));
    assert!(bits(&a) == bits(&b));
}

/// Minimal constraints decide where the block is, not what it is like: with other ones (images in reverse order) camera
/// and cost stay.
#[test]
fn the_free_datum_does_not_shape_the_block() {
    let block = dike();
    let mut reversed = block.clone();
    let last = block.images.len() as u32 - 1;
    reversed.images.reverse();
    for row in reversed.ties.iter_mut().chain(&mut reversed.marks) {
        row.image.0 = last - row.image.0;
    }
    let (a, b) = (solve(&block, &Model::default()), solve(&reversed, &Model::default()));
    let held = |run: &Run| -> Vec<String> {
        let problem = &run.problem;
        let held = problem.pose_free.iter().enumerate().filter(|(_, free)| free.contains(&false));
        held.map(|(i, _)| problem.image_names[i].clone()).collect()
    };
    assert_eq!(a.problem.pose_free.iter().flatten().filter(|free| !**free).count(), 7);
    assert_eq!(b.problem.pose_free.iter().flatten().filter(|free| !**free).count(), 7);
    assert_ne!(held(&a), held(&b), "the constraints differ");
    assert!((a.chi_square() / b.chi_square() - 1.0).abs() < 1e-9);
    let covariance = &a.solution().covariance.as_ref().expect("a covariance").shared;
    let other = &b.solution().covariance.as_ref().expect("a covariance").shared;
    for k in 0..12 {
        let sigma = covariance[(k, k)].sqrt();
        let difference = a.solution().state.interiors[0][k] - b.solution().state.interiors[0][k];
        assert!(difference.abs() < 1e-3 * sigma, "{}: {difference}", misclosure::camera::PARAMETERS[k]);
        assert!((other[(k, k)].sqrt() / sigma - 1.0).abs() < 1e-4);
    }
    // And the survey sees the same block.
    let rms = |run: &Run| run.comparison.as_ref().and_then(|c| c.check).expect("check points").rms_m.xyz;
    assert!((rms(&a) / rms(&b) - 1.0).abs() < 1e-4, "{} and {}", rms(&a), rms(&b));
}

#[test]
fn the_order_of_rows_does_not_matter() {
    let block = dike();
    let mut shuffled = block.clone();
    shuffled.ties.reverse();
    shuffled.marks.reverse();
    shuffled.ties.sort_by_key(|row| row.image.0 % 7);
    let (a, b) = (solve(&block, &datum(Datum::All)), solve(&shuffled, &datum(Datum::All)));
    // Measurements of a point stand in the order of the images, so even the bits stay.
    assert!(bits(&a) == bits(&b));
}

#[test]
fn an_image_without_measurements_is_held_and_counts_for_nothing() {
    let block = dike();
    let mut with = block.clone();
    let mut idle = block.images[0].clone();
    idle.name = "idle".into();
    idle.gnss = Some(Gnss { position: Vector3::new(1.0, 2.0, 3.0), sigma_xy: None, sigma_z: None });
    with.images.push(idle.clone());
    for kind in [Datum::Free, Datum::Control, Datum::Gnss, Datum::All] {
        let (a, b) = (solve(&block, &datum(kind)), solve(&with, &datum(kind)));
        assert_eq!(a.problem.redundancy().2, b.problem.redundancy().2, "{kind:?}");
        assert!((a.chi_square() / b.chi_square() - 1.0).abs() < 1e-9, "{kind:?}");
        let held = b.solution().state.poses.last().expect("a pose");
        assert_eq!(held.centre, idle.pose.centre, "{kind:?}");
        assert!(held.rotation.angle_to(&idle.pose.rotation) < 1e-15, "{kind:?}");
    }
}

#[test]
fn derived_columns_are_what_they_say() {
    let mut block = dike();
    let times: Vec<f64> = block.images.iter().map(|image| image.time_s.expect("a time")).collect();
    let problem = Problem::new(&block, &Model::default()).expect("a problem");
    let n = times.len() as f64;
    let mean_time = times.iter().sum::<f64>() / n;
    let span = times.iter().fold(0.0f64, |a, t| a.max(*t)) - times.iter().fold(f64::INFINITY, |a, t| a.min(*t));
    let temperatures: Vec<f64> = block.images.iter().map(|image| image.temperature_c.expect("a temperature")).collect();
    let mean_temperature = temperatures.iter().sum::<f64>() / n;
    assert!((problem.block_context.mean_temperature_c - mean_temperature).abs() < 1e-10);
    for (i, context) in problem.image_contexts.iter().enumerate() {
        assert!((context.tau - (times[i] - mean_time) / span).abs() < 1e-12);
        assert!((context.tau_order - (i as f64 - 0.5 * (n - 1.0)) / (n - 1.0)).abs() < 1e-12);
        assert_eq!(Some(context.velocity), block.images[i].velocity, "the measured one");
    }
    // Without the columns, velocities are those of a smooth path through the positions: nearer to the flown ones than
    // differences of positions, which scatter by half a metre.
    let flown: Vec<_> = block.images.iter().map(|image| image.velocity.expect("a velocity")).collect();
    block.images.iter_mut().for_each(|image| image.velocity = None);
    let problem = Problem::new(&block, &Model::default()).expect("a problem");
    let flight: Vec<usize> = (0..block.images.len()).filter(|i| block.images[*i].flight.0 == 3).collect();
    assert!(flight.len() > 3);
    let (mut smooth, mut differences) = (0.0, 0.0);
    for window in flight.windows(3) {
        let [a, b, c] = [0, 1, 2].map(|k| &block.images[window[k]]);
        let difference = (c.pose.centre - a.pose.centre) / (c.time_s.expect("a time") - a.time_s.expect("a time"));
        differences += (difference - flown[window[1]]).norm_squared();
        smooth += (problem.image_contexts[window[1]].velocity - flown[window[1]]).norm_squared();
        assert!(b.velocity.is_none());
    }
    assert!(smooth < 0.25 * differences, "{smooth} for {differences}");
    // Without times there is nothing to derive them from, and nothing is invented.
    block.images.iter_mut().for_each(|image| image.time_s = None);
    let problem = Problem::new(&block, &Model::default()).expect("a problem");
    assert!(problem.image_contexts.iter().all(|context| context.velocity.x.is_nan() && context.tau.is_nan()));
}

#[test]
fn what_cannot_be_laid_out_is_refused_by_name() {
    let block = dike();
    let refused = |block: &Block, model: &Model| match Problem::new(block, model) {
        Ok(_) => panic!("laid out"),
        Err(error) => error.to_string(),
    };
    let mut bare = block.clone();
    bare.surveyed.clear();
    bare.marks.clear();
    let control = "datum `control` needs control points, and the block has none; use --datum free";
    assert_eq!(refused(&bare, &datum(Datum::Control)), control);
    bare.images.iter_mut().for_each(|image| image.gnss = None);
    assert!(refused(&bare, &datum(Datum::Gnss)).contains("needs GNSS positions"));
    assert!(refused(&bare, &datum(Datum::All)).contains("needs control points or GNSS positions"));
    let of = |camera: &str, name: &str| Model {
        camera_values: [(camera.to_string(), [(name.to_string(), 1.0)].into())].into(),
        ..Model::default()
    };
    assert!(refused(&block, &of("other", "f")).contains("camera `other`"));
    assert!(refused(&block, &of("cam", "k9")).contains("camera parameter `k9`"));
    let prior = Prior { camera: "cam".into(), parameter: "f".into(), value: 5500.0, sigma: 0.0 };
    assert!(refused(&block, &Model { priors: vec![prior], ..Model::default() }).contains("expected above 0"));
    let mut lone = block.clone();
    lone.ties.retain(|row| row.point.index() == 0 && row.image == block.ties[0].image);
    assert_eq!(Problem::new(&lone, &Model::default()).err(), Some(ProblemError::Empty));
    // Rays that diverge: a measurement mirrored to the other side of the sensor, without coordinates to start from.
    let mut apart = block.clone();
    apart.tie_points[0].position = None;
    let rows: Vec<usize> = (0..apart.ties.len()).filter(|row| apart.ties[*row].point.index() == 0).collect();
    for row in rows {
        let image = apart.ties[row].image.index();
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        if image == apart.ties[0].image.index() {
            apart.images[image].pose.rotation = turn * apart.images[image].pose.rotation;
        }
    }
    let Err(ProblemError::NoIntersection { points }) = Problem::new(&apart, &Model::default()) else {
        panic!("{}", refused(&apart, &Model::default()))
    };
    assert!(points.contains(&block.tie_points[0].name), "{points:?}");
}
