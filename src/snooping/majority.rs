//! Where most rays of a point meet: start coordinates that one wrong ray cannot bend.
//!
//! The least-squares intersection of all rays of a point lies far from each of them where one is wrong by a thousand
//! pixels, and a robust fit that starts there takes them all for wrong. So every two rays are intersected, and of these
//! places the one counts that has the least sum of angles to all rays: a wrong ray adds the same to the sum of every
//! place where others meet.

use crate::block::{Block, Measurement};
use crate::camera::undistort::viewing_ray;
use crate::math::intersect::intersect_rays;
use crate::problem::{PointSource, Problem, State};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Two rays intersected, of a point at most. Of a point half of whose rays are wrong a quarter of them is of right
/// ones.
const MOST_PAIRS: usize = 200;

/// Two rays tell of nothing but each other.
const FEWEST_RAYS: usize = 3;

/// Starts every tie point where most of its rays meet at the start values of cameras and poses.
pub(super) fn start_where_most_rays_meet(problem: &mut Problem) {
    let better: Vec<Option<Vector3<f64>>> =
        (0..problem.point_sources.len()).into_par_iter().map(|j| meeting_of_most(problem, j)).collect();
    for (point, better) in problem.start.points.iter_mut().zip(better) {
        *point = better.unwrap_or(*point);
    }
}

/// A better place than its start for point `j`; `None` where there is none.
fn meeting_of_most(problem: &Problem, j: usize) -> Option<Vector3<f64>> {
    let measured = &problem.observations[problem.point_start[j]..problem.point_start[j + 1]];
    if measured.len() < FEWEST_RAYS || !matches!(problem.point_sources[j], PointSource::Tie(_)) {
        return None;
    }
    let start = &problem.start;
    let rays: Vec<Ray> = measured
        .iter()
        .filter_map(|observation| {
            let image = observation.image as usize;
            let camera = problem.image_contexts[image].camera as usize;
            let direction = viewing_ray(&start.interiors[camera], [observation.x, observation.y])?;
            let pose = &start.poses[image];
            Some(Ray { origin: pose.centre, direction: (pose.rotation.inverse() * direction).normalize() })
        })
        .collect();
    let in_front =
        |point: &Vector3<f64>| measured.iter().all(|o| start.poses[o.image as usize].cam_from_world(point).z > 0.0);
    let of_start = rays.iter().map(|ray| ray.apart(&start.points[j])).sum();
    place_of_most(&rays, of_start, in_front)
}

/// The place where two of some rays meet that lies least beside all of them; `None` where none lies less beside them
/// than `least`, a sum of angles, or may be one.
pub(super) fn place_of_most(
    rays: &[Ray],
    mut least: f64,
    may_be: impl Fn(&Vector3<f64>) -> bool,
) -> Option<Vector3<f64>> {
    let pairs: Vec<(usize, usize)> = (0..rays.len()).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
    let mut best = None;
    for &(a, b) in pairs.iter().step_by(pairs.len().div_ceil(MOST_PAIRS).max(1)) {
        let both = [rays[a], rays[b]];
        let Some(point) = intersect_rays(&both.map(|ray| ray.origin), &both.map(|ray| ray.direction)) else { continue };
        let sum = rays.iter().map(|ray| ray.apart(&point)).sum();
        if sum < least && may_be(&point) {
            (best, least) = (Some(point), sum);
        }
    }
    best
}

#[derive(Clone, Copy)]
pub(super) struct Ray {
    /// Projection centre, m.
    pub(super) origin: Vector3<f64>,
    /// Unit vector.
    pub(super) direction: Vector3<f64>,
}

impl Ray {
    /// By how much a point lies beside it, as the chord of the angle.
    fn apart(&self, point: &Vector3<f64>) -> f64 {
        ((point - self.origin).normalize() - self.direction).norm()
    }
}

/// Where most of the rays of some `rows` meet at a solution, taken as straight lines; `None` where no two do.
pub(super) fn meeting(block: &Block, state: &State, rows: &[&Measurement]) -> Option<Vector3<f64>> {
    let ray = |row: &&Measurement| {
        let pose = &state.poses[row.image.index()];
        let interior = &state.interiors[block.images[row.image.index()].camera.index()];
        let direction = pose.rotation.inverse() * viewing_ray(interior, [row.x, row.y])?;
        Some(Ray { origin: pose.centre, direction: direction.normalize() })
    };
    let rays: Vec<Ray> = rows.iter().filter_map(ray).collect();
    place_of_most(&rays, f64::INFINITY, |_| true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::scenario::{Scenario, simulate};
    use std::collections::BTreeMap;

    #[test]
    fn a_wrong_ray_does_not_move_the_start() {
        let scenario = Scenario::preset("closerange", &BTreeMap::from([("points".into(), 60.0)])).expect("a preset");
        let mut block = simulate(&scenario, 1).expect("a block").block;
        let truth: Vec<_> = block.tie_points.iter().map(|point| point.position.expect("known")).collect();
        let wrong = 7;
        let p = block.ties[wrong].point.index();
        let rays = block.ties.iter().filter(|row| row.point.index() == p).count();
        assert!(rays > 3, "of three rays none can be told to be wrong: {rays}");
        block.ties[wrong].x += if block.ties[wrong].x > 2000.0 { -1000.0 } else { 1000.0 };
        block.tie_points.iter_mut().for_each(|point| point.position = None);
        let mut problem = Problem::new(&block, &Model::default()).expect("a problem");
        let j = problem.point_sources.iter().position(|source| *source == PointSource::Tie(p.into())).expect("it");
        let away = |problem: &Problem| (problem.start.points[j] - truth[p]).norm();
        let before = away(&problem);
        start_where_most_rays_meet(&mut problem);
        let after = away(&problem);
        assert!(before > 0.01 && after < 1e-6, "{before} m, then {after} m");
    }
}
