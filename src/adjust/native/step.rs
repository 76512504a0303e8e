//! A trial step: images and border as the reduced system says, then every point by back-substitution, and what chi-square is there.

use super::MAX_DIM;
use super::back_substitution::{BackSubstitute, Costs, Increments, Left};
use super::linearise::chi_square_beside_points;
use super::loss::{Curvature, rho};
use super::point::{PointRows, Prepared, inverse_of_damped};
use super::rows::{Contents, batches};
use super::side_by_side::Workspace;
use super::structure::Structure;
use super::system::System;
use super::turn::Turn;
use crate::camera::tie_centre;
use crate::math::vectors::dispatch;
use crate::measure::{self, Frame};
use crate::problem::{ImageObservation, Pose, Problem, State};
use nalgebra::Vector3;
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

/// Takes the step: images and border first, then every point by back-substitution. `None` where the new state cannot be projected.
/// `costs`: whether chi-square is asked for.
pub fn try_step(
    at: &Prepared<'_>,
    system: &System,
    (images, border): &(Vec<f64>, Vec<f64>),
    damping: f64,
    curvature: Curvature,
    costs: bool,
) -> Option<Step> {
    let Prepared { problem, structure, state, .. } = *at;
    let mut next = state.clone();
    let turn = move_images_and_border(problem, structure, &mut next, images, border);
    let frames = measure::frames(problem, &structure.stages, &next).ok()?;
    let after = Prepared { problem, structure, state: &next, frames: &frames };
    let step = PointStep { at, after: &after, turn: &turn, images, border, damping, curvature, costs };
    let chunk = |points: &Range<usize>| match (structure.wide_border(), structure.dim) {
        (false, _) => step.narrow(points),
        (true, 6) => step.wide::<6>(points),
        (true, 7) => step.wide::<7>(points),
        (true, 8) => step.wide::<8>(points),
        (true, _) => step.wide::<MAX_DIM>(points),
    };
    // Begun in their order, because the last ones are small; and kept in it.
    let chunks = structure.chunks.iter().enumerate().par_bridge();
    let mut moved: Vec<(usize, Moved)> =
        chunks.map(|(number, points)| Some((number, chunk(points)?))).collect::<Option<_>>()?;
    moved.sort_unstable_by_key(|(number, _)| *number);
    let mut chi_square = 0.0;
    let mut predicted_drop = 0.0;
    let mut first = 0;
    for (_, part) in moved {
        next.points[first..first + part.points.len()].copy_from_slice(&part.points);
        first += part.points.len();
        chi_square += part.chi_square;
        predicted_drop += part.predicted_drop;
    }
    let share = |dx: &[f64], gradient: &[f64], diagonal: &[f64]| -> f64 {
        dx.iter().zip(gradient).zip(diagonal).map(|((x, g), d)| x * g + damping * x * x * d).sum()
    };
    predicted_drop += share(images, &system.gradient_images, &system.diagonal_images)
        + share(border, &system.gradient_border, &system.diagonal_border);
    if costs {
        let after = Prepared { problem, structure, state: &next, frames: &frames };
        chi_square += chi_square_beside_points(&after).ok()?;
    }
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

/// What the points' own steps follow from: the increments of images and border, and the damped system that these solve.
struct PointStep<'a> {
    /// Before the step.
    at: &'a Prepared<'a>,
    /// After it, but for the points.
    after: &'a Prepared<'a>,
    turn: &'a Turn,
    images: &'a [f64],
    border: &'a [f64],
    damping: f64,
    curvature: Curvature,
    costs: bool,
}

/// Points of a chunk after the step.
struct Moved {
    points: Vec<Vector3<f64>>,
    chi_square: f64,
    predicted_drop: f64,
}

