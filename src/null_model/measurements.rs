//! Every image measurement at the fit, by itself: residual, and how much of it the point leaves.

use super::NullModel;
use super::rows::Linearise;
use super::source::EffectEntry;
use crate::adjust::AdjustError;
use crate::adjust::native::for_null_model::{Cameras, Contents, Eights, Pool, Workspace, inverse_of_damped};
use crate::math::vectors::dispatch;
use crate::measure::lanes::{POINT, ROTATION};
use crate::measure::{self, Frame, Stages};
use crate::problem::{Problem, State};
use nalgebra::{Matrix2, Matrix2x3, Matrix2x6, Matrix3, Vector2};
use rayon::prelude::*;
use std::array::from_fn;
use std::ops::Range;

/// An image measurement at the fit.
#[derive(Debug, Clone, Copy)]
pub struct Local {
    /// Predicted, px.
    pub predicted: [f64; 2],
    /// Observed minus computed, px.
    pub residual: [f64; 2],
    /// Local redundancy `I - J V^-1 J'P`, cameras held.
    pub redundancy: Matrix2<f64>,
    /// By the pose of its image (rotation `w`, projection centre), standardised; zero where that is held.
    pub by_pose: Matrix2x6<f64>,
}

/// Points of a task.
const POINTS: usize = 256;

/// Every image measurement at a state, in the order of the problem: nothing needs to be factorised for it.
///
/// # Errors
/// A state that cannot be predicted.
pub fn measurements_at(problem: &Problem, state: &State, threads: usize) -> Result<Vec<Local>, AdjustError> {
    let acting = Stages::acting(problem, state);
    let frames = measure::frames(problem, &acting, state)?;
    Fitted { problem, state, stages: &acting, frames: &frames, entries: None }.all(&Pool::new(threads)?)
}

impl NullModel {
    /// Every image measurement, in the order of the problem.
    ///
    /// # Errors
    /// One that cannot be predicted.
    pub fn measurements(&self) -> Result<Vec<Local>, AdjustError> {
        let Self { problem, state, acting, frames, pool, .. } = self;
        Fitted { problem, state, stages: acting, frames, entries: None }.all(pool)
    }

    /// The same in parts, one behind another, and of each measurement the standardised derivatives by the `entries` of
    /// its image, effects of `stages`.
    pub(super) fn measurements_by(
        &self,
        stages: &Stages,
        entries: &[Vec<EffectEntry>],
    ) -> Result<Vec<Measured>, AdjustError> {
        let Self { problem, state, frames, pool, .. } = self;
        Fitted { problem, state, stages, frames, entries: Some(entries) }.parts(pool)
    }
}

/// A state, prepared for predictions.
struct Fitted<'a> {
    problem: &'a Problem,
    state: &'a State,
    stages: &'a Stages,
    frames: &'a [Frame],
    /// Parameters by image whose derivatives are wanted.
    entries: Option<&'a [Vec<EffectEntry>]>,
}

/// Measurements, and their derivatives by the entries of their images, behind one another.
pub(super) type Measured = (Vec<Local>, Vec<Vector2<f64>>);

impl Fitted<'_> {
    fn all(&self, pool: &Pool) -> Result<Vec<Local>, AdjustError> {
        let locals: Vec<Vec<Local>> = self.parts(pool)?.into_iter().map(|(locals, _)| locals).collect();
        Ok(locals.concat())
    }

    /// Of some points each, in the order of the problem.
    fn parts(&self, pool: &Pool) -> Result<Vec<Measured>, AdjustError> {
        let count = self.problem.point_sources.len();
        let tasks: Vec<Range<usize>> =
            (0..count).step_by(POINTS).map(|first| first..(first + POINTS).min(count)).collect();
        pool.install(|| tasks.into_par_iter().map(|points| self.of_points(points)).collect())
    }

    fn of_points(&self, points: Range<usize>) -> Result<Measured, AdjustError> {
        let Self { problem, state, stages, frames, entries } = self;
        let cameras = Cameras { problem, stages, frames };
        let mut work = Workspace::new(stages);
        let mut eights = Eights::new(cameras, &state.points[points.clone()], points.clone(), &mut work.views);
        let (mut locals, mut rows): Measured = Default::default();
        let mut by_point: Vec<Matrix2x3<f64>> = Vec::new();
        while dispatch(Linearise { cameras, work: &mut work, eights: &mut eights })? {
            let Workspace { eight, predictions, .. } = &work;
            for (lane, number) in eight.numbers.clone().enumerate() {
                let observation = &problem.observations[number];
                // Robust weights are not applied.
                let (image, weight) = (observation.image as usize, observation.inverse_sigma);
                let derivative = |i: usize, place: usize| predictions.rows[i][place][lane] * weight;
                let free = problem.pose_free[image];
                by_point.push(Matrix2x3::from_fn(|i, k| derivative(i, POINT + k)));
                let predicted: [f64; 2] = from_fn(|i| predictions.point[i][lane]);
                locals.push(Local {
                    predicted,
                    residual: [observation.x - predicted[0], observation.y - predicted[1]],
                    redundancy: Matrix2::identity(),
                    by_pose: Matrix2x6::from_fn(|i, k| if free[k] { derivative(i, ROTATION + k) } else { 0.0 }),
                });
                let wanted = entries.iter().flat_map(|entries| &entries[image]);
                rows.extend(wanted.map(|entry| {
                    let place = Contents::place_of(entry.source);
                    Vector2::new(derivative(0, place), derivative(1, place)) * entry.scale
                }));
            }
        }
        let first = problem.point_start[points.start];
        for j in points {
            let own = problem.point_start[j] - first..problem.point_start[j + 1] - first;
            let mut normal: Matrix3<f64> = by_point[own.clone()].iter().map(|own| own.transpose() * own).sum();
            if let Ok(c) = problem.control.binary_search_by_key(&(j as u32), |observation| observation.index) {
                normal += Matrix3::from_diagonal(&problem.control[c].sigma.map(|sigma| sigma.powi(-2)));
            }
            let inverse = inverse_of_damped(&normal, 0.0).unwrap_or_else(Matrix3::zeros);
            for (local, own) in locals[own.clone()].iter_mut().zip(&by_point[own]) {
                local.redundancy -= own * inverse * own.transpose();
            }
        }
        Ok((locals, rows))
    }
}
