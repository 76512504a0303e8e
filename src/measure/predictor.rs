//! Predictions at a fixed state, for those who compare: image points, surveyed coordinates, antennas.

use super::chain::{self, Prediction};
use super::frame::{self, Frame, Stages};
use super::{MeasureError, position};
use crate::camera::undistort::viewing_ray;
use crate::problem::{ImageObservation, MeasurementKind, Problem, State};
use nalgebra::{Matrix2x3, Matrix3x6, Vector3};
use std::cell::RefCell;

thread_local! {
    /// Work space, which is dear to ask for at every measurement.
    static BUFFER: RefCell<Prediction> = RefCell::default();
}

/// Predicts measurements at a state, effects included.
pub struct Predictor<'a> {
    problem: &'a Problem,
    state: &'a State,
    stages: Stages,
    frames: Vec<Frame>,
}

impl<'a> Predictor<'a> {
    /// Prepares every image. Errors: an interior effect outside its domain.
    pub fn new(problem: &'a Problem, state: &'a State) -> Result<Self, MeasureError> {
        let stages = Stages::acting(problem, state);
        let frames = frame::frames(problem, &stages, state)?;
        Ok(Self { problem, state, stages, frames })
    }

    /// Image point (px) of a world point, and its derivative by the point (px/m); `observed` is where it was measured (effects of the row
    /// need it). `None`: behind the camera or outside an effect's domain.
    pub fn image_point(
        &self,
        image: usize,
        observed: [f64; 2],
        point: &Vector3<f64>,
    ) -> Option<([f64; 2], Matrix2x3<f64>)> {
        let observation = ImageObservation {
            image: image as u32,
            kind: MeasurementKind::Tie,
            x: observed[0],
            y: observed[1],
            inverse_sigma: 1.0,
        };
        BUFFER.with_borrow_mut(|p| {
            chain::predict(self.problem, &self.stages, &self.frames[image], &observation, point, p)?;
            Some((p.point, Matrix2x3::from_fn(|i, j| p.d_point[i][j])))
        })
    }

    /// Coordinates (m) that the survey would give of a point.
    pub fn surveyed(&self, point: &Vector3<f64>) -> Option<Vector3<f64>> {
        position::predict_surveyed(self.problem, &self.stages, &self.state.theta, point).map(|p| p.position)
    }

    /// Antenna position (m) of an image.
    pub fn antenna(&self, image: usize) -> Option<Vector3<f64>> {
        position::predict_antenna(self.problem, &self.stages, &self.frames[image], image).map(|p| p.position)
    }

    /// Derivatives of an image's antenna position by rotation `w` and projection centre, 3x6.
    pub fn antenna_by_pose(&self, image: usize) -> Option<Matrix3x6<f64>> {
        position::predict_antenna(self.problem, &self.stages, &self.frames[image], image).map(|p| p.derivative)
    }

    /// Projection centre (m) of an image.
    pub fn centre(&self, image: usize) -> Vector3<f64> {
        self.frames[image].centre
    }

    /// Approximate direction (world, unit length) of an image point: the camera's, effects of exposure, ray and image left out. For start values.
    pub fn ray(&self, image: usize, observed: [f64; 2]) -> Option<Vector3<f64>> {
        let frame = &self.frames[image];
        Some(frame.rotation.transpose() * viewing_ray(&frame.interior, observed)?)
    }
}
