//! One image measurement through the whole chain, with its derivatives composed by hand.

use super::frame::{Frame, Stages, by_rows};
use super::lanes::{MISCLOSURE, POINT, ROTATION, THETA};
use super::matrices::changes;
use super::plain::PlainView;
use super::ray::Ray;
use super::rays::Rays;
use super::through::{Derivatives, IMAGE_INPUTS, through_image, through_interior, through_ray};
use crate::camera::{DCX, DCY, PARAMETER_COUNT, PPX, PPY, fraser};
use crate::effects::answer::{Answer, Inputs};
use crate::effects::{Context, IMAGE_INTERIOR, Stage};
use crate::math::rotation;
use crate::problem::{ImageObservation, Problem};
use nalgebra::{Matrix3, Vector3};

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
    ray: Ray<f64>,
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
        let mut ray = std::mem::take(&mut out.work.ray);
        let one = One { problem, stages, frame, context };
        ray.bend(&one, stages, &frame.pose(), &(*object).into()).ok()?;
        predict_plain(&one.view(&ray), out)?;
        through_ray(out, &ray, &stages.ray_locals);
        out.work.ray = ray;
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
    let mut ray = Ray::default();
    let one = One { problem, stages, frame, context };
    ray.shift(&one, stages, (&frame.pose(), &(*object).into()), false).ok()?;
    let view = one.view(&ray);
    let point = fraser::project(&view.interior, view.camera_point())?;
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

/// One ray.
struct One<'a> {
    problem: &'a Problem,
    stages: &'a Stages,
    frame: &'a Frame,
    context: Context<'a>,
}

impl One<'_> {
    /// What the camera sees of the ray.
    fn view(&self, ray: &Ray<f64>) -> PlainView<f64> {
        let rotation = match ray.turned {
            true => by_rows(&rotation::exp(&Vector3::from(ray.rotation_vector))),
            false => by_rows(&self.frame.rotation),
        };
        PlainView { rotation, centre: ray.centre, object: ray.point, interior: self.frame.interior }
    }
}

impl Rays for One<'_> {
    type Number = f64;

    fn seed(&self) -> f64 {
        0.0
    }

    fn of_frames(&self, number: impl Fn(&Frame) -> f64) -> f64 {
        number(self.frame)
    }

    fn matrices(&self, vector: &[f64; 3], matrix: fn(&Vector3<f64>) -> Matrix3<f64>) -> [f64; 9] {
        let matrix = matrix(&Vector3::from(*vector));
        std::array::from_fn(|k| matrix[(k / 3, k % 3)])
    }

    fn ask(&self, e: usize, input: &[f64], answer: &mut Answer<'_, f64>) -> Result<Inputs, usize> {
        let theta = &self.frame.theta[self.stages.locals(self.problem, e)];
        let Answer { out, d_input, d_theta } = answer;
        let (d_input, d_theta) = (d_input.as_deref_mut(), d_theta.as_deref_mut());
        self.problem.effects[e].effect.eval(&self.context, input, theta, out, d_input, d_theta).map_err(|_| 0usize)?;
        Ok(Inputs::ANY)
    }
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
        let inputs = if changes(0.0, &d_in, 2, 0, Inputs::ANY) { Inputs::ANY } else { Inputs::NONE };
        through_image(out, (&d_in, &d_own), own, stages.before(problem, position), inputs);
    }
    out.work.d_own = d_own;
    Some(())
}
