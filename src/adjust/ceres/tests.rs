//! The Ceres side alone: a small convergent block whose measurements follow the formula of the block format, written here once more.

use super::*;
use crate::effects::{self, BlockContext, ImageContext, Scope};
use crate::problem::*;
use approx::assert_relative_eq;
use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;
use std::sync::Arc;

const IMAGES: usize = 8;
const POINTS: usize = 80;
const SIGMA_PX: f64 = 0.5;
const INTERIOR: [f64; 12] = [5510.0, 2540.0, 1946.0, 2530.0, 1956.0, -4e-9, 3e-17, -1e-24, 3e-7, -2e-7, 2e-4, -1e-4];

/// Noise-free problems come back to the truth up to the stopping rule: 1e-4 sigma.
const RECOVERED_SIGMAS: f64 = 1e-4;

/// Central differences of residuals in their hundreds: steps that move image points by about 1e-3 px leave 1e-7.
const DERIVATIVE: f64 = 1e-6;

/// The block format's formula.
fn project(interior: &[f64; 12], pose: &Pose, point: &Vector3<f64>) -> [f64; 2] {
    let [f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = *interior;
    let v = pose.cam_from_world(point);
    assert!(v.z > 0.0);
    let (u, w) = (ppx + f * v.x / v.z, ppy + f * v.y / v.z);
    let (du, dv) = (u - dcx, w - dcy);
    let r2 = du * du + dv * dv;
    let radial = k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
    [
        u + du * radial + p1 * (r2 + 2.0 * du * du) + 2.0 * p2 * du * dv + b1 * du + b2 * dv,
        w + dv * radial + p2 * (r2 + 2.0 * dv * dv) + 2.0 * p1 * du * dv,
    ]
}

/// Truth and problem: eight tilted and rolled images at two heights over a hilly field, free datum, everything free.
fn problem_with(interior: [f64; 12]) -> (State, Problem) {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut within = |size: f64| random.random_range(-size..size);
    let points: Vec<_> = (0..POINTS).map(|_| Vector3::new(within(20.0), within(15.0), within(6.0))).collect();
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let poses: Vec<_> = (0..IMAGES)
        .map(|i| {
            let angle = i as f64 * std::f64::consts::FRAC_PI_4;
            let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle * 3.0 + within(0.1));
            let centre = Vector3::new(18.0 * angle.cos(), 18.0 * angle.sin(), if i % 2 == 0 { 45.0 } else { 60.0 });
            let look = UnitQuaternion::rotation_between(&(-centre), &-Vector3::z()).expect("not opposite");
            Pose { rotation: roll * down * look, centre }
        })
        .collect();
    let truth = State { interiors: vec![interior], theta: Vec::new(), poses, points };

    let mut observations = Vec::new();
    let mut point_start = vec![0];
    for point in &truth.points {
        for (i, pose) in truth.poses.iter().enumerate() {
            let [x, y] = project(&interior, pose, point);
            let inverse_sigma = 1.0 / SIGMA_PX;
            observations.push(ImageObservation { image: i as u32, kind: MeasurementKind::Tie, x, y, inverse_sigma });
        }
        point_start.push(observations.len());
    }
    let scales =
        crate::camera::Camera { id: String::new(), width_px: 5120, height_px: 3840, pixel_um: None, interior }.scales();
    let mut pose_free = vec![[true; 6]; IMAGES];
    pose_free[0] = [false; 6];
    pose_free[4][3] = false; // the base between images 0 and 4 lies along x
    let contexts = (0..IMAGES).map(|i| ImageContext {
        image: i as u32,
        flight: (i / 4) as u32,
        width_px: 5120.0,
        height_px: 3840.0,
        tau: i as f64 / 7.0 - 0.5,
        tau_order: i as f64 / 7.0 - 0.5,
        ..ImageContext::default()
    });
    let problem = Problem {
        camera_names: vec!["cam".into()],
        camera_free: vec![[true; 12]],
        camera_scales: vec![scales],
        camera_domains: vec![scales.map(|scale| 1000.0 * scale)],
        tie_dc_to_pp: false,
        image_names: (0..IMAGES).map(|i| format!("img{i}")).collect(),
        image_contexts: contexts.collect(),
        image_ranks: (0..IMAGES as u32).collect(),
        block_context: BlockContext { counts: [IMAGES as u32, 2, 1], ..BlockContext::default() },
        pose_free,
        point_sources: (0..POINTS).map(|j| PointSource::Tie(j.into())).collect(),
        point_names: (0..POINTS).map(|j| format!("p{j}")).collect(),
        point_start,
        observations,
        control: Vec::new(),
        gnss: Vec::new(),
        effects: Vec::new(),
        theta: Vec::new(),
        camera_priors: Vec::new(),
        loss: Loss::None,
        start: truth.clone(),
        datum_defect: 7,
    };
    (truth, problem)
}

