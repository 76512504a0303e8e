//! Rows of the design matrix for the measurements of some points, weighted and scaled, as the sums over them need it: whole vectors, one row
//! of the border and one of the image's unknowns for each coordinate.

mod fill;

use super::aligned::Aligned;
use super::point::{Curvature, LEAST_CURVATURE, Prepared, curvature_along, rho};
use super::structure::{FIRST_THETA, LocalColumn, NONE, POINT, POSE, Structure};
use super::vectors::dispatch;
use crate::measure::lanes::{LANES, Predictions, Views};
use crate::measure::{self, MeasureError, Prediction};
use crate::problem::{ImageObservation, Loss, Problem};
use fill::{FillPlain, FillStraight};
use std::ops::Range;

/// Measurements of a batch: their rows stay in the nearest cache.
const BATCH_MEASUREMENTS: usize = 64;
/// A sum over rows takes them in groups of so many pairs; the last group is filled up with zeros.
pub const GROUP: usize = 4;

/// Rows of the measurements of some points, in pairs: x and y of an image measurement; of a surveyed point x and y, then z and nothing.
pub struct Rows {
    /// Numbers of a row of the border: its columns, zeros, the point (3) and the misclosure.
    pub width: usize,
    /// Numbers of a row of an image's unknowns: the unknowns, and zeros.
    pub stride: usize,
    /// Two rows of the border for each pair.
    pub shared: Aligned,
    /// Two rows of the image for each pair.
    pub image: Aligned,
    /// Rank of each pair's image; [`NONE`] for surveyed coordinates.
    pub rank: Vec<u32>,
    /// Pairs of each point.
    pub points: Vec<OfPoint>,
    /// `sum rho`.
    pub chi_square: f64,
    curvature: Curvature,
    views: Views,
    predictions: Predictions,
    prediction: Prediction,
}

/// Pairs of a point.
#[derive(Debug, Clone)]
pub struct OfPoint {
    /// Position of the point in the problem.
    pub number: usize,
    /// Its image measurements.
    pub measured: Range<usize>,
    /// Its surveyed coordinates.
    pub surveyed: Range<usize>,
}

impl OfPoint {
    /// All of them.
    pub fn pairs(&self) -> impl Iterator<Item = usize> + Clone {
        self.measured.clone().chain(self.surveyed.clone())
    }
}

/// Points in groups of some measurements each.
pub fn batches(problem: &Problem, points: &Range<usize>) -> Vec<Range<usize>> {
    let starts = &problem.point_start;
    let (mut batches, mut first) = (Vec::new(), points.start);
    while first < points.end {
        let fits = starts[first..=points.end].partition_point(|start| *start <= starts[first] + BATCH_MEASUREMENTS);
        let end = first + fits.saturating_sub(1).max(1);
        batches.push(first..end);
        first = end;
    }
    batches
}

impl Rows {
    /// Room for a batch.
    pub fn new(structure: &Structure, curvature: Curvature) -> Self {
        let (width, stride) = (structure.width, structure.stride);
        Self {
            width,
            stride,
            shared: Aligned::zeros(0),
            image: Aligned::zeros(0),
            rank: Vec::new(),
            points: Vec::new(),
            chi_square: 0.0,
            curvature,
            views: Views::default(),
            predictions: Predictions::default(),
            prediction: Prediction::default(),
        }
    }

    /// Row of the border of a pair's first or second coordinate.
    #[inline(always)]
    pub fn shared_row(&self, pair: usize, i: usize) -> &[f64] {
        &self.shared[(2 * pair + i) * self.width..][..self.width]
    }

    /// Row of the image's unknowns.
    #[inline(always)]
    pub fn image_row(&self, pair: usize, i: usize) -> &[f64] {
        &self.image[(2 * pair + i) * self.stride..][..self.stride]
    }

    /// Position of the derivatives by the point in a row of the border; the misclosure follows.
    #[inline(always)]
    pub fn point_column(&self) -> usize {
        self.width - POINT
    }

    /// Linearises some points. Errors: an observation that cannot be computed.
    pub fn fill(&mut self, at: &Prepared<'_>, points: Range<usize>) -> Result<(), MeasureError> {
        let Prepared { problem, .. } = at;
        let starts = &problem.point_start;
        let measurements = starts[points.start]..starts[points.end];
        let controls = problem.control.partition_point(|c| (c.index as usize) < points.start)
            ..problem.control.partition_point(|c| (c.index as usize) < points.end);
        self.clear(measurements.len() + 2 * controls.len());
        self.rank.resize(measurements.len() + 2 * controls.len(), NONE);
        let mut surveyed = measurements.len();
        for j in points.clone() {
            let has = problem.control[controls.clone()].binary_search_by_key(&(j as u32), |c| c.index).is_ok();
            let end = surveyed + if has { 2 } else { 0 };
            let measured = starts[j] - measurements.start..starts[j + 1] - measurements.start;
            self.points.push(OfPoint { number: j, measured, surveyed: surveyed..end });
            surveyed = end;
        }
        let stages = &at.structure.stages;
        if stages.plain_image() {
            dispatch(FillPlain { rows: self, at, points })?;
        } else if stages.straight() {
            dispatch(FillStraight { rows: self, at, points })?;
        } else {
            self.fill_with_effects(at, points)?;
        }
        for (c, pair) in controls.zip((measurements.len()..).step_by(2)) {
            self.fill_surveyed(at, c, pair)?;
        }
        Ok(())
    }

