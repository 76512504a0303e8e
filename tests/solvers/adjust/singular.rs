//! What the measurements do not determine is named by every solver; nothing crashes and nothing is made up.

use crate::common::{SOLVERS, errors_of_both, preset, solve_both};
use misclosure::adjust::native::Native;
use misclosure::adjust::{AdjustError, Options, Solver};
use misclosure::block::{Block, Role};
use misclosure::camera::parameter_indices;
use misclosure::effects::{self, Context, Descriptor, Effect, OutsideDomain, Stage};
use misclosure::model::{Datum, EffectRef, EffectTerm, Model};
use misclosure::problem::{PointSource, Problem};
use misclosure::scenario::{Scenario, add_noise, simulate};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

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
        // By their plausible ranges: the centre may be anywhere on the sensor, which p1 and p2 follow by a small part
        // of theirs.
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

/// With noise the distortion that is estimated is not quite zero, and its centre is made of noise: a run refuses it by
/// name.
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
fn coordinates_behind_the_camera_give_way_to_where_the_rays_meet() {
    let mut block = dike(&[("k1", 1.5e-9)], 0.0);
    let model = holding(&["dc"]);
    let cost = solve_both(&block, &model).solution().cost;
    block.tie_points[7].position = Some(Vector3::new(0.0, 0.0, 1000.0));
    let again = solve_both(&block, &model).solution().cost;
    assert!((again - cost).abs() < 1e-6 * cost.max(1.0), "{again} for {cost}");
}

#[test]
fn coordinates_of_another_point_give_way_to_where_the_rays_meet() {
    let mut block = dike(&[("k1", 1.5e-9)], 0.0);
    let model = holding(&["dc"]);
    let cost = solve_both(&block, &model).solution().cost;
    let own = 7;
    let given = block.tie_points[own].position.expect("given coordinates");
    let seen: Vec<usize> =
        block.ties.iter().filter(|row| row.point.index() == own).map(|row| row.image.index()).collect();
    let in_front =
        |point: &Vector3<f64>| seen.iter().all(|image| block.images[*image].pose.cam_from_world(point).z > 0.0);
    let others = block.tie_points.iter().filter_map(|point| point.position).filter(in_front);
    let distance = |point: &Vector3<f64>| (point - given).norm();
    let farthest = others.max_by(|a, b| distance(a).total_cmp(&distance(b))).expect("another point");
    block.tie_points[own].position = Some(farthest);
    let run = solve_both(&block, &model);
    assert!((run.solution().cost - cost).abs() < 1e-6 * cost.max(1.0), "{} for {cost}", run.solution().cost);
    let place = run.problem.point_sources.iter().position(|source| *source == PointSource::Tie(own.into()));
    let start = run.problem.start.points[place.expect("its place")];
    assert!(distance(&start) < 0.1 * distance(&farthest), "{start} for {given}");
}

/// Adds the sum of its parameters, times a bend of its input that no camera has, to its first output, where `domain`
/// allows it.
struct Narrow {
    descriptor: Descriptor,
    domain: Domain,
}

/// Of input and parameters.
type Domain = Box<dyn Fn(&[f64], &[f64]) -> bool + Send + Sync>;

impl Effect for Narrow {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }
    fn eval(
        &self,
        _: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        if !(self.domain)(input, theta) {
            return Err(OutsideDomain);
        }
        let stage = self.descriptor.stage;
        let bend = (1e-3 * input[0]).sin() * (2e-3 * input[1]).sin();
        out.copy_from_slice(&input[..stage.outputs()]);
        out[0] += theta.iter().sum::<f64>() * bend;
        if let Some(matrix) = d_input {
            // At the nominal values, where alone these tests differentiate.
            effects::fill_identity(stage, matrix);
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            matrix[..theta.len()].fill(bend);
        }
        Ok(())
    }
}

fn narrow(stage: Stage, parameters: &[&'static str], domain: Domain) -> EffectTerm {
    let mut descriptor = effects::find("radial-high").expect("an effect").descriptor().clone();
    let parameter = descriptor.parameters[0].clone();
    descriptor.id = "narrow".into();
    descriptor.stage = stage;
    descriptor.needs.clear();
    descriptor.parameters = parameters
        .iter()
        .map(|name| effects::Parameter { name: (*name).into(), typical: 1.0, ..parameter.clone() })
        .collect();
    let effect = EffectRef::Plugin(Arc::new(Narrow { descriptor, domain }));
    EffectTerm { effect, values: BTreeMap::new(), held: Vec::new() }
}

/// A domain that no step can enter: every step fails, whatever the damping. Where two parameters do the same that is
/// not "no step reduces the cost" but a null direction, and it has their names.
#[test]
fn a_null_direction_is_named_where_no_step_can_be_taken() {
    let block = dike(&[("k1", 1.5e-9)], 0.3);
    let error = |parameters: &[&'static str]| {
        let effect = narrow(Stage::Image, parameters, Box::new(|_, theta| theta.iter().all(|value| *value == 0.0)));
        let model = Model { effects: vec![effect], ..holding(&["dc"]) };
        let problem = Problem::new(&block, &model).expect("a problem");
        Native.solve(&problem, &Options::default(), &mut |_| ControlFlow::Continue(())).expect_err("no step")
    };
    match error(&["a", "b"]) {
        AdjustError::Singular { directions, .. } => {
            assert_eq!(directions.len(), 1, "{directions:?}");
            let mut names: Vec<&str> = directions[0].components.iter().map(|(name, _)| name.as_str()).collect();
            names.sort_unstable();
            assert_eq!(names, ["narrow.a", "narrow.b"]);
        }
        other => panic!("not a null space: {other}"),
    }
    // One alone is determined: there it is the domain.
    let alone = error(&["a"]);
    assert!(matches!(alone, AdjustError::NotConverged { .. }), "{alone}");
}

/// Surveyed coordinates belong to a point and to no image.
#[test]
fn a_control_effect_outside_its_domain_names_the_control_point() {
    let block = dike(&[("k1", 1.5e-9)], 0.3);
    let point = block.surveyed.iter().filter(|point| point.role == Role::Control).nth(2).expect("control");
    let outside = point.position;
    let effect = narrow(Stage::Control, &["a"], Box::new(move |input, _| input != outside.as_slice()));
    let model = Model { effects: vec![effect], datum: Datum::Control, ..holding(&["dc"]) };
    let problem = Problem::new(&block, &model).expect("a problem");
    for solver in SOLVERS {
        let solved = solver.solve(&problem, &Options::default(), &mut |_| ControlFlow::Continue(())).map(|_| ());
        let evaluated = solver.evaluate(&problem, &problem.start).map(|_| ());
        for result in [solved, evaluated] {
            let error = result.expect_err("outside the domain");
            let AdjustError::BadStart { image, point: found, .. } = &error else { panic!("{error}") };
            assert_eq!((image, found.as_ref()), (&None, Some(&point.name)), "{error}");
        }
    }
}
