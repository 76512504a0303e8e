//! Every image measurement at the fit, by itself: residual, and how much of it the point leaves.

use super::NullModel;
use crate::adjust::AdjustError;
use crate::adjust::native::point::inverse_of_damped;
use crate::adjust::native::pool;
use crate::measure::{self, Frame, Prediction, Stages};
use crate::problem::{Problem, State};
use nalgebra::{Matrix2, Matrix2x3, Matrix2x6, Matrix3};
use rayon::ThreadPool;
use rayon::prelude::*;

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
    Ok(Fitted { problem, state, acting: &acting, frames: &frames }.measurements(&pool(threads)?))
}

impl NullModel {
    /// Every image measurement, in the order of the problem.
    pub fn measurements(&self) -> Vec<Local> {
        let Self { problem, state, acting, frames, pool, .. } = self;
        Fitted { problem, state, acting, frames }.measurements(pool)
    }
}

/// A state, prepared for predictions.
struct Fitted<'a> {
    problem: &'a Problem,
    state: &'a State,
    acting: &'a Stages,
    frames: &'a [Frame],
}

impl Fitted<'_> {
    fn measurements(&self, pool: &ThreadPool) -> Vec<Local> {
        let points: Vec<usize> = (0..self.problem.point_sources.len()).collect();
        pool.install(|| points.par_chunks(POINTS).flat_map_iter(|points| self.of_points(points)).collect())
    }

    fn of_points(&self, points: &[usize]) -> Vec<Local> {
        let Self { problem, state, acting, frames } = self;
        let mut prediction = Prediction::default();
        let mut measurements = Vec::new();
        for &j in points {
            let first = measurements.len();
            let mut by_point: Vec<Matrix2x3<f64>> = Vec::new();
            let mut normal = Matrix3::zeros();
            for observation in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
                let (image, weight) = (observation.image as usize, observation.inverse_sigma);
                let object = &state.points[j];
                // The state was linearised: what it holds can be predicted.
                let known = measure::predict(problem, acting, &frames[image], observation, object, &mut prediction);
                let p = &prediction;
                let free = |k: usize| known.is_some() && problem.pose_free[image][k];
                let own = Matrix2x3::from_fn(|i, k| if known.is_some() { p.d_point[i][k] * weight } else { 0.0 });
                normal += own.transpose() * own;
                by_point.push(own);
                measurements.push(Local {
                    predicted: p.point,
                    residual: [observation.x - p.point[0], observation.y - p.point[1]],
                    redundancy: Matrix2::identity(),
                    by_pose: Matrix2x6::from_fn(|i, k| if free(k) { -p.d_pose[i][k] * weight } else { 0.0 }),
                });
            }
            if let Ok(c) = problem.control.binary_search_by_key(&(j as u32), |observation| observation.index) {
                normal += Matrix3::from_diagonal(&problem.control[c].sigma.map(|sigma| sigma.powi(-2)));
            }
            let inverse = inverse_of_damped(&normal, 0.0).unwrap_or_else(Matrix3::zeros);
            for (local, own) in measurements[first..].iter_mut().zip(&by_point) {
                local.redundancy -= own * inverse * own.transpose();
            }
        }
        measurements
    }
}
