//! Score of many fixed shapes at once: for each column of a scan (an image-stage effect at one place and width of its searched parameters)
//! the projected length `M` and score `s` of its one linear parameter. Only the diagonal of `M` is formed, and one factorisation of the base
//! serves every scan, so hundreds of columns cost about as much as one iteration.

use super::factor::{Factor, Pattern, ReducedBorder};
use super::point::{Curvature, PointRows, Prepared, inverse_of_damped, rho};
use super::structure::Structure;
use super::system::System;
use super::{frames, linearise, pool, structure};
use crate::adjust::{AdjustError, LinearSolver};
use crate::camera::Interior;
use crate::measure::{self, Frame, Prediction};
use crate::problem::{ImageObservation, Problem, State};
use faer::Mat;
use nalgebra::Vector3;
use rayon::ThreadPool;
use rayon::prelude::*;
use std::ops::Range;

/// One shape of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scanned {
    /// `B'Pv` with the base taken out.
    pub score: f64,
    /// `B'PB` with the base taken out.
    pub information: f64,
    /// `B'PB` before.
    pub length: f64,
}

/// An image measurement at the base solution.
#[derive(Debug, Clone, Copy)]
pub struct Residual<'a> {
    /// The measurement.
    pub observation: &'a ImageObservation,
    /// Predicted point, px.
    pub predicted: [f64; 2],
    /// Interior orientation of its image.
    pub interior: &'a Interior,
    /// `P v`, 1/px.
    pub pull: [f64; 2],
    /// `P`, 1/px^2.
    pub weight: f64,
}

/// Gives, for an image measurement and its predicted point, the columns that it touches: index, and derivative of the image point (px) by the
/// column's parameter.
pub trait Shapes: Sync {
    /// Number of columns.
    fn count(&self) -> usize;
    /// Appends `(column, d x, d y)` for every column that moves this measurement.
    fn touch(&self, measured: &Residual<'_>, out: &mut Vec<(u32, f64, f64)>);
}

/// A base solution, factorised.
pub struct Scanner<'a> {
    problem: &'a Problem,
    state: &'a State,
    structure: Structure,
    frames: Vec<Frame>,
    system: System,
    factor: Factor,
    pool: ThreadPool,
}

/// Parts into which the points are split: each holds a whole set of columns, so there are few.
const PARTS: usize = 4;

impl<'a> Scanner<'a> {
    /// Linearises and factorises `problem` at its solution `state`. Errors: the base is singular; a state that cannot be projected.
    pub fn new(problem: &'a Problem, state: &'a State, threads: usize) -> Result<Self, AdjustError> {
        let structure = structure(problem)?;
        let frames = frames(problem, &structure, state)?;
        let at = Prepared { problem, structure: &structure, state, frames: &frames };
        let pool = pool(threads)?;
        let system = pool.install(|| linearise::linearise(&at, 0.0, Curvature::Weights))?;
        let pattern = Pattern::new(&structure, LinearSolver::Auto);
        let reduced = ReducedBorder::new(&structure, &system, pattern.as_ref(), 0.0).ok();
        let singular = || AdjustError::Singular { solver: super::NAME, directions: Vec::new() };
        let factor = reduced.and_then(Factor::of).ok_or_else(singular)?;
        Ok(Self { problem, state, structure, frames, system, factor, pool })
    }

    /// The threads that scans use.
    pub fn pool(&self) -> &ThreadPool {
        &self.pool
    }

    /// Every image measurement, in the order of the problem.
    pub fn residuals(&self) -> Vec<Residual<'_>> {
        let Self { problem, structure, state, frames, .. } = self;
        let at = Prepared { problem, structure, state, frames };
        let mut prediction = Prediction::default();
        let mut residuals = Vec::with_capacity(problem.observations.len());
        for j in 0..problem.point_sources.len() {
            let observations = &problem.observations[problem.point_start[j]..problem.point_start[j + 1]];
            residuals
                .extend(observations.iter().filter_map(|observation| residual(&at, j, observation, &mut prediction)));
        }
        residuals
    }

    /// Scans `shapes`: one result per column.
    pub fn scan(&self, shapes: &dyn Shapes) -> Vec<Scanned> {
        let Self { problem, structure, system, pool, .. } = self;
        let at = Prepared { problem, structure, state: self.state, frames: &self.frames };
        let points = problem.point_sources.len();
        let size = points.div_ceil(PARTS).max(1);
        let range = |k: usize| (k * size).min(points)..((k + 1) * size).min(points);
        let ranges: Vec<Range<usize>> = (0..PARTS).map(range).collect();
        let mut total = Sums::zeros(&at, shapes.count());
        for wave in ranges.chunks(pool.current_num_threads()) {
            let parts: Vec<Sums> = pool.install(|| {
                wave.par_iter()
                    .map(|range| match structure.dim {
                        6 => scan_points::<6>(&at, range.clone(), shapes),
                        7 => scan_points::<7>(&at, range.clone(), shapes),
                        8 => scan_points::<8>(&at, range.clone(), shapes),
                        _ => scan_points::<{ super::MAX_DIM }>(&at, range.clone(), shapes),
                    })
                    .collect()
            });
            for part in &parts {
                total.add(part);
            }
        }
        let n = structure.images * structure.dim;
        let columns = Mat::<f64>::from_fn(total.rows, total.count, |i, c| total.columns[i * total.count + c]);
        let solved = self.factor.solve_columns(&columns);
        (0..total.count)
            .map(|c| {
                let mut scanned = total.own[c];
                for i in 0..total.rows {
                    let rhs = if i < n { system.rhs_images[i] } else { system.rhs_border[i - n] };
                    scanned.information -= columns[(i, c)] * solved[(i, c)];
                    scanned.score -= solved[(i, c)] * rhs;
                }
                scanned
            })
            .collect()
    }
}

