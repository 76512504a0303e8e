//! What the measurements do not determine is named by every solver; nothing crashes and nothing is made up.

use crate::common::{SOLVERS, errors_of_both, preset, solve_both};
use misclosure::adjust::AdjustError;
use misclosure::block::{Block, Role};
use misclosure::camera::parameter_indices;
use misclosure::model::{Datum, Model};
use misclosure::scenario::{Scenario, add_noise, simulate};
use std::collections::BTreeMap;

/// A dike taken with a camera of the given distortion coefficients (all others zero).
fn dike(distortion: &[(&str, f64)], noise_px: f64) -> Block {
    dike_of(4, distortion, noise_px)
}

fn dike_of(seed: u64, distortion: &[(&str, f64)], noise_px: f64) -> Block {
    let overrides = BTreeMap::from([("points".to_string(), 1500.0), ("check".to_string(), 0.0)]);
    let mut scenario = Scenario::preset("dike", &overrides).expect("a preset");
    let camera = &mut scenario.cameras[0];
    (camera.k1, camera.k2, camera.k3, camera.p1, camera.p2, camera.b1, camera.b2) = Default::default();
    for (name, value) in distortion {
        match *name {
            "k1" => camera.k1 = *value,
            "k2" => camera.k2 = *value,
            other => panic!("no use for {other}"),
        }
    }
    let mut block = simulate(&scenario, 3).expect("a block").block;
    add_noise(&mut block, noise_px, seed).expect("noise");
    block
}

fn holding(names: &[&str]) -> Model {
    let mut model = Model::default();
    for k in names.iter().flat_map(|name| parameter_indices(name).expect("a parameter")) {
        model.free[k] = false;
    }
    model
}

/// The names of the null directions that each solver reports.
fn null_spaces(block: &Block, model: &Model) -> Vec<Vec<Vec<String>>> {
    errors_of_both(block, model)
        .into_iter()
        .map(|error| match error {
            AdjustError::Singular { directions, .. } => directions
                .into_iter()
                .map(|direction| direction.components.into_iter().map(|(name, _)| name).collect())
                .collect(),
            other => panic!("not a null space: {other}"),
        })
        .collect()
}

#[test]
fn zero_distortion_with_everything_free_names_the_centre_of_distortion() {
    let spaces = null_spaces(&dike(&[], 0.0), &Model::default());
    assert_eq!(spaces.len(), SOLVERS.len());
    for space in spaces {
        assert_eq!(space.len(), 2, "two directions: {space:?}");
        let names: std::collections::BTreeSet<&str> = space.iter().flatten().map(String::as_str).collect();
        assert_eq!(names, ["dcx", "dcy"].into(), "{space:?}");
    }
}

#[test]
fn the_centre_of_distortion_and_decentring_are_the_same_with_k1_alone() {
    let block = dike(&[("k1", 1.5e-9)], 0.0);
    for space in null_spaces(&block, &holding(&["k2", "k3"])) {
        assert_eq!(space.len(), 2, "two directions: {space:?}");
        // By their plausible ranges: the centre may be anywhere on the sensor, which p1 and p2 follow by a small part of theirs.
        let names: std::collections::BTreeSet<&str> = space.iter().flatten().map(String::as_str).collect();
        assert_eq!(names, ["dcx", "dcy"].into(), "{space:?}");
    }
    // Either half alone is determined.
    solve_both(&block, &holding(&["k2", "k3", "decentring"]));
    solve_both(&block, &holding(&["k2", "k3", "dc"]));
}

#[test]
fn zero_distortion_is_adjusted_where_the_centre_is_held_or_tied() {
    for noise in [0.0, 0.3] {
        let block = dike(&[], noise);
        solve_both(&block, &holding(&["dc"]));
        solve_both(&block, &Model { tie_dc_to_pp: true, ..Model::default() });
    }
}

/// With noise the distortion that is estimated is not quite zero, and its centre is made of noise: a run refuses it by name.
#[test]
fn zero_distortion_with_noise_names_the_centre_of_distortion() {
    for seed in 0..3 {
        for space in null_spaces(&dike_of(seed, &[], 0.3), &Model::default()) {
            assert_eq!(space, [["dcx"], ["dcy"]]);
        }
    }
    // A weak lens, some pixels at the corner, has a centre.
    solve_both(&dike_of(0, &[("k1", 1e-10)], 0.3), &Model::default());
}

#[test]
fn two_halves_without_common_points_are_refused() {
    let mut block = preset("corridor", &[("length_m", 200.0), ("points", 800.0), ("check", 0.0)], 3).block;
    let middle = |row: &misclosure::block::Measurement| {
        (
            block.images[row.image.index()].pose.centre.y > 0.0,
            block.tie_points[row.point.index()].position.expect("a position").y > 0.0,
        )
    };
    let kept: Vec<_> = block
        .ties
        .iter()
        .filter(|row| {
            let (image, point) = middle(row);
            image == point
        })
        .copied()
        .collect();
    block.ties = kept;
    for error in errors_of_both(&block, &Model::default()) {
        assert!(matches!(error, AdjustError::Singular { .. }), "{error}");
    }
    // With GNSS each half stands on its own.
    solve_both(&block, &Model { datum: Datum::Gnss, ..Model::default() });
}

#[test]
fn two_control_points_leave_a_rotation() {
    let mut block = dike(&[("k1", 1.5e-9), ("k2", -4.5e-17)], 0.3);
    let kept: Vec<usize> =
        (0..block.surveyed.len()).filter(|k| block.surveyed[*k].role == Role::Control).take(2).collect();
    block.marks.retain(|mark| kept.contains(&mark.point.index()));
    block
        .surveyed
        .iter_mut()
        .enumerate()
        .filter(|(k, _)| !kept.contains(k))
        .for_each(|(_, point)| point.role = Role::Check);
    for error in errors_of_both(&block, &Model { datum: Datum::Control, ..Model::default() }) {
        assert!(matches!(error, AdjustError::Singular { .. }), "{error}");
        assert!(error.to_string().contains("do not determine"), "{error}");
    }
}

#[test]
fn an_image_with_too_few_measurements_is_named_and_takes_no_part() {
    let mut block = dike(&[("k1", 1.5e-9), ("k2", -4.5e-17)], 0.3);
    let image = 20;
    let mut left = 2;
    block.ties.retain(|row| {
        row.image.index() != image || {
            left -= 1;
            left >= 0
        }
    });
    block.marks.retain(|row| row.image.index() != image);
    let run = solve_both(&block, &holding(&["dc", "decentring"]));
    assert_eq!(run.problem.images_without_part(), [block.images[image].name.as_str()]);
    assert_eq!(run.solution().state.poses[image], block.images[image].pose, "its pose stays as given");
}

#[test]
fn start_values_behind_the_camera_are_named() {
    let mut block = dike(&[("k1", 1.5e-9)], 0.0);
    let far = nalgebra::Vector3::new(0.0, 0.0, 1000.0);
    block.tie_points[7].position = Some(far);
    for error in errors_of_both(&block, &holding(&["dc"])) {
        let AdjustError::BadStart { point, .. } = &error else { panic!("{error}") };
        assert_eq!(point, &block.tie_points[7].name);
    }
}
