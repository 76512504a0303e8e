//! One image measurement through the whole chain, with its derivatives composed by hand.

use super::bent::predict_bent;
use super::frame::{Frame, InteriorChain, Stages};
use super::lanes::{CAMERA, POINT, Predictions, ROTATION};
use crate::camera::{DCX, DCY, PARAMETER_COUNT, PPX, PPY, fraser};
use crate::effects::{Context, IMAGE_INTERIOR, Stage};
use crate::math::rotation;
use crate::problem::{ImageObservation, Problem};
use nalgebra::{SMatrix, Vector3};

/// Predicted image point and its derivatives; buffers are reused from measurement to measurement.
#[derive(Debug, Clone, Default)]
pub struct Prediction {
    /// Predicted point, px.
    pub point: [f64; 2],
    /// By the camera's twelve numbers.
    pub d_camera: [[f64; PARAMETER_COUNT]; 2],
    /// By rotation `w` and projection centre.
    pub d_pose: [[f64; 6]; 2],
    /// By the object point.
    pub d_point: [[f64; 3]; 2],
    /// By the local list of effect parameters.
    pub d_theta: [Vec<f64>; 2],
    pub(super) scratch: Scratch,
}

impl Prediction {
    fn clear(&mut self, stages: &Stages) {
        for row in &mut self.d_theta {
            row.clear();
            row.resize(stages.local_len, 0.0);
        }
    }
}

/// Work space.
#[derive(Debug, Clone, Default)]
pub(super) struct Scratch {
    /// Derivative of (r, C) after the exposure stage by local parameters, 6 each.
    pub pose_by_theta: Vec<[f64; 6]>,
    /// Derivative of P after the ray stage by local parameters, 3 each.
    pub point_by_theta: Vec<[f64; 3]>,
    /// Derivatives of an effect's output by its own parameters, row by row.
    pub d_own: Vec<f64>,
}

/// Predicts the image point of `object` in the image of `frame`. `None`: behind the camera, or outside an effect's domain.
pub fn predict(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    observation: &ImageObservation,
    object: &Vector3<f64>,
    out: &mut Prediction,
) -> Option<()> {
    let context = context(problem, observation);
    out.clear(stages);
    if stages.straight() {
        predict_plain(frame, object, out)?;
    } else {
        predict_bent(problem, stages, frame, &context, object, out)?;
    }
    finish(problem, stages, frame, &context, out)
}

/// The same of a straight ray that the plain camera has seen, side by side with others.
pub fn predict_seen(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    observation: &ImageObservation,
    (seen, lane): (&Predictions, usize),
    out: &mut Prediction,
) -> Option<()> {
    if seen.depth[lane] <= 0.0 {
        return None;
    }
    out.clear(stages);
    for i in 0..2 {
        out.point[i] = seen.point[i][lane];
        let of = |first: usize, k: usize| seen.rows[i][first + k][lane];
        out.d_camera[i] = std::array::from_fn(|k| of(CAMERA, k));
        out.d_pose[i] = std::array::from_fn(|k| of(ROTATION, k));
        out.d_point[i] = std::array::from_fn(|k| of(POINT, k));
    }
    finish(problem, stages, frame, &context(problem, observation), out)
}

/// What comes behind the camera, and derivatives by the camera's own numbers.
fn finish(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    context: &Context<'_>,
    out: &mut Prediction,
) -> Option<()> {
    apply_image_effects(problem, stages, frame, context, out)?;
    if let Some(chain) = &frame.interior_chain {
        through_interior_effects(chain, out);
    }
    if problem.tie_dc_to_pp {
        for row in &mut out.d_camera {
            row[PPX] += row[DCX];
            row[PPY] += row[DCY];
            (row[DCX], row[DCY]) = (0.0, 0.0);
        }
    }
    Some(())
}

/// The predicted point alone.
pub fn predict_point(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    observation: &ImageObservation,
    object: &Vector3<f64>,
) -> Option<[f64; 2]> {
    if stages.plain_image() {
        return fraser::project(&frame.interior, frame.view(object).camera_point());
    }
    let context = context(problem, observation);
    let theta = |e: usize| &frame.theta[stages.local_offset[e]..][..problem.effects[e].slots.len()];
    let value = |e: usize, input: &[f64], out: &mut [f64]| {
        problem.effects[e].effect.eval(&context, input, theta(e), out, None, None).ok()
    };
    let mut pose = frame.pose();
    for &e in stages.of(Stage::Exposure) {
        let before = pose;
        value(e, &before, &mut pose)?;
    }
    let mut seen: [f64; 3] = (*object).into();
    for &e in stages.of(Stage::Ray) {
        let input: [f64; 9] = std::array::from_fn(|k| if k < 6 { pose[k] } else { seen[k - 6] });
        value(e, &input, &mut seen)?;
    }
    let [r, centre] = [Vector3::from_column_slice(&pose[..3]), Vector3::from_column_slice(&pose[3..])];
    let rotation = if r == frame.rotation_vector { frame.rotation } else { rotation::exp(&r) };
    let point = fraser::project(&frame.interior, (rotation * (Vector3::from(seen) - centre)).into())?;
    point_behind_camera(problem, stages, frame, observation, point)
}

/// The point that the plain camera sees at `point`, after the effects of the image.
pub fn point_behind_camera(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    observation: &ImageObservation,
    mut point: [f64; 2],
) -> Option<[f64; 2]> {
    let context = context(problem, observation);
    for &e in stages.of(Stage::Image) {
        let theta = &frame.theta[stages.local_offset[e]..][..problem.effects[e].slots.len()];
        let input = image_input(&point, frame);
        problem.effects[e].effect.eval(&context, &input, theta, &mut point, None, None).ok()?;
    }
    Some(point)
}

