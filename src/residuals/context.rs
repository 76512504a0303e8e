//! What the tests share: the fit, its noise, and the residuals of the antennas.

use super::place::Place;
use crate::adjust::AdjustError;
use crate::adjust::native::pool::Pool;
use crate::measure::Predictor;
use crate::null_model::Local;
use crate::problem::{Problem, State};
use crate::score::variance_factor;
use nalgebra::{Matrix6, Vector3};
use rayon::prelude::*;

/// Points whose places are looked at together.
const PIECE: usize = 4096;

/// What a group of residuals has without the columns that are tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    pub(super) sum_of_squares: f64,
    pub(super) degrees: f64,
}

/// What the tests share.
pub(super) struct Context<'a> {
    pub(super) problem: &'a Problem,
    pub(super) state: &'a State,
    pub(super) measurements: &'a [Local],
    /// That of the image measurements. Cameras and poses are taken as known from these alone until the redundancy of
    /// the positions is known ([`super::Layout::analyse`]).
    pub(super) noise: Noise,
    pub(super) antenna_residuals: Vec<Vector3<f64>>,
    /// Covariance of each image's pose (rotation `w`, projection centre) from its own measurements and its antenna, the
    /// other images held.
    pub(super) pose_covariances: Vec<Matrix6<f64>>,
    pub(super) gnss_noise: Noise,
    /// Its threads are those that the tests have.
    pub(super) pool: Pool,
}

impl<'a> Context<'a> {
    /// Image of a measurement.
    pub(super) fn image(&self, measurement: usize) -> usize {
        self.problem.observations[measurement].image as usize
    }

    pub(super) fn new(
        problem: &'a Problem,
        state: &'a State,
        measurements: &'a [Local],
        threads: usize,
    ) -> Result<Self, AdjustError> {
        let squares = problem.observations.iter().zip(measurements).map(|(observation, local)| {
            (local.residual[0].powi(2) + local.residual[1].powi(2)) * observation.inverse_sigma.powi(2)
        });
        let shared = problem.free().iter().take(problem.layout().point(0, 0)).filter(|free| **free).count();
        let by_points: f64 = measurements.iter().map(|local| local.redundancy.trace()).sum();
        let degrees = by_points - shared as f64;
        let predictor = Predictor::new(problem, state)?;
        let antenna_residuals = problem.gnss.iter().map(|observation| {
            let computed = predictor.antenna(observation.index as usize);
            computed.map_or_else(Vector3::zeros, |computed| observation.position - computed)
        });
        let antenna_residuals: Vec<Vector3<f64>> = antenna_residuals.collect();
        let mut antenna_normals = vec![Matrix6::zeros(); problem.image_contexts.len()];
        for observation in &problem.gnss {
            let image = observation.index as usize;
            let Some(mut by_pose) = predictor.antenna_by_pose(image) else { continue };
            for (k, mut column) in by_pose.column_iter_mut().enumerate() {
                let free = if problem.pose_free[image][k] { 1.0 } else { 0.0 };
                column.component_mul_assign(&observation.sigma.map(|sigma| free / sigma));
            }
            antenna_normals[image] += by_pose.transpose() * by_pose;
        }
        let mut pose_normals = antenna_normals;
        for (observation, local) in problem.observations.iter().zip(measurements) {
            pose_normals[observation.image as usize] += local.by_pose.transpose() * local.redundancy * local.by_pose;
        }
        let of_gnss = problem.gnss.iter().zip(&antenna_residuals);
        let sum_of_squares = of_gnss.map(|(observation, d)| d.component_div(&observation.sigma).norm_squared()).sum();
        Ok(Self {
            problem,
            state,
            measurements,
            noise: Noise { sum_of_squares: squares.sum(), degrees },
            antenna_residuals,
            pose_covariances: pose_normals.iter().map(inverse_where_determined).collect(),
            gnss_noise: Noise { sum_of_squares, degrees: f64::NAN },
            pool: Pool::new(threads)?,
        })
    }

    /// Variance factor of the image measurements.
    pub(super) fn variance(&self) -> f64 {
        variance_factor(self.noise.sum_of_squares, self.noise.degrees)
    }

    /// What `of_piece` makes of the places of all measurements, with their residuals (px), some points at a time, in
    /// the order of the problem: in pieces that do not depend on the number of threads.
    pub(super) fn in_pieces<T: Send>(
        &self,
        of_piece: impl Fn(&mut dyn Iterator<Item = (Place, [f64; 2])>) -> T + Sync,
    ) -> Vec<T> {
        let Self { problem, state, measurements, .. } = self;
        let of_point = |j: usize| {
            (problem.point_start[j]..problem.point_start[j + 1]).map(move |k| {
                let Local { predicted, residual, .. } = measurements[k];
                (Place::new(problem, state, &problem.observations[k], predicted, &state.points[j]), residual)
            })
        };
        let firsts: Vec<usize> = (0..state.points.len()).step_by(PIECE).collect();
        let of_points = |first: usize| {
            let end = (first + PIECE).min(state.points.len());
            of_piece(&mut (first..end).flat_map(of_point))
        };
        self.pool.install(|| firsts.into_par_iter().map(of_points).collect())
    }
}

/// Smallest eigenvalue of a normal matrix of unit diagonal that is more than rounding.
const LEAST_EIGENVALUE: f64 = 1e-10;

/// Inverse of a normal matrix, zero in directions that it does not determine: unknowns that are held, poses of too few
/// measurements.
fn inverse_where_determined(normal: &Matrix6<f64>) -> Matrix6<f64> {
    let scale = normal.diagonal().map(|diagonal| if diagonal > 0.0 { diagonal.sqrt().recip() } else { 0.0 });
    let unit = Matrix6::from_fn(|i, j| scale[i] * normal[(i, j)] * scale[j]);
    let mut eigen = unit.symmetric_eigen();
    eigen.eigenvalues.apply(|value| *value = if *value > LEAST_EIGENVALUE { value.recip() } else { 0.0 });
    let inverse = eigen.recompose();
    Matrix6::from_fn(|i, j| scale[i] * inverse[(i, j)] * scale[j])
}
