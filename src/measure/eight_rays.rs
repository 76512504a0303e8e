//! Eight rays side by side, with what effects are asked about them.

use super::chain::context;
use super::eight_rows::{One, Rows};
use super::frame::{Frame, Stages};
use super::interior_chain::InteriorChain;
use super::lanes::{CAMERA, THETA, Views};
use super::ray::Ray;
use super::rays::Rays;
use super::through::{Derivatives, through_interior};
use crate::effects::answer::{Answer, Inputs, Thetas};
use crate::effects::{Context, Stage};
use crate::math::lane::{LANES, Lane};
use crate::math::{Several, Wide, rotation};
use crate::problem::{ImageObservation, Problem};
use nalgebra::{Matrix3, Vector3};
use pulp::Simd;
use std::sync::Arc;

/// What is predicted, and of what: measurements and their frames.
pub struct Seen<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Its effects.
    pub stages: &'a Stages,
    /// Images.
    pub frames: &'a [Frame],
    /// Up to eight.
    pub observations: &'a [ImageObservation],
}

/// Eight rays. Where there are fewer, the first one pads the batch.
pub(super) struct Eight<'a, S> {
    pub(super) simd: S,
    problem: &'a Problem,
    stages: &'a Stages,
    count: usize,
    frames: [&'a Frame; LANES],
    contexts: [Context<'a>; LANES],
}

impl<'a, S: Simd> Eight<'a, S> {
    pub(super) fn new(simd: S, seen: &Seen<'a>) -> Self {
        let Seen { problem, stages, frames, observations } = *seen;
        let observation = |lane: usize| observations.get(lane).unwrap_or(&observations[0]);
        Self {
            simd,
            problem,
            stages,
            count: observations.len(),
            frames: std::array::from_fn(|lane| &frames[observation(lane).image as usize]),
            contexts: std::array::from_fn(|lane| context(problem, observation(lane).image as usize)),
        }
    }

    /// Takes these for the places of the measurements.
    pub(super) fn be_at(&mut self, [x, y]: &[Lane; 2]) {
        for (lane, context) in self.contexts.iter_mut().enumerate() {
            (context.column_px, context.row_px) = (x[lane], y[lane]);
        }
    }

    /// Sets `views` to what the camera sees of the rays.
    #[inline(always)]
    pub(super) fn see(&self, views: &mut Views, ray: &Ray<Lane>) {
        views.set_ray(&ray.centre, &ray.point);
        if ray.turned {
            views.set_rotation(&self.matrices(&ray.rotation_vector, rotation::exp));
        }
    }

    /// From derivatives by interior orientations after their effects to those by that before them.
    #[inline(always)]
    pub(super) fn through_interiors(&self, views: &Views, rows: &mut [Vec<Lane>; 2]) {
        let Some(first) = self.frames[0].interior_chain.as_deref() else { return };
        // Most effects add to the same few numbers.
        if self.frames[0].adds_few {
            self.add_interiors(first, |k| views.behind_interior(k), rows);
            return;
        }
        let mut chains = [first; LANES];
        let mut add_alike = true;
        for (chain, frame) in chains.iter_mut().zip(self.frames) {
            // Images that are prepared together all have one, or none has.
            let Some(own) = frame.interior_chain.as_deref() else { return };
            add_alike &= own.adds() && Arc::ptr_eq(&own.places, &first.places);
            *chain = own;
        }
        if add_alike {
            let values = |k: usize| {
                let mut values = Lane::default();
                for lane in 0..LANES {
                    values[lane] = chains[lane].d_theta[k];
                }
                values
            };
            self.add_interiors(first, values, rows);
            return;
        }
        for (lane, chain) in chains.into_iter().enumerate() {
            through_interior(&mut One { lane, rows: &mut *rows }, chain);
        }
    }

    /// The same where effects add to the numbers that `chain` has the places of; `values` are the derivatives by place.
    #[inline(always)]
    fn add_interiors(&self, chain: &InteriorChain, values: impl Fn(usize) -> Lane, rows: &mut [Vec<Lane>; 2]) {
        let mut rows = Rows::new(self.simd, rows);
        for (k, (local, entry)) in chain.places.iter().enumerate() {
            for i in 0..2 {
                let by_theta = rows.get(i, THETA + local);
                rows.set(i, THETA + local, by_theta + by_theta.of(values(k)) * rows.get(i, CAMERA + entry));
            }
        }
    }

    /// `Err`: the place of the first that is not.
    #[inline(always)]
    pub(super) fn in_front(&self, depth: &Lane) -> Result<(), usize> {
        (0..self.count).find(|lane| depth[*lane] <= 0.0).map_or(Ok(()), Err)
    }
}

impl<S: Simd> Rays for Eight<'_, S> {
    type Number = Wide<S>;

    #[inline(always)]
    fn seed(&self) -> Wide<S> {
        Wide { simd: self.simd, lane: Lane::default() }
    }

    #[inline(always)]
    fn of_frames(&self, number: impl Fn(&Frame) -> f64) -> Lane {
        let mut lane = Lane::default();
        for (slot, frame) in lane.iter_mut().zip(self.frames) {
            *slot = number(frame);
        }
        lane
    }

    fn matrices(&self, vector: &[Lane; 3], matrix: fn(&Vector3<f64>) -> Matrix3<f64>) -> [Lane; 9] {
        let mut rows = [Lane::default(); 9];
        for lane in 0..LANES {
            let matrix = matrix(&Vector3::from(vector.map(|number| number[lane])));
            for (k, slot) in rows.iter_mut().enumerate() {
                slot[lane] = matrix[(k / 3, k % 3)];
            }
        }
        rows
    }

    fn ask(&self, e: usize, input: &[Lane], answer: &mut Answer<'_, Lane>) -> Result<Inputs, usize> {
        let own = self.stages.locals(self.problem, e);
        let effect = &self.problem.effects[e].effect;
        let first = &self.frames[0].theta[own.clone()];
        if self.stages.alike[e] {
            return effect.eval_eight(&self.contexts, input, &Thetas::Alike(first), answer);
        }
        // Not by mapping the frames: a closure would be called eight times.
        let mut thetas = [first; LANES];
        for lane in 1..LANES {
            thetas[lane] = &self.frames[lane].theta[own.clone()];
        }
        effect.eval_eight(&self.contexts, input, &Thetas::Own(&thetas), answer)
    }

    fn by_place(&self, e: usize, input: &[Lane], axis: usize, derivative: &mut [Lane]) -> Result<(), usize> {
        /// The most inputs and outputs of stages that have a place.
        const INPUTS: usize = Stage::Image.inputs();
        const OUTPUTS: usize = Stage::Exposure.outputs();
        let (own, effect) = (self.stages.locals(self.problem, e), &self.problem.effects[e].effect);
        let (mut one, mut by) = ([0.0; INPUTS], [0.0; OUTPUTS]);
        let by = &mut by[..derivative.len()];
        for lane in 0..LANES {
            one.iter_mut().zip(input).for_each(|(to, from)| *to = from[lane]);
            let theta = &self.frames[lane].theta[own.clone()];
            effect.by_place(&self.contexts[lane], &one[..input.len()], theta, axis, by).map_err(|_| lane)?;
            derivative.iter_mut().zip(&*by).for_each(|(to, value)| to[lane] = *value);
        }
        Ok(())
    }
}
