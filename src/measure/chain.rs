//! One image measurement through the whole chain, with its derivatives composed by hand.

use super::frame::{Frame, Stages, by_rows};
use super::lanes::{MISCLOSURE, POINT, ROTATION, THETA};
use super::plain::PlainView;
use super::ray::Ray;
use super::through::{
    BY_THETA, Derivatives, IMAGE_IDENTITY, IMAGE_INPUTS, through_image, through_interior, through_ray,
};
use crate::camera::{DCX, DCY, PARAMETER_COUNT, PPX, PPY, fraser};
use crate::effects::{Context, IMAGE_INTERIOR, Stage};
use crate::math::rotation;
use crate::problem::{ImageObservation, Problem};
use nalgebra::Vector3;

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
    work: Work,
}

impl Prediction {
    fn clear(&mut self, stages: &Stages) {
        for row in &mut self.d_theta {
            row.clear();
            row.resize(stages.local_len, 0.0);
        }
    }
}

impl Derivatives for Prediction {
    type Number = f64;

    #[inline(always)]
    fn get(&self, i: usize, place: usize) -> f64 {
        match place {
            _ if place < ROTATION => self.d_camera[i][place],
            _ if place < POINT => self.d_pose[i][place - ROTATION],
            _ if place < MISCLOSURE => self.d_point[i][place - POINT],
            _ => self.d_theta[i][place - THETA],
        }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, place: usize, value: f64) {
        match place {
            _ if place < ROTATION => self.d_camera[i][place] = value,
            _ if place < POINT => self.d_pose[i][place - ROTATION] = value,
            _ if place < MISCLOSURE => self.d_point[i][place - POINT] = value,
            _ => self.d_theta[i][place - THETA] = value,
        }
    }
}

/// Work space.
#[derive(Debug, Clone, Default)]
struct Work {
    ray: Ray,
    numbers: Vec<f64>,
    d_own: Vec<f64>,
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
        predict_plain(&frame.view(object), out)?;
    } else {
        let mut work = std::mem::take(&mut out.work);
        let Work { ray, numbers, .. } = &mut work;
        ray.bend(problem, stages, frame, &context, object)?;
        let view = PlainView { rotation: by_rows(&ray.rotation), centre: ray.centre.into(), ..frame.view(&ray.point) };
        predict_plain(&view, out)?;
        numbers.resize(BY_THETA + 6 * stages.ray_locals.len(), 0.0);
        ray.write(|k, value| numbers[k] = value);
        through_ray(out, numbers.as_slice(), true, &stages.ray_locals);
        out.work = work;
    }
    apply_image_effects(problem, stages, frame, &context, out)?;
    if let Some(chain) = &frame.interior_chain {
        through_interior(out, chain);
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
    let value = |e: usize, input: &[f64], out: &mut [f64]| {
        let theta = &frame.theta[stages.locals(problem, e)];
        problem.effects[e].effect.eval(&context, input, theta, out, None, None).ok()
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
        let theta = &frame.theta[stages.locals(problem, e)];
        let input = image_input(&point, frame);
        problem.effects[e].effect.eval(&context, &input, theta, &mut point, None, None).ok()?;
    }
    Some(point)
}

pub(super) fn context<'a>(problem: &'a Problem, observation: &ImageObservation) -> Context<'a> {
    Context {
        block: &problem.block_context,
        image: &problem.image_contexts[observation.image as usize],
        column_px: observation.x,
        row_px: observation.y,
        surveyed: None,
    }
}

/// What an image effect gets.
pub(super) fn image_input(point: &[f64; 2], frame: &Frame) -> [f64; IMAGE_INPUTS] {
    let mut input = [0.0; IMAGE_INPUTS];
    input[..IMAGE_INTERIOR].copy_from_slice(point);
    input[IMAGE_INTERIOR..].copy_from_slice(&frame.interior);
    input
}

fn predict_plain(view: &PlainView<f64>, out: &mut Prediction) -> Option<()> {
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

/// Image effects, one after the other: what was derived so far goes through each of them.
fn apply_image_effects(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    context: &Context<'_>,
    out: &mut Prediction,
) -> Option<()> {
    let mut d_own = std::mem::take(&mut out.work.d_own);
    for (position, &e) in stages.of(Stage::Image).iter().enumerate() {
        let own = stages.locals(problem, e);
        let mut d_in = [0.0; 2 * IMAGE_INPUTS];
        d_own.resize(2 * own.len(), 0.0);
        let (input, theta) = (image_input(&out.point, frame), &frame.theta[own.clone()]);
        let effect = &problem.effects[e].effect;
        effect.eval(context, &input, theta, &mut out.point, Some(&mut d_in), Some(&mut d_own)).ok()?;
        // At zero, where candidates are tested, an effect hands its input on.
        let identity = d_in == IMAGE_IDENTITY;
        through_image(out, (d_in.as_slice(), d_own.as_slice()), own, stages.before(problem, position), identity);
    }
    out.work.d_own = d_own;
    Some(())
}
