//! Rows of the design matrix for a batch of points: linearised, weighted, and with the points taken out.
//!
//! Taking a point out is a projection of its rows, `X <- X - J V^-1 J'X` with `J` the derivatives by the point and `V =
//! J'J`. Sums over the projected rows are sums over what the points leave, and small rests of columns keep their
//! digits.

use super::batch::{Batch, Row, Share};
use super::columns::{Coordinate, Entries, Measured};
use super::products::{Lengths, PointOut, add};
use super::source::{Carry, Source};
use crate::adjust::AdjustError;
use crate::adjust::native::for_null_model::{
    Cameras, Contents, Curvature, Eight, Eights, MAX_DIM, NONE, POSE, Workspace, inverse_of_damped, rays_do_not_meet,
};
use crate::math::vectors::dispatch;
use crate::measure::lanes::{Lane, MISCLOSURE, POINT, Predictions, ROTATION, THETA};
use crate::measure::{self, MeasureError};
use crate::problem::Problem;
use nalgebra::{Matrix3, Vector3};
use pulp::{Simd, WithSimd};
use std::ops::Range;

impl Source<'_> {
    /// Rows of the points of a range, in place of those that a batch has.
    pub fn batch(&self, points: Range<usize>, batch: Batch) -> Result<Batch, AdjustError> {
        let Problem { point_start, control, .. } = self.problem;
        let before = |point: usize| control.partition_point(|observation| (observation.index as usize) < point);
        let controlled = before(points.end) - before(points.start);
        let measured = point_start[points.end] - point_start[points.start];
        let mut filler = Filler::new(self, batch, 2 * measured + 3 * controlled);
        filler.points(points)?;
        Ok(filler.finished())
    }

    /// Rows of observed antennas.
    pub fn antennas(&self, range: Range<usize>, batch: Batch) -> Result<Batch, AdjustError> {
        let mut filler = Filler::new(self, batch, 3 * range.len());
        for g in range {
            filler.antenna(g)?;
        }
        Ok(filler.finished())
    }
}

struct Filler<'a> {
    source: &'a Source<'a>,
    batch: Batch,
    /// Local entries of the rows that are being filled: of x and y, or of three coordinates.
    lists: [Vec<(u32, f64)>; 3],
    slot: Vec<u32>,
}

impl<'a> Filler<'a> {
    fn new(source: &'a Source<'a>, mut batch: Batch, rows: usize) -> Self {
        batch.begin(rows, source.dense());
        Self { source, batch, lists: Default::default(), slot: vec![NONE; source.local()] }
    }

    fn finished(mut self) -> Batch {
        self.batch.put_in_order(self.slot.len());
        self.batch
    }

    /// Appends an empty row; gives its number.
    fn row(&mut self, rank: u32, cell: u32, image: [f64; MAX_DIM], point: [f64; 3], v: f64) -> usize {
        let group = self.batch.groups.len() as u32;
        self.batch.rows.push(Row { rank, cell, image, point, v, locals: 0..0, group });
        self.batch.rows.len() - 1
    }

    /// Takes the local entries of the rows from `first` on out of their lists.
    fn keep_lists(&mut self, first: usize) {
        for (row, list) in self.batch.rows[first..].iter_mut().zip(&mut self.lists) {
            let start = self.batch.locals.len();
            self.batch.locals.append(list);
            row.locals = start..self.batch.locals.len();
        }
    }

    /// Entries of the base's border and of effects in the last rows, one per derivative.
    fn fill_effects(&mut self, first: usize, image: usize, weights: &[f64], derivative: impl Fn(usize, usize) -> f64) {
        let Source { structure, effects, .. } = self.source;
        let (dense, border) = (self.source.dense(), structure.border.len());
        for (i, weight) in weights.iter().enumerate() {
            let panel = &mut self.batch.panel[(first + i) * dense..(first + i + 1) * dense];
            for column in &structure.local[image] {
                panel[column.column as usize] = derivative(i, column.source as usize) * weight * column.scale;
            }
            for entry in &effects[image] {
                let value = derivative(i, entry.source as usize) * weight * entry.scale;
                if !entry.local {
                    panel[border + entry.column as usize] = value;
                } else if value != 0.0 {
                    self.lists[i].push((entry.column, value));
                }
            }
        }
    }

