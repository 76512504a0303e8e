//! Does a model predict measurements that its fit did not see? Every `FOLDS`-th tie point, antenna position and control point is left out in turn.
//!
//! A left-out tie point is intersected with the fitted cameras from all rays but one and predicted in that one (in closed form: the residual of the
//! whole intersection divided by what it leaves of itself); a left-out antenna is predicted from its image, a left-out control point from its marks.
//! An image that the other parts do not orient predicts nothing, and stays where it is.

use super::fit::{Fit, deciding};
use crate::adjust::native::Native;
use crate::adjust::{AdjustError, CovarianceOf, Options, Solver};
use crate::math::statistics::{chi_square_quantile, median};
use crate::measure::Predictor;
use crate::problem::{PointSource, Problem, State};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};
use std::ops::ControlFlow;

/// Parts that are left out in turn: each fit keeps three quarters, enough for any block that can be adjusted at all.
const FOLDS: usize = 4;
/// Rays that a left-out tie point needs: two intersect, the third is predicted.
const LEAST_RAYS: usize = 3;
/// Steps in which a part finds its own place of a shape: from that of the whole most take half as many.
const SEARCH_ITERATIONS: usize = 20;
/// Steps of the intersection; from the adjusted point two suffice.
const INTERSECTION_STEPS: usize = 3;

/// Errors of prediction.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeldOut {
    /// Squared errors of predicted image points, each by the precision of its intersection, per coordinate and in px^2.
    squares_px: Vec<f64>,
    /// Sum of squares of all predictions, each in units of its own standard deviation (that of the measurement and of the ray's intersection).
    pub normalised: f64,
}

impl HeldOut {
    /// Typical error per coordinate of predicted tie-point measurements, px, from the median, which badly intersected points do not move; NaN
    /// where no point has three rays.
    pub fn px(&self) -> f64 {
        if self.squares_px.is_empty() {
            return f64::NAN;
        }
        // Each is half of a chi-square with two degrees of freedom times the variance.
        (2.0 * median(&self.squares_px) / chi_square_quantile(0.5, 2.0)).sqrt()
    }
}

/// Predicts everything once, each part by a fit without it.
pub fn held_out(fitted: &Fit, options: &Options) -> Result<HeldOut, AdjustError> {
    let mut sum = HeldOut::default();
    for fold in 0..FOLDS {
        hold_out(fitted, options, fold, &mut sum)?;
    }
    Ok(sum)
}

fn hold_out(fitted: &Fit, options: &Options, fold: usize, sum: &mut HeldOut) -> Result<(), AdjustError> {
    let Fit { problem, solution, .. } = fitted;
    let state = &solution.state;
    let left_out = |j: usize| match problem.point_sources[j] {
        PointSource::Tie(_) => j % FOLDS == fold,
        // A datum needs control points to stay.
        PointSource::Control(id) => problem.control.len() > FOLDS && id.index() % FOLDS == fold,
    };
    let points = 0..problem.point_sources.len();
    let kept: Vec<usize> = points.clone().filter(|j| !left_out(*j)).collect();
    let (mut part, start) = problem.with_points(state, &kept);
    let images = problem.image_names.len();
    let gnss_left_out = |image: usize| images > FOLDS && image % FOLDS == fold;
    part.gnss.retain(|observation| !gnss_left_out(observation.index as usize));
    part.start = start;
    let unoriented = part.unoriented_images();
    for (free, _) in part.pose_free.iter_mut().zip(&unoriented).filter(|(_, unoriented)| **unoriented) {
        *free = [false; 6];
    }
    part.gnss.retain(|observation| !unoriented[observation.index as usize]);
    let options = Options { covariance: CovarianceOf::Nothing, ..deciding(options) };
    let solve = |part: &Problem, max_iterations: usize| {
        let options = Options { max_iterations, ..options.clone() };
        Native.solve(part, &options, &mut |_| ControlFlow::Continue(()))
    };
    // A shape may have no smooth way to the part's own best place (the kink of a flaw), or none that the part determines; that of the whole is
    // the second choice.
    let few = SEARCH_ITERATIONS.min(options.max_iterations);
    let solution = match part.searched().is_empty() {
        true => solve(&part, options.max_iterations)?,
        false => solve(&part, few).or_else(|_| {
            for t in part.searched() {
                part.theta[t].free = false;
            }
            solve(&part, options.max_iterations)
        })?,
    };
    let fold_state = State { points: state.points.clone(), ..solution.state };
    let predictor = Predictor::new(problem, &fold_state)?;
    let cameras = Cameras { problem, predictor: &predictor, unoriented: &unoriented };
    for j in points.filter(|j| left_out(*j)) {
        predict_point(&cameras, &fold_state, j, sum);
    }
    let predicted = |image: usize| gnss_left_out(image) && !unoriented[image];
    for observation in problem.gnss.iter().filter(|observation| predicted(observation.index as usize)) {
        if let Some(antenna) = predictor.antenna(observation.index as usize) {
            sum.normalised += (observation.position - antenna).component_div(&observation.sigma).norm_squared();
        }
    }
    Ok(())
}

