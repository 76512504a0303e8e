//! How errors reach the computed coordinates of surveyed points that take no part in the fit.
//!
//! A point is intersected from its marks, `H = J'WJ` with `J` their derivatives by the point, `B` those by cameras,
//! effects and pose:
//!
//! ```text
//! dP = H^-1 J'W (errors of the marks)  -  H^-1 J'W B (errors of the unknowns)
//! ```
//!
//! The unknowns are common to all points: that is how their errors correlate. The marks are each point's own, and so
//! is its survey.

use super::Adjusted;
use super::alignment::{OfPoint, linear};
use super::patterns::COEFFICIENTS;
use crate::evaluate::{Comparison, Intersection};
use crate::measure::{self, Frame, MeasureError, Prediction, Stages};
use nalgebra::{DMatrix, Matrix2x3, Matrix3, SMatrix, Vector3};

/// Products of functions.
pub type Products = SMatrix<f64, COEFFICIENTS, COEFFICIENTS>;
/// Image coordinates of a mark by functions.
type OfMark = SMatrix<f64, 2, COEFFICIENTS>;
/// An unknown by functions.
type OfUnknown = SMatrix<f64, 1, COEFFICIENTS>;

/// Where errors of functions come from.
pub struct Propagation {
    /// Derivatives by the unknowns of cameras, effects and poses (layout, raw units), a column for each function.
    pub gradients: DMatrix<f64>,
    /// Covariance from the marks, with the standard deviations that the fit gives image measurements.
    pub marks: Products,
    /// From the survey, with the factors that the fit has for control.
    pub survey: Products,
}

/// The same while it is summed: gradients by unknown.
struct Sums {
    gradients: Vec<OfUnknown>,
    marks: Products,
    survey: Products,
}

/// The forward model at the state of a fit.
struct Chain<'a> {
    adjusted: &'a Adjusted<'a>,
    stages: Stages,
    frames: Vec<Frame>,
    /// Does it take part?
    takes_part: Vec<bool>,
    /// Positions in `theta` of each image's list of effect parameters.
    thetas: Vec<Vec<usize>>,
    /// Work space, one for each mark of a point.
    predictions: Vec<Prediction>,
}

/// A mark as it acts on its point.
struct MarkRow {
    by_point: Matrix2x3<f64>,
    image: usize,
    /// Weight in the intersection, px^-2.
    weight: f64,
    /// Variance of each coordinate, px^2.
    variance: f64,
}

/// Propagates the errors of the functions `shares` of the compared points, a row each. `None`: a point that its marks
/// do not determine.
///
/// # Errors
/// A state at which images cannot be prepared.
pub fn propagate(
    adjusted: &Adjusted<'_>,
    comparison: &Comparison,
    shares: &[OfPoint],
) -> Result<Option<Propagation>, MeasureError> {
    let Adjusted { problem, state, .. } = *adjusted;
    let stages = Stages::new(problem);
    let frames = measure::frames(problem, &stages, state)?;
    let mut takes_part = vec![false; frames.len()];
    for observation in problem.observations.iter() {
        takes_part[observation.image as usize] = true;
    }
    let thetas = (0..frames.len()).map(|image| stages.theta_indices(problem, image)).collect();
    let mut chain = Chain { adjusted, stages, frames, takes_part, thetas, predictions: Vec::new() };
    let gradients = vec![OfUnknown::zeros(); problem.layout().point(0, 0)];
    let mut sums = Sums { gradients, marks: Products::zeros(), survey: Products::zeros() };
    let into_survey = linear(comparison.similarity.as_ref());
    for (share, point) in shares.iter().zip(&comparison.intersections.points) {
        if *share != OfPoint::zeros() && chain.point(point, share, &into_survey, &mut sums).is_none() {
            return Ok(None);
        }
    }
    let Sums { gradients, marks, survey } = sums;
    let gradients = DMatrix::from_fn(gradients.len(), COEFFICIENTS, |unknown, j| gradients[unknown][j]);
    Ok(Some(Propagation { gradients, marks, survey }))
}

