//! Does a model predict measurements that its fit did not see? Every fourth tie point is left out in turn.
//!
//! The cameras of a part follow from those of the whole by one Gauss-Newton step. A left-out point is intersected with
//! them from all rays but one and predicted in that one (in closed form: the residual of the whole intersection divided
//! by what it leaves of itself). An image that the other parts do not orient predicts nothing, and stays where it is.

use crate::adjust::AdjustError;
use crate::adjust::native::one_step;
use crate::adjust::native::pool::Pool;
use crate::math::statistics::{chi_square_quantile, median};
use crate::measure::{ImagePoint, Predictor, Sighted};
use crate::problem::{ImageObservation, PointSource, Problem, State};
use crate::run::fit::Fit;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};
use rayon::prelude::*;

/// Parts that are left out in turn: each fit keeps three quarters, enough for any block that can be adjusted at all.
const FOLDS: usize = 4;
/// Rays that a left-out tie point needs: two intersect, the third is predicted.
const LEAST_RAYS: usize = 3;
/// Steps of the intersection; from the adjusted point two suffice.
const INTERSECTION_STEPS: usize = 2;

/// Typical error per coordinate of predicted tie-point measurements, px: from the median, which badly intersected
/// points do not move, of errors that are each divided by the precision of their intersection. NaN where no point has
/// three rays.
pub fn held_out_px(fitted: &Fit, threads: usize) -> Result<f64, AdjustError> {
    let of_folds: Vec<Vec<f64>> = Pool::new(threads)?.install(|| {
        let fold = |fold: usize| of_fold(fitted, fold, threads.div_ceil(FOLDS));
        (0..FOLDS).into_par_iter().map(fold).collect::<Result<_, _>>()
    })?;
    let squares = of_folds.concat();
    if squares.is_empty() {
        return Ok(f64::NAN);
    }
    // Each is half of a chi-square with two degrees of freedom times the variance.
    Ok((2.0 * median(&squares) / chi_square_quantile(0.5, 2.0)).sqrt())
}

/// Squared errors of the points of a part, left out.
fn of_fold(fitted: &Fit, fold: usize, threads: usize) -> Result<Vec<f64>, AdjustError> {
    let Fit { problem, solution, .. } = fitted;
    let state = &solution.state;
    let left_out = |j: &usize| matches!(problem.point_sources[*j], PointSource::Tie(_)) && j % FOLDS == fold;
    let (left_out, kept): (Vec<usize>, Vec<usize>) = (0..problem.point_sources.len()).partition(left_out);
    let (mut part, at) = problem.with_points(state, &kept);
    let unoriented = part.hold_unoriented_images();
    // A shape has no smooth way to the part's own best place (the kink of a flaw): that of the whole is kept.
    for t in part.searched() {
        part.theta[t].free = false;
    }
    // A part that does not determine every unknown predicts nothing.
    let Ok(next) = one_step(&part, &at, threads) else { return Ok(Vec::new()) };
    let of_part = State { points: state.points.clone(), ..next };
    let predictor = Predictor::new(problem, &of_part)?;
    let cameras = Cameras { problem, predictor: &predictor, unoriented: &unoriented };
    let predicted = |j: &usize| predict_point(&cameras, &of_part.points[*j], *j);
    Ok(left_out.par_iter().flat_map_iter(predicted).collect())
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
    let all = &problem.observations[problem.point_start[j]..problem.point_start[j + 1]];
    let seen = || all.iter().filter(|observation| !unoriented[observation.image as usize]);
    let sighted = seen().map(|o| Sighted { image: o.image as usize, point: *object });
    let row = |(observation, predicted): (&ImageObservation, Option<ImagePoint>)| {
        let (computed, by_point) = predicted?;
        let residual = Vector2::new(observation.x - computed[0], observation.y - computed[1]);
        let weight = observation.inverse_sigma;
        Some((residual * weight, by_point * weight, weight))
    };
    seen().zip(predictor.image_points(sighted)).map(row).collect()
}

/// Squared errors of the predicted image points of a point, each by the precision of its intersection, per coordinate
/// and in px^2.
fn predict_point(cameras: &Cameras<'_>, near: &Vector3<f64>, j: usize) -> Vec<f64> {
    let normal = |rows: &Rows| -> Matrix3<f64> { rows.iter().map(|(_, a, _)| a.transpose() * a).sum() };
    let intersected = || {
        let mut object = *near;
        for _ in 0..INTERSECTION_STEPS {
            let rows = rows(cameras, j, &object)?;
            object +=
                normal(&rows).try_inverse()? * rows.iter().map(|(v, a, _)| a.transpose() * v).sum::<Vector3<f64>>();
        }
        let rows = rows(cameras, j, &object)?;
        let inverse = normal(&rows).try_inverse()?;
        Some((rows, inverse))
    };
    let Some((rows, inverse)) = intersected().filter(|(rows, _)| rows.len() >= LEAST_RAYS) else { return Vec::new() };
    let error = |(v, a, weight): &(Vector2<f64>, Matrix2x3<f64>, f64)| {
        // Without this ray the intersection predicts it with error (I - A N^-1 A')^-1 v, of covariance (I - A N^-1
        // A')^-1.
        let spread = (Matrix2::identity() - a * inverse * a.transpose()).try_inverse()?;
        Some(0.5 * v.dot(&(spread * v)) / (weight * weight))
    };
    rows.iter().filter_map(error).collect()
}