    /// The same in the two rows of an image measurement, which see the same unknowns.
    fn fill_measured(&mut self, first: usize, image: usize, predictions: &Predictions, lane: usize, weight: f64) {
        let Source { structure, effects, .. } = self.source;
        let (dense, border) = (self.source.dense(), structure.border.len());
        let (of_x, of_y) = self.batch.panel[first * dense..].split_at_mut(dense);
        let [x_list, y_list, _] = &mut self.lists;
        let [x_row, y_row] = &predictions.rows;
        let values = |source: u32, scale: f64| {
            let place = Contents::place_of(source);
            [x_row[place][lane] * weight * scale, y_row[place][lane] * weight * scale]
        };
        for column in &structure.local[image] {
            let to = column.column as usize;
            [of_x[to], of_y[to]] = values(column.source, column.scale);
        }
        for entry in &effects[image] {
            let [x, y] = values(entry.source, entry.scale);
            if !entry.local {
                let to = border + entry.column as usize;
                (of_x[to], of_y[to]) = (x, y);
                continue;
            }
            if x != 0.0 {
                x_list.push((entry.column, x));
            }
            if y != 0.0 {
                y_list.push((entry.column, y));
            }
        }
    }

    fn points(&mut self, points: Range<usize>) -> Result<(), AdjustError> {
        let Source { problem, state, stages, frames, .. } = self.source;
        let cameras = Cameras { problem, stages, frames };
        let mut work = Workspace::new(stages);
        let mut eights = Eights::new(cameras, &state.points[points.clone()], points.clone(), &mut work.views);
        let (mut point, mut first) = (points.start, self.batch.rows.len());
        let mut finish_until = |filler: &mut Self, end: usize| -> Result<(), AdjustError> {
            while point < end {
                filler.control(point)?;
                if filler.is_asked(first) {
                    filler.finish(first, Some(point))?;
                } else {
                    filler.forget(first);
                }
                (point, first) = (point + 1, filler.batch.rows.len());
            }
            Ok(())
        };
        while dispatch(Linearise { cameras, work: &mut work, eights: &mut eights })? {
            for lane in 0..work.eight.numbers.len() {
                finish_until(self, work.eight.points[lane])?;
                self.measured(&work.eight, &work.predictions, lane);
            }
        }
        finish_until(self, points.end)
    }

    /// Rows of one of eight measurements.
    fn measured(&mut self, eight: &Eight, predictions: &Predictions, lane: usize) {
        let Source { problem, structure, frames, extra, effect_columns, .. } = self.source;
        let number = eight.numbers.start + lane;
        let observation = &problem.observations[number];
        let (image, weight) = (observation.image as usize, eight.weights[lane]);
        let base = structure.rank[image] as usize * structure.dim;
        let first = self.batch.rows.len();
        let cell = self.source.cells.map_or(NONE, |cells| {
            // At its predicted place: that of the measurement goes with its own error.
            let [x, y] = [0, 1].map(|axis| predictions.rows[axis][MISCLOSURE][lane]);
            cells.of(image, [observation.x - x, observation.y - y])
        });
        for row in &predictions.rows {
            let weighed = |place: usize| row[place][lane] * weight;
            let mut by_image = [0.0; MAX_DIM];
            for k in 0..POSE {
                if structure.image_unknowns[base + k] != usize::MAX {
                    by_image[k] = weighed(ROTATION + k);
                }
            }
            for column in &structure.own[image] {
                by_image[column.row as usize] = weighed(THETA + column.source as usize) * column.scale;
            }
            let by_point = std::array::from_fn(|k| weighed(POINT + k));
            self.row(structure.rank[image], cell, by_image, by_point, weighed(MISCLOSURE));
        }
        self.fill_measured(first, image, predictions, lane, weight);
        let predicted = predictions.point.map(|coordinate| coordinate[lane]);
        let interior = &frames[image].interior;
        let measured = Measured { number, point: eight.points[lane], observation, predicted, interior };
        let (dense, first_dense) = (self.source.dense(), structure.border.len() + effect_columns[0]);
        let (x_panel, y_panel) = self.batch.panel[first * dense..].split_at_mut(dense);
        let [of_x, of_y, _] = &mut self.lists;
        let first_local = effect_columns[1] as u32;
        let mut x = Entries { dense: &mut x_panel[first_dense..], local: of_x, first_local, weight };
        let mut y = Entries { dense: &mut y_panel[first_dense..], local: of_y, first_local, weight };
        extra.image(&measured, &mut x, &mut y);
        self.keep_lists(first);
    }