fn problem() -> (State, Problem) {
    problem_with(INTERIOR)
}

/// Moves every free number of the start values by a plausible error.
fn disturb(problem: &mut Problem, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut within = |size: f64| random.random_range(-size..size);
    for (c, interior) in problem.start.interiors.iter_mut().enumerate() {
        for k in 0..12 {
            let size = if k == 0 { 20.0 } else { 5.0 * problem.camera_scales[c][k] };
            interior[k] += if problem.camera_free[c][k] { within(size) } else { 0.0 };
        }
        if problem.tie_dc_to_pp {
            (interior[3], interior[4]) = (interior[1], interior[2]);
        }
    }
    for (pose, free) in problem.start.poses.iter_mut().zip(&problem.pose_free) {
        let w = Vector3::from_fn(|k, _| if free[k] { within(0.002) } else { 0.0 });
        pose.rotation = UnitQuaternion::from_scaled_axis(w) * pose.rotation;
        pose.centre += Vector3::from_fn(|k, _| if free[3 + k] { within(0.1) } else { 0.0 });
    }
    for point in &mut problem.start.points {
        *point += Vector3::from_fn(|_, _| within(0.3));
    }
}

fn add_noise(problem: &mut Problem, size_px: f64, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for observation in &mut problem.observations {
        observation.x += random.random_range(-size_px..size_px);
        observation.y += random.random_range(-size_px..size_px);
    }
}

fn options() -> Options {
    Options { threads: 2, ..Options::default() }
}

fn solve(problem: &Problem) -> Result<Solution, AdjustError> {
    Ceres.solve(problem, &options(), &mut |_| ControlFlow::Continue(()))
}

/// Adds an effect with one value per parameter and instance.
fn add_effect(problem: &mut Problem, effect: EffectRef, values: &[f64]) {
    let index = problem.effects.len() as u32;
    let mut slots = Vec::new();
    for (k, parameter) in effect.descriptor().parameters.iter().enumerate() {
        slots.push((parameter.scope, problem.theta.len() as u32));
        let count = match parameter.scope {
            Scope::Global | Scope::Camera => 1,
            Scope::Flight | Scope::FlightButFirst => 2,
            Scope::Image => IMAGES as u32,
        };
        for instance in 0..count {
            problem.theta.push(ThetaEntry {
                effect: index,
                parameter: k as u32,
                instance,
                name: format!("{}.{}", effect.descriptor().id, parameter.name),
                free: !matches!(parameter.role, effects::Role::Given(_))
                    && (parameter.scope != Scope::FlightButFirst || instance > 0),
                scale: parameter.typical.abs(),
                prior_sigma: None,
                prior_mean: 0.0,
            });
            problem.start.theta.push(values[k]);
        }
    }
    problem.effects.push(EffectInstance { effect, slots });
}

fn builtin(id: &str) -> EffectRef {
    EffectRef::Builtin(effects::find(id).expect("in the catalogue"))
}

