//! A trial step: images and border as the reduced system says, then every point follows its images, and what chi-square
//! is there.

use super::follow::{Follow, Followers, Motion, motions};
use super::linearise::chi_square_beside_points;
use super::loss::Curvature;
use super::point::Prepared;
use super::rows::batches;
use super::side_by_side::{Eights, Workspace, add_costs};
use super::structure::Structure;
use super::system::System;
use super::turn::Turn;
use crate::camera::tie_centre;
use crate::math::lane::Lane;
use crate::math::vectors::dispatch;
use crate::measure::{self, Frame};
use crate::problem::{Pose, Problem, State};
use nalgebra::Vector3;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

/// A trial step.
pub struct Step {
    /// The state after it.
    pub state: State,
    /// Its images.
    pub frames: Vec<Frame>,
    /// `sum rho` there; nothing where it was not asked for.
    pub chi_square: f64,
    /// By what it would have fallen, were the problem linear.
    pub predicted_drop: f64,
}

/// Takes the step, of the `system` that was damped by `damping`: images and border first, then every point follows.
/// `None` where the new state cannot be projected. `costs`: whether chi-square is asked for.
pub fn try_step(
    at: &Prepared<'_>,
    system: &System,
    increments: &(Vec<f64>, Vec<f64>),
    damping: f64,
    curvature: Curvature,
    costs: bool,
) -> Option<Step> {
    let Prepared { problem, structure, state, .. } = *at;
    let (images, border) = increments;
    let State { interiors, theta, poses, points } = state;
    // Its points follow, part by part.
    let (interiors, theta, poses) = (interiors.clone(), theta.clone(), poses.clone());
    let mut next = State { interiors, theta, poses, points: Vec::with_capacity(points.len()) };
    let turn = move_images_and_border(problem, structure, &mut next, images, border);
    let frames = measure::frames(problem, &structure.stages, &next).ok()?;
    let after = Prepared { problem, structure, state: &next, frames: &frames };
    let motions = motions(state, &next);
    let step = PointStep { before: at, after: &after, turn: &turn, motions: &motions, damping, curvature, costs };
    // Begun in their order, because the last ones are small; and kept in it.
    let chunks = structure.chunks.iter().enumerate().par_bridge();
    let mut moved: Vec<(usize, Moved)> =
        chunks.map(|(number, points)| Some((number, step.chunk(points)?))).collect::<Option<_>>()?;
    moved.sort_unstable_by_key(|(number, _)| *number);
    let mut chi_square = 0.0;
    let mut by_damping = 0.0;
    for (_, part) in moved {
        next.points.extend_from_slice(&part.points);
        chi_square += part.chi_square;
        by_damping += part.by_damping;
    }
    let squares = |dx: &[f64], diagonal: &[f64]| dx.iter().zip(diagonal).map(|(x, d)| x * x * d).sum::<f64>();
    by_damping += damping * (squares(images, &system.diagonal_images) + squares(border, &system.diagonal_border));
    if costs {
        let after = Prepared { problem, structure, state: &next, frames: &frames };
        chi_square += chi_square_beside_points(&after).ok()?;
    }
    // The damped system says `(N + lambda D) d = g`, so that `2 g'd - d'N d = g'd + lambda d'D d`.
    let predicted_drop = system.decrement(increments) + by_damping;
    chi_square.is_finite().then_some(Step { state: next, frames, chi_square, predicted_drop })
}

/// Adds scaled increments to poses, cameras and effect parameters; gives the turn that they share, for the points.
pub fn move_images_and_border(
    problem: &Problem,
    structure: &Structure,
    state: &mut State,
    images: &[f64],
    border: &[f64],
) -> Turn {
    let layout = problem.layout();
    let increments = |image: usize| {
        let base = structure.rank[image] as usize * structure.dim;
        [0, 3].map(|k| Vector3::from_column_slice(&images[base + k..base + k + 3]))
    };
    let turn = Turn::of_step(problem, state, |image| increments(image)[0]);
    for (image, pose) in state.poses.iter_mut().enumerate() {
        let base = structure.rank[image] as usize * structure.dim;
        let d = &images[base..base + structure.dim];
        if problem.pose_free[image] != [false; 6] {
            let [by_rotation, by_centre] = increments(image);
            *pose = Pose {
                rotation: turn.attitude(&pose.rotation, &by_rotation),
                centre: turn.position(&pose.centre, &by_centre),
            };
        }
        for column in &structure.own[image] {
            let unknown = structure.image_unknowns[base + column.row as usize];
            state.theta[unknown - layout.theta(0)] += d[column.row as usize] * column.scale;
        }
    }
    for ((unknown, scale), d) in structure.border.iter().zip(&structure.border_scale).zip(border) {
        match layout.camera_parameter(*unknown) {
            Some((c, k)) => state.interiors[c][k] += d * scale,
            None => state.theta[unknown - layout.theta(0)] += d * scale,
        }
    }
    if problem.tie_dc_to_pp {
        state.interiors.iter_mut().for_each(tie_centre);
    }
    turn
}