    fn clear(&mut self, pairs: usize) {
        let room = pairs.next_multiple_of(GROUP);
        if self.shared.len() < 2 * room * self.width {
            self.shared = Aligned::zeros(2 * room * self.width);
            self.image = Aligned::zeros(2 * room * self.stride);
        } else {
            self.shared[..2 * room * self.width].fill(0.0);
            self.image[..2 * room * self.stride].fill(0.0);
        }
        self.rank.clear();
        self.points.clear();
        self.chi_square = 0.0;
    }

    fn fill_with_effects(&mut self, at: &Prepared<'_>, points: Range<usize>) -> Result<(), MeasureError> {
        let Prepared { problem, structure, state, frames } = at;
        let mut prediction = std::mem::take(&mut self.prediction);
        let mut pair = 0;
        for j in points {
            for observation in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
                let (image, object) = (observation.image as usize, &state.points[j]);
                let (stages, frame) = (&structure.stages, &frames[image]);
                measure::predict(problem, stages, frame, observation, object, &mut prediction)
                    .ok_or_else(|| MeasureError::image_point(problem, j, image))?;
                self.store(at, observation, pair, &prediction);
                pair += 1;
            }
        }
        self.prediction = prediction;
        Ok(())
    }

    /// Stores the rows of a measurement that was predicted.
    fn store(&mut self, at: &Prepared<'_>, observation: &ImageObservation, pair: usize, p: &Prediction) {
        let structure = at.structure;
        let image = observation.image as usize;
        let Weighed { weight, v, shrink } = self.weigh(at, observation, pair, p.point);
        let (width, stride, point) = (self.width, self.stride, self.point_column());
        for i in 0..2 {
            let shared = &mut self.shared[(2 * pair + i) * width..][..width];
            for column in &structure.local[image] {
                let derivative = match column.source {
                    k if k < FIRST_THETA => p.d_camera[i][k as usize],
                    k => p.d_theta[i][(k - FIRST_THETA) as usize],
                };
                shared[column.column as usize] = derivative * weight * column.scale;
            }
            for k in 0..3 {
                shared[point + k] = p.d_point[i][k] * weight;
            }
            shared[point + 3] = v[i];
            let own = &mut self.image[(2 * pair + i) * stride..][..stride];
            for (own, d) in own.iter_mut().zip(p.d_pose[i]) {
                *own = d * weight;
            }
            for column in &structure.own[image] {
                own[column.row as usize] = p.d_theta[i][column.source as usize] * weight * column.scale;
            }
        }
        self.finish(structure, pair, shrink);
    }

    /// Weight and weighted misclosure of a measurement that is predicted at `point`; adds its loss.
    #[inline(always)]
    fn weigh(&mut self, at: &Prepared<'_>, observation: &ImageObservation, pair: usize, point: [f64; 2]) -> Weighed {
        let loss = at.problem.loss;
        self.rank[pair] = at.structure.rank[observation.image as usize];
        let misclosure = [observation.x - point[0], observation.y - point[1]];
        let normalised = [misclosure[0] * observation.inverse_sigma, misclosure[1] * observation.inverse_sigma];
        let s = normalised[0] * normalised[0] + normalised[1] * normalised[1];
        let (cost, slope) = rho(loss, s);
        self.chi_square += cost;
        let weight =
            if loss == Loss::None { observation.inverse_sigma } else { observation.inverse_sigma * slope.sqrt() };
        let along = if self.curvature == Curvature::Newton { curvature_along(loss, s) } else { 1.0 };
        let direction = || [normalised[0] / s.sqrt(), normalised[1] / s.sqrt()];
        let shrink = (along < 1.0).then(|| (direction(), along.max(LEAST_CURVATURE).sqrt()));
        Weighed { weight, v: [misclosure[0] * weight, misclosure[1] * weight], shrink }
    }

    /// What is done to rows once their derivatives are there: held unknowns have none.
    #[inline(always)]
    fn finish(&mut self, structure: &Structure, pair: usize, shrink: Option<([f64; 2], f64)>) {
        let rank = self.rank[pair] as usize;
        if structure.holds_pose[rank] {
            let held = &structure.image_unknowns[rank * structure.dim..][..POSE];
            for k in (0..POSE).filter(|k| held[*k] == usize::MAX) {
                for i in 0..2 {
                    self.image[(2 * pair + i) * self.stride + k] = 0.0;
                }
            }
        }
        if let Some((u, share)) = shrink {
            self.shrink_along(pair, u, share);
        }
    }

    /// Spreads weighted derivatives of up to eight measurements over their rows. Effects that act elsewhere do not move image points: columns of
    /// theirs stay zero.
    #[inline(always)]
    fn spread(&mut self, at: &Prepared<'_>, numbers: Range<usize>, start: usize, p: &Predictions) {
        let (width, stride, point) = (self.width, self.stride, self.point_column());
        let Structure { local, one_list, .. } = at.structure;
        let pairs = numbers.start - start..numbers.end - start;
        let shared = &mut self.shared[2 * pairs.start * width..2 * pairs.end * width];
        let image = &mut self.image[2 * pairs.start * stride..2 * pairs.end * stride];
        let of_camera = |column: &&LocalColumn| column.source < FIRST_THETA;
        for i in 0..2 {
            if *one_list {
                for column in local.first().into_iter().flatten().filter(of_camera) {
                    let values = &p.d_camera[i][column.source as usize];
                    spread_lane(&mut shared[i * width + column.column as usize..], 2 * width, values, column.scale);
                }
            } else {
                for (lane, number) in numbers.clone().enumerate() {
                    let image = at.problem.observations[number].image as usize;
                    for column in local[image].iter().filter(of_camera) {
                        shared[(2 * lane + i) * width + column.column as usize] =
                            p.d_camera[i][column.source as usize][lane] * column.scale;
                    }
                }
            }
            for k in 0..3 {
                spread_lane(&mut shared[i * width + point + k..], 2 * width, &p.d_point[i][k], 1.0);
                spread_lane(&mut image[i * stride + k..], 2 * stride, &p.d_rotation[i][k], 1.0);
                spread_lane(&mut image[i * stride + 3 + k..], 2 * stride, &p.d_point[i][k], -1.0);
            }
        }
    }

    /// Shrinks the derivatives along the unit vector `u` by `share`, and lengthens the misclosure that much, which lies along it: the same
    /// gradient, less curvature.
    fn shrink_along(&mut self, pair: usize, u: [f64; 2], share: f64) {
        let misclosure = self.width - 1;
        let (x, y) = self.shared[2 * pair * self.width..][..2 * self.width].split_at_mut(self.width);
        let v = [x[misclosure], y[misclosure]].map(|v| v / share);
        let (own_x, own_y) = self.image[2 * pair * self.stride..][..2 * self.stride].split_at_mut(self.stride);
        for (x, y) in x.iter_mut().zip(y.iter_mut()).chain(own_x.iter_mut().zip(own_y)) {
            let along = (1.0 - share) * (u[0] * *x + u[1] * *y);
            *x -= along * u[0];
            *y -= along * u[1];
        }
        (x[misclosure], y[misclosure]) = (v[0], v[1]);
    }

    /// Rows of the surveyed coordinates number `c`, in two pairs.
    fn fill_surveyed(&mut self, at: &Prepared<'_>, c: usize, pair: usize) -> Result<(), MeasureError> {
        let Prepared { problem, structure, state, .. } = at;
        let observation = &problem.control[c];
        let j = observation.index as usize;
        let p = measure::predict_surveyed(problem, &structure.stages, &state.theta, &state.points[j])
            .ok_or_else(|| MeasureError::surveyed(problem, j))?;
        let (width, point) = (self.width, self.point_column());
        for i in 0..3 {
            let weight = 1.0 / observation.sigma[i];
            let row = &mut self.shared[(2 * pair + i) * width..][..width];
            // Control effects have no image of their own: any image's list of global parameters serves.
            for column in structure.local.first().into_iter().flatten().filter(|column| column.source >= FIRST_THETA) {
                let d = p.d_theta[(column.source - FIRST_THETA) as usize][i];
                row[column.column as usize] = d * weight * column.scale;
            }
            for k in 0..3 {
                row[point + k] = p.derivative[(i, 3 + k)] * weight;
            }
            let v = (observation.position[i] - p.position[i]) * weight;
            row[point + 3] = v;
            self.chi_square += v * v;
        }
        Ok(())
    }
}

/// How much a measurement weighs.
struct Weighed {
    weight: f64,
    /// Misclosure times weight.
    v: [f64; 2],
    /// See [`Rows::shrink_along`].
    shrink: Option<([f64; 2], f64)>,
}

/// Every `step`-th place of `row` gets a value of a lane, as long as there are places.
#[inline(always)]
fn spread_lane(row: &mut [f64], step: usize, lane: &[f64; LANES], scale: f64) {
    for (place, value) in row.iter_mut().step_by(step).zip(lane) {
        *place = value * scale;
    }
}
