//! The block of these tests: truth, measurements, start values.

use super::*;
use crate::camera::{self, F, Interior, PARAMETER_COUNT};
use crate::effects::{self, BlockContext, ImageContext, Scope};
use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

pub(super) const IMAGES: usize = 8;
pub(super) const POINTS: usize = 80;
pub(super) const SIGMA_PX: f64 = 0.5;
pub(super) const INTERIOR: Interior =
    [5510.0, 2540.0, 1946.0, 2530.0, 1956.0, -4e-9, 3e-17, -1e-24, 3e-7, -2e-7, 2e-4, -1e-4];

/// The block format's formula.
fn project(interior: &Interior, pose: &Pose, point: &Vector3<f64>) -> [f64; 2] {
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
pub(super) fn problem_with(interior: Interior) -> (State, Problem) {
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
        camera_free: vec![[true; PARAMETER_COUNT]],
        camera_scales: vec![scales],
        camera_domains: vec![scales.map(|scale| 1000.0 * scale)],
        tie_dc_to_pp: false,
        image_names: (0..IMAGES).map(|i| format!("img{i}")).collect(),
        image_contexts: contexts.collect(),
        image_ranks: (0..IMAGES as u32).collect(),
        block_context: BlockContext { counts: [IMAGES as u32, 2, 1], ..BlockContext::default() },
        pose_free,
        point_sources: Arc::new((0..POINTS).map(|j| PointSource::Tie(j.into())).collect()),
        point_names: Arc::new((0..POINTS).map(|j| format!("p{j}")).collect()),
        point_start: point_start.into(),
        observations: observations.into(),
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

pub(super) fn problem() -> (State, Problem) {
    problem_with(INTERIOR)
}

/// Moves every free number of the start values by a plausible error.
pub(super) fn disturb(problem: &mut Problem, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut within = |size: f64| random.random_range(-size..size);
    for (c, interior) in problem.start.interiors.iter_mut().enumerate() {
        for k in 0..PARAMETER_COUNT {
            let size = if k == F { 20.0 } else { 5.0 * problem.camera_scales[c][k] };
            interior[k] += if problem.camera_free[c][k] { within(size) } else { 0.0 };
        }
        if problem.tie_dc_to_pp {
            camera::tie_centre(interior);
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

pub(super) fn add_noise(problem: &mut Problem, size_px: f64, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for observation in Arc::make_mut(&mut problem.observations) {
        observation.x += random.random_range(-size_px..size_px);
        observation.y += random.random_range(-size_px..size_px);
    }
}

/// Adds an effect with one value per parameter and instance.
pub(super) fn add_effect(problem: &mut Problem, effect: EffectRef, values: &[f64]) {
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

/// Standard deviations of observed positions, m.
const SIGMA_M: [f64; 3] = [0.01, 0.02, 0.03];

/// Makes a control point of a point, where it starts.
pub(super) fn observe_point(problem: &mut Problem, index: usize) {
    let position = problem.start.points[index];
    problem.control.push(PositionObservation { index: index as u32, position, sigma: SIGMA_M.into() });
}

/// Observes a projection centre where it starts.
pub(super) fn observe_image(problem: &mut Problem, index: usize) {
    let position = problem.start.poses[index].centre;
    problem.gnss.push(PositionObservation { index: index as u32, position, sigma: SIGMA_M.into() });
}

/// Ties the centre of distortion to the principal point.
pub(super) fn tie_centre(problem: &mut Problem) {
    problem.tie_dc_to_pp = true;
    (problem.camera_free[0][3], problem.camera_free[0][4]) = (false, false);
    let interior = &mut problem.start.interiors[0];
    camera::tie_centre(interior);
}

pub(super) fn builtin(id: &str) -> EffectRef {
    EffectRef::Builtin(effects::find(id).expect("in the catalogue"))
}

/// The problem with every kind of residual and effects of three stages, away from its measurements.
pub(super) fn full_problem() -> Problem {
    let (_, mut problem) = problem();
    problem.datum_defect = 0;
    for i in 0..4 {
        observe_point(&mut problem, 5 * i);
        observe_image(&mut problem, i);
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
pub(super) fn moved(problem: &Problem, state: &State, unknown: usize, by: f64) -> State {
    let layout = problem.layout();
    let mut state = state.clone();
    if let Some((c, k)) = layout.camera_parameter(unknown) {
        state.interiors[c][k] += by;
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

pub(super) fn dense(problem: &Problem, evaluation: &Evaluation) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(evaluation.residuals.len(), problem.layout().total());
    for row in 0..evaluation.residuals.len() {
        for entry in evaluation.row_start[row]..evaluation.row_start[row + 1] {
            matrix[(row, evaluation.columns[entry])] += evaluation.values[entry];
        }
    }
    matrix
}