/// What the points follow.
struct PointStep<'a> {
    /// Before the step.
    before: &'a Prepared<'a>,
    /// After it, but for the points.
    after: &'a Prepared<'a>,
    turn: &'a Turn,
    motions: &'a [Motion],
    damping: f64,
    curvature: Curvature,
    costs: bool,
}

/// Points of a chunk after the step.
struct Moved {
    points: Vec<Vector3<f64>>,
    chi_square: f64,
    /// `lambda d'D d`.
    by_damping: f64,
}

impl PointStep<'_> {
    fn chunk(&self, points: &Range<usize>) -> Option<Moved> {
        let Self { before, after, turn, motions, damping, curvature, costs } = *self;
        let [mut work, mut work_before] = [(); 2].map(|()| Workspace::new(&after.structure.stages));
        let mut followers = Followers::default();
        let mut moved = Moved { points: Vec::with_capacity(points.len()), chi_square: 0.0, by_damping: 0.0 };
        for batch in batches(after.problem, points) {
            let (points, work, work_before, followers) = (batch.clone(), &mut work, &mut work_before, &mut followers);
            dispatch(Follow { before, after, motions, curvature, points, work, work_before, followers })?;
            let first = moved.points.len();
            for (point, (carried, rays)) in
                before.state.points[batch.clone()].iter().zip(followers.carried.iter().zip(&followers.rays))
            {
                let arrived = carried + rays.step(damping, &turn.increment(point, carried))?;
                let step = turn.increment(point, &arrived);
                moved.by_damping += damping * step.component_mul(&step).dot(&rays.normal().diagonal());
                moved.points.push(arrived);
            }
            if costs {
                let objects = &moved.points[first..];
                moved.chi_square += dispatch(Costs { after, points: batch.clone(), objects, work })?;
                moved.chi_square += surveyed_chi_square(after, batch, objects)?;
            }
        }
        Some(moved)
    }
}

/// `sum rho` of the image measurements of some points at `objects`. `None`: one that cannot be predicted.
struct Costs<'a, 'b> {
    after: &'a Prepared<'b>,
    points: Range<usize>,
    objects: &'a [Vector3<f64>],
    work: &'a mut Workspace,
}

impl WithSimd for Costs<'_, '_> {
    type Output = Option<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<f64> {
        let Self { after, points, objects, work } = self;
        let cameras = after.cameras();
        let mut eights = Eights::new(cameras, objects, points, &mut work.views);
        let mut costs = Lane::default();
        while work.predict(simd, cameras, &mut eights)? {
            let (_, squares) = work.eight.misclosures(simd, &work.predictions.point);
            add_costs(simd, cameras.problem.loss, &squares, &mut costs);
        }
        Some(costs.iter().sum())
    }
}

/// `sum rho` of the surveyed coordinates of some points.
pub fn surveyed_chi_square(after: &Prepared<'_>, points: Range<usize>, objects: &[Vector3<f64>]) -> Option<f64> {
    let Prepared { problem, structure, state, .. } = after;
    let first = problem.control.partition_point(|c| (c.index as usize) < points.start);
    let mut sum = 0.0;
    for observation in problem.control[first..].iter().take_while(|c| (c.index as usize) < points.end) {
        let object = &objects[observation.index as usize - points.start];
        let p = measure::predict_surveyed(problem, &structure.stages, &state.theta, object)?;
        sum += (observation.position - p.position).component_div(&observation.sigma).norm_squared();
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::super::linearise::linearise;
    use super::super::spare::Spare;
    use super::super::{factor::Factor, frames};
    use super::*;
    use crate::model::{Datum, Model};
    use crate::scenario::{Scenario, add_noise, simulate};
    use std::collections::BTreeMap;

    #[test]
    fn a_damped_step_brings_what_it_promises() {
        let scenario = Scenario::preset("closerange", &BTreeMap::from([("points".into(), 60.0)])).expect("a preset");
        let mut block = simulate(&scenario, 1).expect("a block").block;
        add_noise(&mut block, 0.3, 1).expect("noise");
        let problem = Problem::new(&block, &Model { datum: Datum::Free, ..Model::default() }).expect("a problem");
        let structure = Structure::new(&problem);
        let state = &problem.start;
        let frames = frames(&problem, &structure, state).expect("images");
        let at = Prepared { problem: &problem, structure: &structure, state, frames: &frames };
        for damping in [0.01, 1.0, 100.0] {
            let system = linearise(&at, damping, Curvature::Weights, &Spare::default()).expect("a system");
            let increments = Factor::new(&structure, &system, None, damping).expect("positive definite").solve();
            let step = try_step(&at, &system, &increments, damping, Curvature::Weights, true).expect("a step");
            let brought = (system.chi_square - step.chi_square) / step.predicted_drop;
            assert!((brought - 1.0).abs() < 0.01, "{brought} of what was promised at {damping}");
        }
    }
}