/// Rows of one point: weighted residual, weighted derivative, and weight.
type Rows = Vec<(Vector2<f64>, Matrix2x3<f64>, f64)>;

/// The cameras of a fit that did not see what is predicted.
struct Cameras<'a> {
    problem: &'a Problem,
    predictor: &'a Predictor<'a>,
    /// Images that the fit did not orient.
    unoriented: &'a [bool],
}

fn rows(cameras: &Cameras<'_>, j: usize, object: &Vector3<f64>) -> Option<Rows> {
    let Cameras { problem, predictor, unoriented } = cameras;
    problem.observations[problem.point_start[j]..problem.point_start[j + 1]]
        .iter()
        .filter(|observation| !unoriented[observation.image as usize])
        .map(|observation| {
            let observed = [observation.x, observation.y];
            let (computed, by_point) = predictor.image_point(observation.image as usize, observed, object)?;
            let residual = Vector2::new(observed[0] - computed[0], observed[1] - computed[1]);
            let weight = observation.inverse_sigma;
            Some((residual * weight, by_point * weight, weight))
        })
        .collect()
}

fn predict_point(cameras: &Cameras<'_>, state: &State, j: usize, sum: &mut HeldOut) {
    let Cameras { problem, predictor, .. } = cameras;
    let mut object = state.points[j];
    let normal = |rows: &Rows| -> Matrix3<f64> { rows.iter().map(|(_, a, _)| a.transpose() * a).sum() };
    for _ in 0..INTERSECTION_STEPS {
        let Some(rows) = rows(cameras, j, &object) else { return };
        let Some(inverse) = normal(&rows).try_inverse() else { return };
        object += inverse * rows.iter().map(|(v, a, _)| a.transpose() * v).sum::<Vector3<f64>>();
    }
    let Some(rows) = rows(cameras, j, &object) else { return };
    let Some(inverse) = normal(&rows).try_inverse() else { return };
    if let PointSource::Control(_) = problem.point_sources[j] {
        let Ok(c) = problem.control.binary_search_by_key(&(j as u32), |observation| observation.index) else { return };
        let observation = &problem.control[c];
        if let Some(surveyed) = predictor.surveyed(&object) {
            let variance = observation.sigma.component_mul(&observation.sigma) + inverse.diagonal();
            let d = observation.position - surveyed;
            sum.normalised += d.component_mul(&d).component_div(&variance).sum();
        }
        return;
    }
    if rows.len() < LEAST_RAYS {
        return;
    }
    for (v, a, weight) in &rows {
        // Without this ray the intersection predicts it with error (I - A N^-1 A')^-1 v, of covariance (I - A N^-1 A')^-1.
        let Some(spread) = (Matrix2::identity() - a * inverse * a.transpose()).try_inverse() else { continue };
        let normalised = v.dot(&(spread * v));
        sum.squares_px.push(0.5 * normalised / (weight * weight));
        sum.normalised += normalised;
    }
}