/// `None` for a measurement that cannot be predicted; there is none at a state that was linearised.
fn residual<'a>(
    at: &Prepared<'a>,
    j: usize,
    observation: &'a ImageObservation,
    prediction: &mut Prediction,
) -> Option<Residual<'a>> {
    let frame = &at.frames[observation.image as usize];
    let stages = &at.structure.stages;
    let predicted = measure::predict_point(at.problem, stages, frame, observation, &at.state.points[j], prediction)?;
    let v = [observation.x - predicted[0], observation.y - predicted[1]];
    let weight = observation.inverse_sigma.powi(2);
    let weight = weight * rho(at.problem.loss, weight * (v[0] * v[0] + v[1] * v[1])).1;
    Some(Residual { observation, predicted, interior: &frame.interior, pull: v.map(|v| v * weight), weight })
}

/// What a part of the points adds.
struct Sums {
    rows: usize,
    count: usize,
    own: Vec<Scanned>,
    /// Reduced unknown i (images by rank, border), column c: `columns[i * count + c]`.
    columns: Vec<f64>,
}

impl Sums {
    fn zeros(at: &Prepared<'_>, count: usize) -> Self {
        let rows = at.structure.images * at.structure.dim + at.structure.border.len();
        Self { rows, count, own: vec![Scanned::default(); count], columns: vec![0.0; rows * count] }
    }

    fn add(&mut self, part: &Sums) {
        for (a, b) in self.columns.iter_mut().zip(&part.columns) {
            *a += b;
        }
        for (a, b) in self.own.iter_mut().zip(&part.own) {
            a.score += b.score;
            a.information += b.information;
            a.length += b.length;
        }
    }
}

fn scan_points<const D: usize>(at: &Prepared<'_>, points: Range<usize>, shapes: &dyn Shapes) -> Sums {
    let (problem, structure) = (at.problem, at.structure);
    let (n, count) = (structure.images * D, shapes.count());
    let mut sums = Sums::zeros(at, count);
    let mut rows = PointRows::<D>::new();
    let mut prediction = Prediction::default();
    let mut touched: Vec<(u32, f64, f64)> = Vec::new();
    let mut by_point = vec![Vector3::<f64>::zeros(); count];
    let mut seen: Vec<u32> = Vec::new();
    for j in points {
        // The state was linearised just before.
        if rows.linearise(at, j).is_err() {
            continue;
        }
        let Some(inverse) = inverse_of_damped(&rows.v_matrix, 0.0) else { continue };
        let start = problem.point_start[j];
        for column in seen.drain(..) {
            by_point[column as usize] = Vector3::zeros();
        }
        for (r, row) in rows.rows.iter().enumerate() {
            touched.clear();
            let Some(measured) = residual(at, j, &problem.observations[start + r], &mut prediction) else { continue };
            shapes.touch(&measured, &mut touched);
            let root = measured.weight.sqrt();
            for (column, x, y) in &mut touched {
                *x *= root;
                *y *= root;
                let c = *column as usize;
                let own = &mut sums.own[c];
                own.length += *x * *x + *y * *y;
                own.information += *x * *x + *y * *y;
                own.score += *x * row.v[0] + *y * row.v[1];
                if by_point[c] == Vector3::zeros() {
                    seen.push(*column);
                }
                by_point[c] += Vector3::from(row.point[0]) * *x + Vector3::from(row.point[1]) * *y;
            }
            // Line by line: the columns that a measurement touches are neighbours there.
            let mut add = |line: usize, [a, b]: [f64; 2]| {
                let line = &mut sums.columns[line * count..(line + 1) * count];
                for (column, x, y) in &touched {
                    line[*column as usize] += a * x + b * y;
                }
            };
            for k in 0..D {
                add(row.rank as usize * D + k, [row.image[0][k], row.image[1][k]]);
            }
            let shared = &rows.shared[r];
            for (k, l) in shared.columns.index().iter().enumerate() {
                add(n + *l as usize, [shared.x[k], shared.y[k]]);
            }
        }
        let solved = inverse * rows.gradient;
        seen.sort_unstable();
        seen.dedup();
        let taken: Vec<Vector3<f64>> = seen.iter().map(|c| inverse * by_point[*c as usize]).collect();
        for (column, taken) in seen.iter().zip(&taken) {
            let c = *column as usize;
            sums.own[c].information -= taken.dot(&by_point[c]);
            sums.own[c].score -= by_point[c].dot(&solved);
        }
        for row in &rows.rows {
            let base = row.rank as usize * D;
            for k in 0..D {
                let w = Vector3::from(row.w[k]);
                let line = &mut sums.columns[(base + k) * count..(base + k + 1) * count];
                for (column, taken) in seen.iter().zip(&taken) {
                    line[*column as usize] -= w.dot(taken);
                }
            }
        }
        for (l, border) in rows.columns.index().iter().enumerate() {
            let w = Vector3::new(rows.w_shared[0][l], rows.w_shared[1][l], rows.w_shared[2][l]);
            let border = n + *border as usize;
            let line = &mut sums.columns[border * count..(border + 1) * count];
            for (column, taken) in seen.iter().zip(&taken) {
                line[*column as usize] -= w.dot(taken);
            }
        }
    }
    sums
}
