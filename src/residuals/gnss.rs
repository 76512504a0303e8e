//! GNSS residuals along, across and up: mean and slope in time per flight. They have a variance factor of their own:
//! the a-priori precision of image measurements and of positions is wrong independently.

use super::asked::Asked;
use super::columns::Family;
use super::context::Context;
use super::found::Found;
use crate::null_model::Coordinate;
use crate::problem::Problem;
use nalgebra::Vector3;

/// Most columns.
const MOST_COLUMNS: usize = 600;

/// The three directions, and in words.
pub(super) const DIRECTIONS: [(&str, &str); 3] =
    [("gnss-along", "along the track"), ("gnss-across", "across the track"), ("gnss-up", "up")];

fn direction(problem: &Problem, name: &str, image: usize) -> Option<Vector3<f64>> {
    if name == "gnss-up" {
        return Some(Vector3::z());
    }
    let velocity = problem.image_contexts[image].velocity;
    let along = Vector3::new(velocity.x, velocity.y, 0.0).try_normalize(f64::MIN_POSITIVE)?;
    along.x.is_finite().then(|| if name == "gnss-along" { along } else { Vector3::new(along.y, -along.x, 0.0) })
}

/// Mean and slope of each flight; `None` where there is nothing to test.
pub(super) fn family<'a>(problem: &'a Problem, name: &'static str) -> Option<Family<'a>> {
    let flights = problem.block_context.counts[1] as usize;
    let known = problem.gnss.iter().any(|position| direction(problem, name, position.index as usize).is_some());
    if !known || 2 * flights > MOST_COLUMNS {
        return None;
    }
    let coordinates = move |coordinate: Coordinate, to: &mut dyn FnMut(usize, f64)| {
        let Coordinate::Gnss(g, axis) = coordinate else { return };
        let image = problem.gnss[g].index as usize;
        let constants = &problem.image_contexts[image];
        let Some(direction) = direction(problem, name, image) else { return };
        let flight = constants.flight as usize;
        let share = constants.flight_time_s / constants.flight_span_s - 0.5;
        to(2 * flight, direction[axis]);
        if share.is_finite() {
            to(2 * flight + 1, direction[axis] * share);
        }
    };
    Some(Family {
        against: name,
        count: 2 * flights,
        local: true,
        fill: Box::new(|_, _| {}),
        coordinates: Some(Box::new(coordinates)),
    })
}

pub(super) fn judge(context: &Context<'_>, name: &'static str, asked: &Asked<'_>, found: &mut Found) {
    let problem = context.problem;
    let flights = problem.block_context.counts[1] as usize;
    let mut sums = vec![(0usize, 0.0); flights];
    for (g, position) in problem.gnss.iter().enumerate() {
        let image = position.index as usize;
        let Some(direction) = direction(problem, name, image) else { continue };
        let sum = &mut sums[problem.image_contexts[image].flight as usize];
        *sum = (sum.0 + 1, sum.1 + direction.dot(&context.antenna_residuals[g]));
    }
    let means = sums.iter().filter(|(n, _)| *n > 0).map(|(n, sum)| sum / *n as f64);
    let worst = means.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
    let what = DIRECTIONS.iter().find(|(other, _)| *other == name).map_or("", |(_, what)| what);
    let description =
        format!("mean and slope in time of {flights} flights {what}; largest mean residual {:.1} mm", 1e3 * worst);
    let all: Vec<usize> = (0..2 * flights).collect();
    found.push(name, asked.test_among(&all, context.gnss_noise), description);
}
