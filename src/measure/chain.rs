//! One image measurement through the whole chain, with its derivatives composed by hand.

use super::frame::{Frame, Stages, by_rows};
use super::lanes::{MISCLOSURE, POINT, ROTATION, THETA};
use super::matrices::changes;
use super::place::{ANSWERS_AHEAD, MOST_MOVES, Search, follow_place, is_near};
use super::plain::PlainView;
use super::ray::Ray;
use super::rays::Rays;
use super::through::{Derivatives, IMAGE_INPUTS, add_by_place, through_image, through_interior, through_ray};
use crate::camera::{DCX, DCY, PARAMETER_COUNT, PPX, PPY, fraser};
use crate::effects::answer::{Answer, Inputs};
use crate::effects::{Context, IMAGE_INTERIOR, Stage};
use crate::math::rotation;
use crate::problem::Problem;
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
            row.resize(stages.row_len(), 0.0);
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

/// Predicts the image point of `object` in image number `image`, that of `frame`. `None`: behind the camera, or
/// outside an effect's domain.
pub fn predict(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    image: usize,
    object: &Vector3<f64>,
    out: &mut Prediction,
) -> Option<()> {
    let mut one = One { problem, stages, frame, context: context(problem, image) };
    if stages.place_axes.is_empty() {
        one.predict_there(object, out)?;
    } else {
        one.find_place(object, out)?;
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

/// One ray.
struct One<'a> {
    problem: &'a Problem,
    stages: &'a Stages,
    frame: &'a Frame,
    context: Context<'a>,
}

impl One<'_> {
    /// Predicts at the place of its context.
    fn predict_there(&self, object: &Vector3<f64>, out: &mut Prediction) -> Option<()> {
        let Self { stages, frame, .. } = *self;
        out.clear(stages);
        if stages.straight() {
            predict_plain(&frame.view(object), out)?;
        } else {
            let mut ray = std::mem::take(&mut out.work.ray);
            ray.bend(self, stages, &frame.pose(), &(*object).into()).ok()?;
            predict_plain(&self.view(&ray), out)?;
            through_ray(out, &ray, &stages.ray_locals);
            out.work.ray = ray;
        }
        self.apply_image_effects(out)?;
        if let Some(chain) = &frame.interior_chain {
            through_interior(out, chain);
        }
        Some(())
    }

    /// Predicts at the place at which the chain ends; see [`super::place`].
    fn find_place(&mut self, object: &Vector3<f64>, out: &mut Prediction) -> Option<()> {
        let stages = self.stages;
        let plain = self.frame.view(object);
        let mut search = Search::from(fraser::project(&plain.interior, plain.camera_point())?);
        for _ in 0..ANSWERS_AHEAD {
            self.be_at(search.at);
            search.tell(stages, self.point_there(object)?);
        }
        let mut at = search.place();
        for _ in 0..MOST_MOVES {
            self.be_at(at);
            self.predict_there(object, out)?;
            let end = out.point;
            let own = follow_place(out, stages, &at, &end).ok()?;
            if is_near(stages, at, end) {
                out.point = own;
                return Some(());
            }
            at = own;
        }
        None
    }

    fn be_at(&mut self, [column_px, row_px]: [f64; 2]) {
        self.context = Context { column_px, row_px, ..self.context };
    }

    /// The image point at the place of its context, alone.
    fn point_there(&self, object: &Vector3<f64>) -> Option<[f64; 2]> {
        let Self { problem, stages, frame, context } = self;
        let mut ray = Ray::default();
        ray.shift(self, stages, (&frame.pose(), &(*object).into()), false).ok()?;
        let view = self.view(&ray);
        let mut point = fraser::project(&view.interior, view.camera_point())?;
        for &e in stages.of(Stage::Image) {
            let theta = &frame.theta[stages.locals(problem, e)];
            let input = image_input(&point, frame);
            problem.effects[e].effect.eval(context, &input, theta, &mut point, None, None).ok()?;
        }
        Some(point)
    }

    /// Image effects, one after the other: what was derived so far goes through each of them.
    fn apply_image_effects(&self, out: &mut Prediction) -> Option<()> {
        let Self { problem, stages, frame, context } = self;
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
            add_by_place(out, self, stages, e, &input).ok()?;
        }
        out.work.d_own = d_own;
        Some(())
    }

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

    fn by_place(&self, e: usize, input: &[f64], axis: usize, derivative: &mut [f64]) -> Result<(), usize> {
        let theta = &self.frame.theta[self.stages.locals(self.problem, e)];
        self.problem.effects[e].effect.by_place(&self.context, input, theta, axis, derivative).map_err(|_| 0usize)
    }
}

/// The context of a measurement in an image, at no place yet.
pub(super) fn context(problem: &Problem, image: usize) -> Context<'_> {
    let (block, image, unknown) = (&problem.block_context, &problem.image_contexts[image], f64::NAN);
    Context { block, image, column_px: unknown, row_px: unknown, surveyed: None }
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