    fn control(&mut self, j: usize) -> Result<(), AdjustError> {
        let Source { problem, state, stages, .. } = self.source;
        let Ok(c) = problem.control.binary_search_by_key(&(j as u32), |observation| observation.index) else {
            return Ok(());
        };
        let observation = &problem.control[c];
        let p = measure::predict_surveyed(problem, stages, &state.theta, &state.points[j])
            .ok_or_else(|| MeasureError::surveyed(problem, j))?;
        let first = self.batch.rows.len();
        let weights: [f64; 3] = std::array::from_fn(|i| 1.0 / observation.sigma[i]);
        for i in 0..3 {
            let by_point = std::array::from_fn(|k| p.derivative[(i, 3 + k)] * weights[i]);
            self.row(NONE, NONE, [0.0; MAX_DIM], by_point, (observation.position[i] - p.position[i]) * weights[i]);
        }
        // Control effects have no image of their own: any image's list of global parameters serves.
        self.fill_effects(first, 0, &weights, |i, source| if source < 12 { 0.0 } else { p.d_theta[source - 12][i] });
        self.position(first, &weights, |i| Coordinate::Control(c, i));
        Ok(())
    }

    /// Entries of further columns in the rows of an observed position.
    fn position(&mut self, first: usize, weights: &[f64; 3], coordinate: impl Fn(usize) -> Coordinate) {
        let Source { structure, effect_columns, extra, .. } = self.source;
        let (dense, first_dense) = (self.source.dense(), structure.border.len() + effect_columns[0]);
        for i in 0..3 {
            let mut entries = Entries {
                dense: &mut self.batch.panel[(first + i) * dense + first_dense..(first + i + 1) * dense],
                local: &mut self.lists[i],
                first_local: effect_columns[1] as u32,
                weight: weights[i],
            };
            extra.coordinate(coordinate(i), &mut entries);
        }
        self.keep_lists(first);
    }

    fn antenna(&mut self, g: usize) -> Result<(), AdjustError> {
        let Source { problem, structure, stages, frames, .. } = self.source;
        let observation = &problem.gnss[g];
        let image = observation.index as usize;
        let p = measure::predict_antenna(problem, stages, &frames[image], image)
            .ok_or_else(|| MeasureError::antenna(problem, image))?;
        let base = structure.rank[image] as usize * structure.dim;
        let first = self.batch.rows.len();
        let weights: [f64; 3] = std::array::from_fn(|i| 1.0 / observation.sigma[i]);
        for i in 0..3 {
            let mut by_image = [0.0; MAX_DIM];
            for k in 0..6 {
                if structure.image_unknowns[base + k] != usize::MAX {
                    by_image[k] = p.derivative[(i, k)] * weights[i];
                }
            }
            for column in &structure.own[image] {
                by_image[column.row as usize] = p.d_theta[column.source as usize][i] * weights[i] * column.scale;
            }
            let v = (observation.position[i] - p.position[i]) * weights[i];
            self.row(structure.rank[image], NONE, by_image, [0.0; 3], v);
        }
        let derivative = |i: usize, source: usize| if source < 12 { 0.0 } else { p.d_theta[source - 12][i] };
        self.fill_effects(first, image, &weights, derivative);
        self.position(first, &weights, |i| Coordinate::Gnss(g, i));
        self.finish(first, None)
    }

    /// Is there a column with entries in the rows from `first` on? Dense ones have them everywhere.
    fn is_asked(&self, first: usize) -> bool {
        let Source { effect_columns, extra, .. } = self.source;
        effect_columns[0] + extra.dense() > 0 || self.batch.rows[first..].iter().any(|row| !row.locals.is_empty())
    }