/// Measurements that follow from the problem's own start values, by its own forward formula.
fn make_exact(problem: &mut Problem) -> State {
    let truth = problem.start.clone();
    let residuals = Ceres.evaluate(problem, &truth).expect("evaluates").residuals;
    for (k, observation) in problem.observations.iter_mut().enumerate() {
        observation.x -= residuals[2 * k] / observation.inverse_sigma;
        observation.y -= residuals[2 * k + 1] / observation.inverse_sigma;
    }
    let mut next = 2 * problem.observations.len();
    for observation in problem.control.iter_mut().chain(&mut problem.gnss) {
        for k in 0..3 {
            observation.position[k] -= residuals[next] * observation.sigma[k];
            next += 1;
        }
    }
    truth
}

/// Every estimated number against the truth, in units of its own sigma.
fn assert_recovered(problem: &Problem, truth: &State, solution: &Solution, sigmas: f64) {
    let layout = problem.layout();
    let covariance = solution.covariance.as_ref().expect("asked for");
    let compare = |name: String, found: f64, expected: f64, variance: f64| {
        let error = (found - expected).abs();
        let allowed = sigmas * variance.sqrt() + 1e-12 * expected.abs();
        assert!(error <= allowed, "{name}: {found} instead of {expected}, sigma {}", variance.sqrt());
    };
    for (row, &unknown) in covariance.shared_unknowns.iter().enumerate() {
        let value = |state: &State| match unknown.checked_sub(layout.theta(0)) {
            None => state.interiors[unknown / 12][unknown % 12],
            Some(t) => state.theta[t],
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
fn residuals_follow_the_block_format() {
    let (truth, problem) = problem();
    let evaluation = Ceres.evaluate(&problem, &truth).unwrap();
    assert_eq!(evaluation.residuals.len(), problem.residual_count());
    for residual in &evaluation.residuals {
        assert!(residual.abs() < 1e-9 / SIGMA_PX, "{residual}");
    }
}

/// The problem with every kind of residual and effects of three stages, away from its measurements.
fn full_problem() -> Problem {
    let (truth, mut problem) = problem();
    problem.datum_defect = 0;
    for i in 0..4 {
        let sigma = Vector3::new(0.01, 0.02, 0.03);
        problem.control.push(PositionObservation { index: 5 * i, position: truth.points[5 * i as usize], sigma });
        problem.gnss.push(PositionObservation { index: i, position: truth.poses[i as usize].centre, sigma });
    }
    add_effect(&mut problem, builtin("focal-time"), &[3.0, 0.0]);
    add_effect(&mut problem, builtin("local-flaw"), &[2.0, 2000.0, 1500.0, 400.0, 0.0]);
    add_effect(&mut problem, builtin("gnss-lever-arm"), &[0.05, -0.03, 0.1]);
    problem.theta[0].prior_sigma = Some(2.0);
    problem.theta[1].prior_sigma = Some(0.5); // of a given value: an observation without unknown
    problem.camera_priors.push(CameraPrior { camera: 0, parameter: 0, value: 5500.0, sigma: 3.0 });
    disturb(&mut problem, 2);
    problem
}

/// `state` with one number of the layout changed.
fn moved(problem: &Problem, state: &State, unknown: usize, by: f64) -> State {
    let layout = problem.layout();
    let mut state = state.clone();
    if unknown < layout.theta(0) {
        state.interiors[unknown / 12][unknown % 12] += by;
    } else if unknown < layout.pose(0, 0) {
        state.theta[unknown - layout.theta(0)] += by;
    } else if unknown < layout.point(0, 0) {
        let (i, k) = ((unknown - layout.pose(0, 0)) / 6, (unknown - layout.pose(0, 0)) % 6);
        let pose = &mut state.poses[i];
        if k < 3 {
            let mut w = Vector3::zeros();
            w[k] = by;
            pose.rotation = UnitQuaternion::from_scaled_axis(w) * pose.rotation;
        } else {
            pose.centre[k - 3] += by;
        }
    } else {
        let k = unknown - layout.point(0, 0);
        state.points[k / 3][k % 3] += by;
    }
    state
}

fn dense(problem: &Problem, evaluation: &Evaluation) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(evaluation.residuals.len(), problem.layout().total());
    for row in 0..evaluation.residuals.len() {
        for entry in evaluation.row_start[row]..evaluation.row_start[row + 1] {
            matrix[(row, evaluation.columns[entry])] += evaluation.values[entry];
        }
    }
    matrix
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
        let step = if unknown < layout.theta(0) {
            1e-3 * problem.camera_scales[unknown / 12][unknown % 12]
        } else if unknown < layout.pose(0, 0) {
            1e-5 * problem.theta[unknown - layout.theta(0)].scale
        } else {
            1e-5
        };
        let residuals = |by: f64| {
            let mut state = moved(problem, &problem.start, unknown, by);
            if problem.tie_dc_to_pp {
                for interior in &mut state.interiors {
                    (interior[3], interior[4]) = (interior[1], interior[2]);
                }
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
fn jacobian_by_differences_with_tied_centre() {
    let mut problem = full_problem();
    problem.tie_dc_to_pp = true;
    (problem.camera_free[0][3], problem.camera_free[0][4]) = (false, false);
    let interior = &mut problem.start.interiors[0];
    (interior[3], interior[4]) = (interior[1], interior[2]);
    check_jacobian(&problem);
}

/// Effects of exposure and ray stage, as Rust alone knows them, in chains that couple the rotation into every stage.
struct Turning(effects::Descriptor, effects::Stage);

impl effects::Effect for Turning {
    fn descriptor(&self) -> &effects::Descriptor {
        &self.0
    }
    fn eval(
        &self,
        _: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), effects::OutsideDomain> {
        // Linear in its input and in theta: out = identity + theta * A input, A of the entries below.
        let (n, m) = (self.1.inputs(), self.1.outputs());
        let a = |i: usize, k: usize| {
            0.01 * ((3 * i + 5 * k) as f64).sin() * if self.1 == effects::Stage::Interior && i > 4 { 0.0 } else { 1.0 }
        };
        let offset = self.1.identity_offset();
        let mut shift = vec![0.0; m];
        for i in 0..m {
            shift[i] = (0..n).map(|k| a(i, k) * input[k]).sum();
            out[i] = input[offset + i] + theta[0] * shift[i];
        }
        if let Some(d) = d_input {
            effects::fill_identity(self.1, d);
            for i in 0..m {
                for k in 0..n {
                    d[i * n + k] += theta[0] * a(i, k);
                }
            }
        }
        if let Some(d) = d_theta {
            d.copy_from_slice(&shift);
        }
        Ok(())
    }
}

fn turning(stage: effects::Stage) -> EffectRef {
    let mut descriptor = effects::find("focal-time").unwrap().descriptor().clone();
    descriptor.id = format!("turning-{}", stage.name()).into();
    descriptor.stage = stage;
    descriptor.parameters.truncate(1);
    EffectRef::Plugin(Arc::new(Turning(descriptor, stage)))
}

#[test]
fn jacobian_by_differences_through_every_stage_twice() {
    let (_, mut problem) = problem();
    for (k, stage) in effects::Stage::ALL.into_iter().chain(effects::Stage::ALL).enumerate() {
        add_effect(&mut problem, turning(stage), &[0.01 * (k + 1) as f64]);
    }
    let sigma = Vector3::new(0.01, 0.02, 0.03);
    problem.control.push(PositionObservation { index: 7, position: problem.start.points[7], sigma });
    problem.gnss.push(PositionObservation { index: 3, position: problem.start.poses[3].centre, sigma });
    check_jacobian(&problem);
}

#[test]
fn noise_free_everything_free() {
    let (truth, mut problem) = problem();
    disturb(&mut problem, 3);
    for linear_solver in [LinearSolver::Auto, LinearSolver::Dense, LinearSolver::Sparse, LinearSolver::Iterative] {
        let options = Options { linear_solver, ..options() };
        let solution = Ceres.solve(&problem, &options, &mut |_| ControlFlow::Continue(())).unwrap();
        // Nothing is left but what the stopping rule allows; the inexact steps of the iterative solver use some of that.
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
    problem.camera_free[0] = [false; 12];
    disturb(&mut problem, 4);
    let solution = solve(&problem).unwrap();
    assert_eq!(solution.state.interiors, truth.interiors);
    assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
}

#[test]
fn poses_held_leave_an_intersection() {
    let (truth, mut problem) = problem();
    problem.camera_free[0] = [false; 12];
    problem.pose_free = vec![[false; 6]; IMAGES];
    disturb(&mut problem, 5);
    let solution = solve(&problem).unwrap();
    assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
}

#[test]
fn one_angle_held() {
    let (truth, mut problem) = problem();
    problem.pose_free[3][1] = false;
    // From a start that differs by turns about the other two axes, that angle is not quite held at the truth's: start at the truth.
    add_noise(&mut problem, 0.5, 9);
    let solution = solve(&problem).unwrap();
    let turn = (solution.state.poses[3].rotation * truth.poses[3].rotation.inverse()).scaled_axis();
    assert!(turn.y.abs() < 1e-3 * turn.norm(), "{turn}");
    assert_eq!(solution.covariance.unwrap().poses[3].column(1).norm(), 0.0);
}

#[test]
fn centre_of_distortion_tied_to_the_principal_point() {
    let mut interior = INTERIOR;
    (interior[3], interior[4]) = (interior[1], interior[2]);
    let (truth, mut problem) = problem_with(interior);
    problem.tie_dc_to_pp = true;
    (problem.camera_free[0][3], problem.camera_free[0][4]) = (false, false);
    disturb(&mut problem, 6);
    let solution = solve(&problem).unwrap();
    let found = solution.state.interiors[0];
    assert_eq!((found[3], found[4]), (found[1], found[2]));
    assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
}

/// No pose held: position, orientation and scale come from observed positions.
fn hold_by_positions(control: bool) {
    let (truth, mut problem) = problem();
    problem.pose_free = vec![[true; 6]; IMAGES];
    problem.datum_defect = 0;
    let sigma = Vector3::new(0.01, 0.01, 0.02);
    for i in 0..IMAGES as u32 {
        if control {
            let index = 9 * i;
            problem.control.push(PositionObservation { index, position: truth.points[index as usize], sigma });
        } else {
            problem.gnss.push(PositionObservation { index: i, position: truth.poses[i as usize].centre, sigma });
        }
    }
    disturb(&mut problem, 7);
    let solution = solve(&problem).unwrap();
    assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
}

#[test]
fn datum_by_control() {
    hold_by_positions(true);
}

#[test]
fn datum_by_gnss() {
    hold_by_positions(false);
}

#[test]
fn without_a_datum_poses_are_named() {
    let (_, mut problem) = problem();
    problem.pose_free = vec![[true; 6]; IMAGES];
    match solve(&problem) {
        Err(AdjustError::Singular { directions, .. }) => {
            assert_eq!(directions.len(), 7, "{directions:?}");
            let of_image = |direction: &NullDirection| direction.components[0].0.starts_with("img");
            assert!(directions.iter().all(of_image), "{directions:?}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn effects_of_three_stages_come_back() {
    let (_, mut problem) = problem();
    problem.pose_free = vec![[true; 6]; IMAGES];
    let sigma = Vector3::new(0.01, 0.01, 0.02);
    for i in 0..IMAGES as u32 {
        let position = problem.start.poses[i as usize].centre;
        problem.gnss.push(PositionObservation { index: i, position, sigma });
        let index = 9 * i;
        problem.control.push(PositionObservation { index, position: problem.start.points[index as usize], sigma });
    }
    add_effect(&mut problem, builtin("focal-time"), &[3.0, 0.0]);
    add_effect(&mut problem, builtin("local-flaw"), &[2.0, 2500.0, 2000.0, 700.0, 1.0]);
    add_effect(&mut problem, builtin("gnss-lever-arm"), &[0.05, -0.03, 0.1]);
    let truth = make_exact(&mut problem);
    disturb(&mut problem, 8);
    for (entry, value) in problem.theta.iter().zip(&mut problem.start.theta) {
        *value += if entry.free { 0.1 * entry.scale } else { 0.0 };
    }
    let solution = solve(&problem).unwrap();
    assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
    // The same through the ABI call back: Rust's own derivation of the same effects.
    let mut problem = problem;
    for instance in &mut problem.effects {
        instance.effect = EffectRef::Plugin(Arc::new(Borrowed(instance.effect.descriptor().id.to_string())));
    }
    let again = solve(&problem).unwrap();
    assert_recovered(&problem, &truth, &again, RECOVERED_SIGMAS);
}

/// A built-in effect in its Rust derivation that does not look like one.
struct Borrowed(String);

impl effects::Effect for Borrowed {
    fn descriptor(&self) -> &effects::Descriptor {
        effects::find(&self.0).unwrap().descriptor()
    }
    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), effects::OutsideDomain> {
        effects::find(&self.0).unwrap().eval(context, input, theta, out, d_input, d_theta)
    }
}

#[test]
fn losses_follow_their_formulas() {
    for loss in [Loss::None, Loss::Huber, Loss::Cauchy] {
        let (_, mut problem) = problem();
        add_noise(&mut problem, 0.2, 10);
        for k in [3, 77, 311] {
            problem.observations[k].x += 5.0;
        }
        problem.loss = loss;
        disturb(&mut problem, 11);
        let solution = solve(&problem).unwrap();
        let residuals = Ceres.evaluate(&problem, &solution.state).unwrap().residuals;
        let a2 = LOSS_SCALE * LOSS_SCALE;
        let rho = |s: f64| match loss {
            Loss::None => s,
            Loss::Huber if s <= a2 => s,
            Loss::Huber => 2.0 * LOSS_SCALE * s.sqrt() - a2,
            Loss::Cauchy => a2 * (1.0 + s / a2).ln(),
        };
        let expected: f64 = residuals.chunks_exact(2).map(|r| 0.5 * rho(r[0] * r[0] + r[1] * r[1])).sum();
        assert_relative_eq!(solution.cost, expected, max_relative = 1e-10);
        // A minimum: any other state costs more.
        let mut elsewhere = problem.clone();
        elsewhere.start = moved(&problem, &solution.state, problem.layout().point(3, 2), 0.01);
        let mut first = None;
        let stop = &mut |iteration: &Iteration| {
            first = Some(iteration.cost);
            ControlFlow::Break(())
        };
        assert!(matches!(Ceres.solve(&elsewhere, &options(), stop), Err(AdjustError::Cancelled { .. })));
        assert!(first.unwrap() > solution.cost);
    }
}

/// Shared, pose and point covariance against the inverse of the whole normal matrix.
#[test]
fn covariance_is_the_inverse_of_the_normal_matrix() {
    let mut problem = full_problem();
    problem.pose_free[4][3] = true;
    // A flaw that is not there has no place: nothing to invert.
    problem.theta[2..7].iter_mut().for_each(|entry| entry.free = false);
    let mut image_scoped = turning(effects::Stage::Interior).descriptor().clone();
    image_scoped.parameters[0].scope = Scope::Image;
    let effect = EffectRef::Plugin(Arc::new(Turning(image_scoped, effects::Stage::Interior)));
    add_effect(&mut problem, effect, &[0.0]);
    let from = problem.theta.len() - IMAGES;
    problem.theta[from..].iter_mut().for_each(|entry| {
        entry.prior_sigma = Some(1e-3);
        entry.scale = 1e-3;
    });
    let solution = solve(&problem).unwrap();
    let jacobian = dense(&problem, &Ceres.evaluate(&problem, &solution.state).unwrap());
    let free: Vec<usize> = (0..problem.layout().total()).filter(|k| problem.free()[*k]).collect();
    let jacobian = jacobian.select_columns(&free);
    // Scaled columns keep the inversion exact.
    let scale: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let scaled = DMatrix::from_fn(jacobian.nrows(), free.len(), |i, k| jacobian[(i, k)] / scale[k]);
    let inverse = (scaled.transpose() * &scaled).cholesky().expect("regular").inverse();
    let place = |unknown: usize| free.binary_search(&unknown).ok();
    let expected = |a: usize, b: usize| match (place(a), place(b)) {
        (Some(a), Some(b)) => inverse[(a, b)] / (scale[a] * scale[b]),
        _ => 0.0,
    };
    let layout = problem.layout();
    let close = |found: f64, a: usize, b: usize| {
        let size = (expected(a, a) * expected(b, b)).sqrt();
        assert!((found - expected(a, b)).abs() <= 1e-6 * size, "{found} instead of {}", expected(a, b));
    };
    let covariance = solution.covariance.unwrap();
    for (row, &a) in covariance.shared_unknowns.iter().enumerate() {
        for (column, &b) in covariance.shared_unknowns.iter().enumerate() {
            close(covariance.shared[(row, column)], a, b);
        }
    }
    for t in 0..layout.theta {
        close(covariance.theta_variances[t], layout.theta(t), layout.theta(t));
        assert!(!problem.theta[t].free || covariance.theta_variances[t] > 0.0);
    }
    for i in 0..layout.images {
        for (row, column) in (0..36).map(|k| (k / 6, k % 6)) {
            close(covariance.poses[i][(row, column)], layout.pose(i, row), layout.pose(i, column));
        }
    }
    for j in 0..layout.points {
        for (row, column) in (0..9).map(|k| (k / 3, k % 3)) {
            close(covariance.points[j][(row, column)], layout.point(j, row), layout.point(j, column));
        }
    }
    // Shared alone is the same.
    let options = Options { covariance: CovarianceOf::Shared, ..options() };
    let shared = Ceres.solve(&problem, &options, &mut |_| ControlFlow::Continue(())).unwrap().covariance.unwrap();
    assert!(shared.poses.is_empty() && shared.points.is_empty());
    for t in 0..layout.theta {
        close(shared.theta_variances[t], layout.theta(t), layout.theta(t));
    }
}

/// The reduced system is the Schur complement of the dense normal matrix.
#[test]
fn reduced_system_is_the_schur_complement() {
    let problem = full_problem();
    let evaluation = Ceres.evaluate(&problem, &problem.start).unwrap();
    let system = Ceres.reduced_system(&problem, &problem.start).unwrap();
    let jacobian = dense(&problem, &evaluation);
    let layout = problem.layout();
    let keep: Vec<usize> = (0..layout.point(0, 0)).filter(|k| problem.free()[*k]).collect();
    assert_eq!(system.unknowns, keep);
    let a = jacobian.select_columns(&keep);
    let b = jacobian.columns(layout.point(0, 0), 3 * layout.points).into_owned();
    let residuals = nalgebra::DVector::from_vec(evaluation.residuals);
    let inverse = (b.transpose() * &b).cholesky().expect("regular").inverse();
    let project = |x: &DMatrix<f64>| x - &b * (&inverse * (b.transpose() * x));
    let expected = a.transpose() * project(&a);
    let gradient = a.transpose() * project(&DMatrix::from_column_slice(residuals.len(), 1, residuals.as_slice()));
    let full = a.transpose() * &a;
    for i in 0..keep.len() {
        for k in 0..keep.len() {
            let size = (full[(i, i)] * full[(k, k)]).sqrt();
            assert!((system.matrix[(i, k)] - expected[(i, k)]).abs() <= 1e-11 * size);
        }
        let size = full[(i, i)].sqrt() * residuals.norm();
        assert!((system.gradient[i] - gradient[i]).abs() <= 1e-11 * size);
    }
}

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
    let result = Ceres.solve(&problem, &options, &mut |_| ControlFlow::Continue(()));
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
        &|problem| problem.observations[5].image = 77,
        "array `observation_image`: entry 5 is 77, expected less than 8",
    );
    wrong(&|problem| problem.observations[5].x = f64::NAN, "array `observation_xy`: entry 10 is not finite");
    wrong(
        &|problem| problem.observations[5].inverse_sigma = 0.0,
        "array `observation_weight`: entry 5 is 0.000000, expected more than 0",
    );
    wrong(&|problem| problem.point_start[1] = 1000, "array `point_start`: falls at entry 2");
    wrong(&|problem| problem.point_start[POINTS] = 639, "array `point_start`: ends at 639, expected 640");
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
            problem.camera_priors.push(CameraPrior { camera: 0, parameter: 12, value: 0.0, sigma: 1.0 });
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
            assert_eq!((image.as_str(), point.as_str()), ("img0", "p7"));
            assert!(reason.starts_with("it lies behind the camera"), "{reason}");
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(Ceres.evaluate(&problem, &problem.start).unwrap_err().to_string(), error.to_string());
}

#[test]
fn zero_distortion_names_its_centre() {
    let mut interior = INTERIOR;
    interior[5..].fill(0.0);
    for noise in [0.0, 0.03] {
        let (_, mut problem) = problem_with(interior);
        if noise > 0.0 {
            add_noise(&mut problem, noise, 13);
        }
        match solve(&problem) {
            Err(AdjustError::Singular { solver: "ceres", directions }) => {
                let names: Vec<_> = directions.iter().map(|d| d.components[0].0.as_str()).collect();
                assert_eq!(names.len(), 2, "{directions:?}");
                assert!(names.contains(&"dcx") && names.contains(&"dcy"), "{directions:?}");
            }
            other => panic!("noise {noise}: {other:?}"),
        }
    }
}

#[test]
fn a_point_on_one_ray_is_named() {
    let (_, mut problem) = problem();
    // Point 3 loses all rays but one.
    let (begin, end) = (problem.point_start[3] + 1, problem.point_start[4]);
    problem.observations.drain(begin..end);
    problem.point_start[4..].iter_mut().for_each(|start| *start -= end - begin);
    match solve(&problem) {
        Err(AdjustError::Singular { directions, .. }) => assert!(directions[0].components[0].0.starts_with("p3.")),
        other => panic!("{other:?}"),
    }
}

#[test]
fn one_thread_repeats_to_the_last_bit_and_several_to_rounding() {
    let (_, mut problem) = problem();
    add_noise(&mut problem, 0.5, 14);
    disturb(&mut problem, 15);
    let with =
        |threads| Ceres.solve(&problem, &Options { threads, ..options() }, &mut |_| ControlFlow::Continue(())).unwrap();
    let (one, again, two) = (with(1), with(1), with(2));
    assert!(one.state == again.state, "two runs differ");
    assert_eq!(one.covariance, again.covariance);
    // Ceres adds up in the order in which its threads arrive.
    assert_relative_eq!(one.cost, two.cost, max_relative = 1e-12);
    for (a, b) in one.state.points.iter().zip(&two.state.points) {
        assert!((a - b).norm() < 1e-9);
    }
}

#[test]
fn too_many_unknowns_for_pose_covariances_are_refused() {
    let (_, mut problem) = problem();
    problem.pose_free = vec![[true; 6]; 1001];
    let error = solve(&problem).unwrap_err();
    assert!(matches!(error, AdjustError::Unsupported { .. }), "{error}");
}
