//! Eight measurements through effects: each effect is asked one by one, what follows from its answers is computed side
//! by side.

use super::chain::{context, image_input};
use super::frame::{Frame, Stages, plain};
use super::lane::{LANES, Lane};
use super::lanes::{Predictions, Register, THETA, Views};
use super::ray::Ray;
use super::through::{
    BY_THETA, Derivatives, IMAGE_IDENTITY, IMAGE_INPUTS, Numbers, through_image, through_interior, through_ray,
};
use crate::effects::Stage;
use crate::problem::{ImageObservation, Problem};
use nalgebra::Vector3;
use pulp::Simd;

/// Work space for what effects answer.
#[derive(Debug, Clone, Default)]
pub struct Answers {
    ray: Ray,
    of_ray: Vec<Lane>,
    d_in: Vec<Lane>,
    d_own: Vec<Lane>,
    own: Vec<f64>,
}

/// What is predicted, and of what: measurements, their frames, and the points that they see.
pub struct Seen<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Its effects.
    pub stages: &'a Stages,
    /// Images.
    pub frames: &'a [Frame],
    /// Up to eight.
    pub observations: &'a [ImageObservation],
    /// The point of each.
    pub objects: [Vector3<f64>; LANES],
}

impl Seen<'_> {
    /// Predicts them, given the `views` of straight rays. `Err`: the place of one that lies behind its camera, or
    /// outside an effect's domain.
    #[inline(always)]
    pub fn predict<S: Simd>(
        &self,
        simd: S,
        views: &mut Views,
        out: &mut Predictions,
        answers: &mut Answers,
    ) -> Result<(), usize> {
        let Self { problem, stages, frames, observations, .. } = self;
        for row in &mut out.rows {
            row[THETA..].fill(Lane::default());
        }
        let turns = if stages.straight() { false } else { self.bend(simd, views, answers)? };
        views.predict(simd, out);
        if let Some(lane) = (0..observations.len()).find(|lane| out.depth[*lane] <= 0.0) {
            return Err(lane);
        }
        if !stages.straight() {
            for piece in 0..LANES / S::F64_LANES {
                let numbers = Piece { simd, piece, of: &*answers.of_ray };
                through_ray(&mut Piece { simd, piece, of: &mut out.rows }, &numbers, turns, &stages.ray_locals);
            }
        }
        for (position, &e) in stages.of(Stage::Image).iter().enumerate() {
            let identity = self.ask_image(e, out, answers)?;
            for piece in 0..LANES / S::F64_LANES {
                let answers = (&Piece { simd, piece, of: &*answers.d_in }, &Piece { simd, piece, of: &*answers.d_own });
                let (own, before) = (stages.locals(problem, e), stages.before(problem, position));
                through_image(&mut Piece { simd, piece, of: &mut out.rows }, answers, own, before, identity);
            }
        }
        for (lane, observation) in observations.iter().enumerate() {
            if let Some(chain) = &frames[observation.image as usize].interior_chain {
                through_interior(&mut One { lane, rows: &mut out.rows }, chain);
            }
        }
        if problem.tie_dc_to_pp {
            out.tie_centre();
        }
        Ok(())
    }

    /// Sends the rays through the effects before the camera, and sets `views` to what comes of that; whether any turns
    /// the camera.
    #[inline(always)]
    fn bend<S: Simd>(&self, simd: S, views: &mut Views, answers: &mut Answers) -> Result<bool, usize> {
        let Answers { ray, of_ray, .. } = answers;
        of_ray.resize(BY_THETA + 6 * self.stages.ray_locals.len(), Lane::default());
        let mut turns = false;
        for (lane, object) in self.objects.iter().enumerate() {
            // Places that are left over see what the last one sees.
            if let Some(observation) = self.observations.get(lane) {
                let (frame, context) = (&self.frames[observation.image as usize], context(self.problem, observation));
                ray.bend(self.problem, self.stages, frame, &context, object).ok_or(lane)?;
                ray.write(|k, value| of_ray[k][lane] = value);
                turns |= ray.turns;
            }
            views.set(simd, lane, &plain(&ray.rotation, &ray.centre), &ray.point);
        }
        views.turn(simd);
        Ok(turns)
    }

    /// Asks an image effect about each; whether it hands on what it gets.
    fn ask_image(&self, e: usize, out: &mut Predictions, answers: &mut Answers) -> Result<bool, usize> {
        let (effect, places) = (&self.problem.effects[e].effect, self.stages.locals(self.problem, e));
        let Answers { d_in: in_lanes, d_own: own_lanes, own, .. } = answers;
        in_lanes.resize(2 * IMAGE_INPUTS, Lane::default());
        own_lanes.resize(own_lanes.len().max(2 * places.len()), Lane::default());
        own.resize(2 * places.len(), 0.0);
        let mut identity = true;
        for (lane, observation) in self.observations.iter().enumerate() {
            let frame = &self.frames[observation.image as usize];
            let input = image_input(&[out.point[0][lane], out.point[1][lane]], frame);
            let (mut next, mut d_in) = ([0.0; 2], [0.0; 2 * IMAGE_INPUTS]);
            let (context, theta) = (context(self.problem, observation), &frame.theta[places.clone()]);
            effect.eval(&context, &input, theta, &mut next, Some(&mut d_in), Some(own)).map_err(|_| lane)?;
            identity &= d_in == IMAGE_IDENTITY;
            in_lanes.iter_mut().zip(d_in).for_each(|(to, value)| to[lane] = value);
            own_lanes.iter_mut().zip(&*own).for_each(|(to, value)| to[lane] = *value);
            (out.point[0][lane], out.point[1][lane]) = (next[0], next[1]);
        }
        Ok(identity)
    }
}

/// What of lanes is in one register.
struct Piece<S: Simd, T> {
    simd: S,
    piece: usize,
    of: T,
}

impl<S: Simd> Derivatives for Piece<S, &mut [Vec<Lane>; 2]> {
    type Number = Register<S>;

    #[inline(always)]
    fn get(&self, i: usize, place: usize) -> Register<S> {
        Register { simd: self.simd, value: self.of[i][place].get::<S>(self.piece) }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, place: usize, value: Register<S>) {
        self.of[i][place].set::<S>(self.piece, value.value);
    }
}

impl<S: Simd> Numbers<Register<S>> for Piece<S, &[Lane]> {
    #[inline(always)]
    fn at(&self, k: usize) -> Register<S> {
        Register { simd: self.simd, value: self.of[k].get::<S>(self.piece) }
    }
}

/// One measurement of eight.
struct One<'a> {
    lane: usize,
    rows: &'a mut [Vec<Lane>; 2],
}

impl Derivatives for One<'_> {
    type Number = f64;

    #[inline(always)]
    fn get(&self, i: usize, place: usize) -> f64 {
        self.rows[i][place][self.lane]
    }

    #[inline(always)]
    fn set(&mut self, i: usize, place: usize, value: f64) {
        self.rows[i][place][self.lane] = value;
    }
}