    /// Lets go of the rows from `first` on.
    fn forget(&mut self, first: usize) {
        let dense = self.source.dense();
        let Batch { rows, panel, .. } = &mut self.batch;
        panel[first * dense..rows.len() * dense].fill(0.0);
        rows.truncate(first);
    }

    /// Takes the base (where asked for) and the point out of the rows from `first` on.
    fn finish(&mut self, first: usize, point: Option<usize>) -> Result<(), AdjustError> {
        let dense = self.source.dense();
        let Batch { rows, panel, locals, shares, groups, length, score, squares, .. } = &mut self.batch;
        let end = rows.len();
        let rows = &mut rows[first..];
        let panel = &mut panel[first * dense..end * dense];
        dispatch(Lengths { panel: &*panel, length });
        if let Some(carry) = self.source.carry {
            dispatch(BaseOut { source: self.source, carry, rows, panel });
        }
        let start = shares.len();
        // Where there is no point, nothing is taken out.
        let mut inverse = Matrix3::zeros();
        if let Some(j) = point {
            let mut normal = Matrix3::zeros();
            let mut gradient = Vector3::zeros();
            for row in rows.iter() {
                let by_point = Vector3::from(row.point);
                normal += by_point * by_point.transpose();
                gradient += by_point * row.v;
            }
            inverse = inverse_of_damped(&normal, 0.0).ok_or_else(|| rays_do_not_meet(self.source.problem, j))?;
            let solved = inverse * gradient;
            for row in rows.iter_mut() {
                row.v -= Vector3::from(row.point).dot(&solved);
            }
            for row in rows.iter() {
                for (column, value) in &locals[row.locals.clone()] {
                    let slot = &mut self.slot[*column as usize];
                    if *slot == NONE {
                        *slot = (shares.len() - start) as u32;
                        shares.push(Share { column: *column, moved: [0.0; 3], taken: [0.0; 3], score: 0.0 });
                    }
                    let share = &mut shares[start + *slot as usize];
                    share.score += row.v * value;
                    for a in 0..3 {
                        share.moved[a] += row.point[a] * value;
                    }
                }
            }
            for share in &mut shares[start..] {
                self.slot[share.column as usize] = NONE;
                share.taken = (inverse * Vector3::from(share.moved)).into();
            }
            shares[start..].sort_unstable_by_key(|share| share.column);
        }
        dispatch(PointOut { rows, inverse: &inverse, panel, score, squares });
        groups.push(start..shares.len());
        Ok(())
    }
}

/// Eight measurements, linearised and weighed. `false` where there are no more.
pub(super) struct Linearise<'a, 'b> {
    pub cameras: Cameras<'b>,
    pub work: &'a mut Workspace,
    pub eights: &'a mut Eights<'b>,
}

impl WithSimd for Linearise<'_, '_> {
    type Output = Result<bool, MeasureError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { cameras, work, eights } = self;
        work.linearise(simd, cameras, Curvature::Weights, eights, &mut Lane::default())
    }
}

/// Takes the base's unknowns out of the dense columns behind its own.
struct BaseOut<'a> {
    source: &'a Source<'a>,
    carry: &'a Carry,
    rows: &'a [Row],
    /// Their dense columns, row by row.
    panel: &'a mut [f64],
}

impl WithSimd for BaseOut<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { source, carry, rows, panel } = self;
        let (dim, border) = (source.structure.dim, source.structure.border.len());
        let first_border = source.structure.images * dim;
        for (row, line) in rows.iter().zip(panel.chunks_exact_mut(source.dense())) {
            let (own, columns) = line.split_at_mut(border);
            let mut take = |unknown: usize, value: f64| {
                if value != 0.0 {
                    add(columns, value, &carry.moves[unknown * carry.columns..(unknown + 1) * carry.columns]);
                }
            };
            if row.rank != NONE {
                for k in 0..dim {
                    take(row.rank as usize * dim + k, row.image[k]);
                }
            }
            for (l, value) in own.iter().enumerate() {
                take(first_border + l, *value);
            }
        }
    }
}