impl Chain<'_> {
    fn point(
        &mut self,
        point: &Intersection,
        share: &OfPoint,
        into_survey: &Matrix3<f64>,
        sums: &mut Sums,
    ) -> Option<()> {
        let Adjusted { problem, state, block, model, .. } = *self.adjusted;
        let layout = problem.layout();
        let surveyed = measure::predict_surveyed(problem, &self.stages, &state.theta, &point.position)?;
        // Effects of control and frame have no image of their own: any image's list of global parameters serves.
        for (t, by_theta) in self.thetas[0].iter().zip(&surveyed.d_theta) {
            sums.gradients[layout.theta(*t)] += (into_survey * Vector3::from(*by_theta)).transpose() * share;
        }
        let by_point = into_survey * surveyed.derivative.fixed_view::<3, 3>(0, 3);
        let marks = self.marks(point)?;
        let normal: Matrix3<f64> =
            marks.iter().map(|mark| mark.by_point.transpose() * mark.by_point * mark.weight).sum();
        let carried: OfPoint = normal.try_inverse()? * by_point.transpose() * share;
        for (mark, prediction) in marks.iter().zip(&self.predictions) {
            let of_mark: OfMark = mark.by_point * carried * mark.weight;
            sums.marks += of_mark.transpose() * of_mark * mark.variance;
            let [x, y] = [0, 1].map(|i| of_mark.row(i).into_owned());
            let Prediction { d_camera, d_pose, d_theta, .. } = prediction;
            let mut take = |unknown: usize, by_x: f64, by_y: f64| sums.gradients[unknown] -= x * by_x + y * by_y;
            let camera = layout.camera(problem.image_contexts[mark.image].camera as usize, 0);
            for k in 0..d_camera[0].len() {
                take(camera + k, d_camera[0][k], d_camera[1][k]);
            }
            for k in 0..d_pose[0].len() {
                take(layout.pose(mark.image, k), d_pose[0][k], d_pose[1][k]);
            }
            for (local, t) in self.thetas[mark.image].iter().enumerate() {
                take(layout.theta(*t), d_theta[0][local], d_theta[1][local]);
            }
        }
        let own = &block.surveyed[point.point.index()];
        let xy = model.sigma_factors.control * own.sigma_xy.unwrap_or(block.sigma.control_xy_m);
        let z = model.sigma_factors.control_z * own.sigma_z.unwrap_or(block.sigma.control_z_m);
        let variances = Matrix3::from_diagonal(&Vector3::new(xy, xy, z).map(|sigma| sigma * sigma));
        sums.survey += share.transpose() * variances * share;
        Some(())
    }

    /// The marks of a point, predicted, but for those in images that take no part.
    fn marks(&mut self, point: &Intersection) -> Option<Vec<MarkRow>> {
        let Adjusted { problem, block, model, .. } = *self.adjusted;
        let mut rows = Vec::with_capacity(point.measurements.len());
        for mark in point.measurements.iter().map(|index| &block.marks[*index]) {
            let image = mark.image.index();
            if !self.takes_part[image] {
                continue;
            }
            let sigma = mark.sigma.unwrap_or(block.sigma.mark_px);
            let flight = &block.flights[block.images[image].flight.index()];
            let of_flight = model.flight_factors.get(flight).map_or(1.0, |factors| factors.image);
            if self.predictions.len() == rows.len() {
                self.predictions.push(Prediction::default());
            }
            let prediction = &mut self.predictions[rows.len()];
            let frame = &self.frames[image];
            measure::predict(problem, &self.stages, frame, image, &point.position, prediction)?;
            rows.push(MarkRow {
                by_point: Matrix2x3::from_fn(|i, k| prediction.d_point[i][k]),
                image,
                weight: sigma.powi(-2),
                variance: (sigma * model.sigma_factors.image * model.sigma_factors.mark * of_flight).powi(2),
            });
        }
        Some(rows)
    }
}

#[cfg(test)]
#[path = "propagation_tests.rs"]
mod tests;