impl PointStep<'_> {
    fn wide<const D: usize>(&self, points: &Range<usize>) -> Option<Moved> {
        let mut rows = PointRows::<D>::with(self.curvature);
        let mut moved = Moved { points: Vec::with_capacity(points.len()), chi_square: 0.0, predicted_drop: 0.0 };
        for j in points.clone() {
            rows.linearise(self.at, j).ok()?;
            let mut rest = rows.gradient;
            for row in &rows.rows {
                let dx = &self.images[row.rank as usize * D..(row.rank as usize + 1) * D];
                for k in 0..D {
                    rest -= Vector3::from(row.w[k]) * dx[k];
                }
            }
            for (l, column) in rows.columns.index().iter().enumerate() {
                let dx = self.border[*column as usize];
                for a in 0..3 {
                    rest[a] -= rows.w_shared[a][l] * dx;
                }
            }
            let step = inverse_of_damped(&rows.v_matrix, self.damping)? * rest;
            let damped = self.damping * step.component_mul(&step).dot(&rows.v_matrix.diagonal());
            moved.predicted_drop += step.dot(&rows.gradient) + damped;
            let object = self.turn.position(&self.at.state.points[j], &step);
            moved.points.push(object);
            if self.costs {
                let one = OnTheirOwn { after: self.after };
                moved.chi_square += one.chi_square(j..j + 1, &[object])?;
            }
        }
        Some(moved)
    }

    fn narrow(&self, points: &Range<usize>) -> Option<Moved> {
        let structure = self.at.structure;
        let contents = Contents::new(structure);
        let images = structure.padded(self.images);
        let increments = Increments { contents: &contents, images: &images, border: self.border };
        let (mut work, mut left) = (Workspace::new(&structure.stages), Vec::new());
        let mut moved = Moved { points: Vec::with_capacity(points.len()), chi_square: 0.0, predicted_drop: 0.0 };
        for batch in batches(self.at.problem, points) {
            left.clear();
            left.resize(batch.len(), Left::default());
            let (at, curvature, points) = (self.at, self.curvature, batch.clone());
            let (increments, work) = (&increments, &mut work);
            dispatch(BackSubstitute { at, curvature, points, increments, work, left: &mut left }).ok()?;
            increments.add_surveyed(at, batch.clone(), &mut left).ok()?;
            let first = moved.points.len();
            for (j, left) in batch.clone().zip(&left) {
                let step = left.step(self.damping)?;
                let damped = self.damping * step.component_mul(&step).dot(&left.normal().diagonal());
                moved.predicted_drop += step.dot(&left.gradient()) + damped;
                moved.points.push(self.turn.position(&at.state.points[j], &step));
            }
            if !self.costs {
                continue;
            }
            let objects = &moved.points[first..];
            moved.chi_square += dispatch(Costs { after: self.after, points: batch.clone(), objects, work })?;
            moved.chi_square += surveyed_chi_square(self.after, batch, objects)?;
        }
        Some(moved)
    }
}

/// `rho` of an image measurement that is predicted at `point`.
#[inline(always)]
pub fn loss_of(problem: &Problem, observation: &ImageObservation, point: [f64; 2]) -> f64 {
    let (dx, dy) = (observation.x - point[0], observation.y - point[1]);
    rho(problem.loss, (dx * dx + dy * dy) * observation.inverse_sigma * observation.inverse_sigma).0
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

/// Predicts measurements through every effect, one by one.
struct OnTheirOwn<'a> {
    after: &'a Prepared<'a>,
}

impl OnTheirOwn<'_> {
    /// `sum rho` of some points at `objects`. `None`: a measurement that cannot be predicted.
    fn chi_square(&self, points: Range<usize>, objects: &[Vector3<f64>]) -> Option<f64> {
        let Prepared { problem, structure, frames, .. } = self.after;
        let mut sum = surveyed_chi_square(self.after, points.clone(), objects)?;
        for (j, object) in points.zip(objects) {
            for observation in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
                let (stages, frame) = (&structure.stages, &frames[observation.image as usize]);
                let point = measure::predict_point(problem, stages, frame, observation, object)?;
                sum += loss_of(problem, observation, point);
            }
        }
        Some(sum)
    }
}
