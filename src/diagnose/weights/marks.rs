//! Marks of control points: how precise they are by themselves, whatever the survey says of their points.

use super::flights::Share;
use crate::measure::Predictor;
use crate::problem::PointSource;
use crate::run::RunError;
use crate::run::fit::Fit;
use crate::run::squares;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Fewest marks of a point that say how precise they are: two meet within one number.
const FEWEST: usize = 2;

/// What the marks have of `v'Pv` where each point is intersected by its marks alone, with the images as adjusted: a
/// wrong or imprecise survey is no part of it.
pub(super) fn alone(fit: &Fit) -> Result<Share, RunError> {
    let (problem, state) = (&fit.problem, &fit.solution.state);
    let predictor = Predictor::new(problem, state)?;
    let mut sum = Share::default();
    for point in control_points(fit) {
        let rows = &problem.observations[problem.point_start[point]..problem.point_start[point + 1]];
        let (mut normal, mut right, mut squares, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0.0, 0);
        for seen in rows {
            let Some((xy, by_point)) = predictor.image_point(seen.image as usize, &state.points[point]) else {
                continue;
            };
            let residual = Vector2::new(seen.x - xy[0], seen.y - xy[1]) * seen.inverse_sigma;
            let by_point = by_point * seen.inverse_sigma;
            normal += by_point.transpose() * by_point;
            right += by_point.transpose() * residual;
            squares += residual.norm_squared();
            count += 1;
        }
        if count < FEWEST {
            continue;
        }
        if let Some(factor) = normal.cholesky() {
            sum.chi_square += squares - right.dot(&factor.solve(&right));
            sum.redundancy += (2 * count - 3) as f64;
        }
    }
    Ok(sum)
}

/// What the marks have of `v'Pv` in the adjustment itself, and the redundancy of marks and control coordinates
/// together: two for each mark, since the three unknowns of a point take what its three coordinates bring.
pub(super) fn with_control(fit: &Fit) -> Result<Share, RunError> {
    let mut is_control = vec![false; fit.problem.point_sources.len()];
    control_points(fit).for_each(|point| is_control[point] = true);
    let mut sum = Share::default();
    squares::each(fit, |point, _, square| {
        if is_control[point] {
            sum.chi_square += square;
            sum.redundancy += 2.0;
        }
    })?;
    Ok(sum)
}

fn control_points(fit: &Fit) -> impl Iterator<Item = usize> {
    let sources = &fit.problem.point_sources;
    (0..sources.len()).filter(|point| matches!(sources[*point], PointSource::Control(_)))
}