fn context<'a>(problem: &'a Problem, observation: &ImageObservation) -> Context<'a> {
    Context {
        block: &problem.block_context,
        image: &problem.image_contexts[observation.image as usize],
        column_px: observation.x,
        row_px: observation.y,
        surveyed: None,
    }
}

/// What an image effect gets.
fn image_input(point: &[f64; 2], frame: &Frame) -> [f64; IMAGE_INPUTS] {
    let mut input = [0.0; IMAGE_INPUTS];
    input[..IMAGE_INTERIOR].copy_from_slice(point);
    input[IMAGE_INTERIOR..].copy_from_slice(&frame.interior);
    input
}

fn predict_plain(frame: &Frame, object: &Vector3<f64>, out: &mut Prediction) -> Option<()> {
    let view = frame.view(object);
    let camera_point = view.camera_point();
    if camera_point[2] <= 0.0 {
        return None;
    }
    let prediction = view.predict(camera_point);
    (out.point, out.d_camera, out.d_point) = (prediction.point, prediction.d_camera, prediction.d_point);
    for ((pose, rotation), point) in out.d_pose.iter_mut().zip(&prediction.d_rotation).zip(&prediction.d_point) {
        pose[..3].copy_from_slice(rotation);
        pose[3..].copy_from_slice(&point.map(|d| -d));
    }
    Some(())
}

/// Numbers that an image effect gets.
const IMAGE_INPUTS: usize = Stage::Image.inputs();

/// Derivatives of an image effect that hands on what it gets, row by row.
const IMAGE_IDENTITY: [f64; 2 * IMAGE_INPUTS] = identity(2, 0);

/// `[0 I 0]` of so many rows, `I` from column `first` on.
pub(super) const fn identity<const N: usize>(rows: usize, first: usize) -> [f64; N] {
    let mut matrix = [0.0; N];
    let mut row = 0;
    while row < rows {
        matrix[row * (N / rows) + first + row] = 1.0;
        row += 1;
    }
    matrix
}

/// Image effects, one after the other: what was derived so far goes through each of them.
fn apply_image_effects(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    context: &Context<'_>,
    out: &mut Prediction,
) -> Option<()> {
    let own = |e: usize| stages.local_offset[e]..stages.local_offset[e] + problem.effects[e].slots.len();
    let Prediction { point, d_camera, d_pose, d_point, d_theta: [d_x, d_y], scratch } = out;
    let effects = stages.of(Stage::Image);
    for (position, &e) in effects.iter().enumerate() {
        let count = own(e).len();
        let mut next = [0.0; 2];
        let mut d_in = [0.0; 2 * IMAGE_INPUTS];
        scratch.d_own.resize(2 * count, 0.0);
        let (input, theta) = (image_input(point, frame), &frame.theta[own(e)]);
        let effect = &problem.effects[e].effect;
        effect.eval(context, &input, theta, &mut next, Some(&mut d_in), Some(&mut scratch.d_own)).ok()?;
        // At zero, where candidates are tested, an effect hands its input on.
        if d_in != IMAGE_IDENTITY {
            let (of_x, of_y) = d_in.split_at(IMAGE_INPUTS);
            let by_point = [[of_x[0], of_x[1]], [of_y[0], of_y[1]]];
            multiply(&by_point, d_pose);
            multiply(&by_point, d_point);
            multiply(&by_point, d_camera);
            for (row, of) in d_camera.iter_mut().zip([of_x, of_y]) {
                row.iter_mut().zip(&of[IMAGE_INTERIOR..]).for_each(|(sum, by_interior)| *sum += by_interior);
            }
            let before = effects[..position].iter().flat_map(|e| own(*e));
            for k in stages.ray_locals.iter().copied().chain(before) {
                [d_x[k], d_y[k]] = by_point.map(|[x, y]| x * d_x[k] + y * d_y[k]);
            }
        }
        let (of_x, of_y) = scratch.d_own.split_at(count);
        d_x[own(e)].copy_from_slice(of_x);
        d_y[own(e)].copy_from_slice(&of_y[..count]);
        *point = next;
    }
    Some(())
}

/// `rows <- by_point rows`.
fn multiply<const N: usize>(by_point: &[[f64; 2]; 2], rows: &mut [[f64; N]; 2]) {
    let [x, y] = *rows;
    for (row, [by_x, by_y]) in rows.iter_mut().zip(by_point) {
        *row = std::array::from_fn(|k| by_x * x[k] + by_y * y[k]);
    }
}

/// Derivatives by the interior orientation, so far by that after its effects, through those effects.
fn through_interior_effects(chain: &InteriorChain, out: &mut Prediction) {
    let Prediction { d_camera, d_pose, d_theta: [d_x, d_y], .. } = out;
    let [of_x, of_y] = &*d_camera;
    for (local, entry, value) in &chain.d_theta {
        d_x[*local] += value * of_x[*entry];
        d_y[*local] += value * of_y[*entry];
    }
    for (d_camera, d_pose) in d_camera.iter_mut().zip(d_pose) {
        let by_interior = SMatrix::<f64, 1, PARAMETER_COUNT>::from_row_slice(d_camera);
        if let Some(d_rotation) = &chain.d_rotation {
            let by_rotation = by_interior * d_rotation;
            d_pose.iter_mut().zip(by_rotation.iter()).for_each(|(sum, by_rotation)| *sum += by_rotation);
        }
        if let Some(d_interior) = &chain.d_interior {
            d_camera.copy_from_slice((by_interior * d_interior).as_slice());
        }
    }
}
