//! Sums over the rows of all points: normal matrices of columns among each other and with the base, in an order that depends neither on the
//! number of threads nor on how the columns are split.
//!
//! Points go through in waves of batches. The rows of a wave are made side by side, while each part of the sums over the wave before is added
//! up by one thread, over the batches in their order.

use super::rows::{Batch, Share, Source, add};
use crate::adjust::AdjustError;
use crate::adjust::native::MAX_DIM;
use crate::adjust::native::structure::NONE;
use crate::adjust::native::vectors::dispatch;
use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

/// Image measurements of a batch: its rows then stay in the processor's cache while they are summed.
const BATCH_MEASUREMENTS: usize = 400;
/// Batches of a wave: enough to keep some threads busy, few enough that the rows of two waves take some 50 MB.
const WAVE: usize = 12;
/// Columns of a product that one task sums.
const TASK_COLUMNS: usize = 48;
/// Tasks per thread that the images, and the local columns, are split into: each looks through all rows of a wave.
const LINE_TASKS: usize = 2;

/// Sums over all rows. `d` dense columns (the base's border first), `l` local ones.
pub(super) struct Sums {
    pub dense: usize,
    pub local: usize,
    /// `D'D`, d x d, column by column; the lower triangle counts.
    pub dense_dense: Vec<f64>,
    /// `L'D`, l x d, row by row.
    pub local_dense: Vec<f64>,
    /// `L'L`, l x l, row by row; the upper triangle counts. Of the diagonal alone, one number per column, where asked for.
    pub local_local: Vec<f64>,
    /// Image unknowns with dense columns, row by row.
    pub image_dense: Vec<f64>,
    /// Image unknowns with local columns: by image, then column, then unknown of the image, which are summed side by side.
    image_local: Vec<f64>,
    /// `D'v`.
    pub score_dense: Vec<f64>,
    /// `L'v`.
    pub score_local: Vec<f64>,
    /// Sum of squares of dense columns before anything is taken out.
    pub length_dense: Vec<f64>,
    /// The same of local columns.
    pub length_local: Vec<f64>,
    /// Sum over the points of the squared part that each has of a dense column's score.
    pub squares_dense: Vec<f64>,
    /// The same of local columns.
    pub squares_local: Vec<f64>,
    diagonal_alone: bool,
}

/// Calls `each` with the batches of every wave in turn: points first, then antennas.
pub(super) fn waves(source: &Source<'_>, mut each: impl FnMut(&[Batch]) + Send) -> Result<(), AdjustError> {
    let mut ranges = point_ranges(source);
    let points = ranges.len();
    ranges.extend(ranges_of(source.problem.gnss.len(), BATCH_MEASUREMENTS));
    let numbered: Vec<(usize, Range<usize>)> = ranges.into_iter().enumerate().collect();
    let rows = |wave: &[(usize, Range<usize>)]| -> Result<Vec<Batch>, AdjustError> {
        wave.par_iter()
            .map(|(number, range)| match *number < points {
                true => source.batch(range.clone()),
                false => source.antennas(range.clone()),
            })
            .collect()
    };
    let mut made: Vec<Batch> = Vec::new();
    for wave in numbered.chunks(WAVE) {
        let (next, ()) = rayon::join(|| rows(wave), || each(&made));
        made = next?;
    }
    each(&made);
    Ok(())
}

/// Ranges of points with about as many measurements each.
fn point_ranges(source: &Source<'_>) -> Vec<Range<usize>> {
    let starts = &source.problem.point_start;
    let points = starts.len() - 1;
    let (mut ranges, mut first) = (Vec::new(), 0);
    while first < points {
        let end = starts.partition_point(|start| *start < starts[first] + BATCH_MEASUREMENTS).min(points);
        ranges.push(first..end.max(first + 1));
        first = end.max(first + 1);
    }
    ranges
}

fn ranges_of(count: usize, size: usize) -> Vec<Range<usize>> {
    (0..count.div_ceil(size)).map(|k| k * size..((k + 1) * size).min(count)).collect()
}

/// A loop over rows, compiled for wide registers: numbers side by side are added each for itself, so that every width gives the same.
struct Wide<F>(F);

impl<F: FnOnce()> WithSimd for Wide<F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        (self.0)();
    }
}

impl Sums {
    /// Image unknown `row` (by rank, then unknown) with a local column.
    pub fn image_local(&self, row: usize, dim: usize, column: usize) -> f64 {
        self.image_local[(row / dim * self.local + column) * dim + row % dim]
    }

    /// Gives the sums with image unknowns back.
    pub fn forget_images(&mut self) {
        (self.image_dense, self.image_local) = (Vec::new(), Vec::new());
    }

    /// Sums over everything. `diagonal_alone`: of `L'L` its diagonal.
    pub fn of(source: &Source<'_>, diagonal_alone: bool) -> Result<Self, AdjustError> {
        let (d, l) = (source.dense(), source.local());
        let unknowns = source.structure.images * source.structure.dim;
        let mut sums = Self {
            dense: d,
            local: l,
            dense_dense: vec![0.0; d * d],
            local_dense: vec![0.0; l * d],
            local_local: vec![0.0; if diagonal_alone { l } else { l * l }],
            image_dense: vec![0.0; unknowns * d],
            image_local: vec![0.0; unknowns * l],
            score_dense: vec![0.0; d],
            score_local: vec![0.0; l],
            length_dense: vec![0.0; d],
            length_local: vec![0.0; l],
            squares_dense: vec![0.0; d],
            squares_local: vec![0.0; l],
            diagonal_alone,
        };
        waves(source, |batches| sums.add(source, batches))?;
        Ok(sums)
    }

    fn add(&mut self, source: &Source<'_>, batches: &[Batch]) {
        let (d, l, dim) = (self.dense, self.local, source.structure.dim);
        let tasks = LINE_TASKS * rayon::current_num_threads();
        let [images, locals] = [source.structure.images, l].map(|lines| lines.div_ceil(tasks).max(1));
        let local_width = if self.diagonal_alone { 1 } else { l };
        let (score_dense, length_dense) = (&mut self.score_dense, &mut self.length_dense);
        let squares_dense = &mut self.squares_dense;
        rayon::scope(|scope| {
            let dense = DenseScores { score: score_dense, length: length_dense, squares: squares_dense };
            scope.spawn(move |_| dispatch(Wide(|| dense.add(batches))));
            for (task, columns) in self.dense_dense.chunks_mut((TASK_COLUMNS * d).max(1)).enumerate() {
                scope.spawn(move |_| multiply(batches, d, task * TASK_COLUMNS, columns));
            }
            let dense = self.image_dense.chunks_mut((images * dim * d).max(1));
            for (task, lines) in dense.enumerate() {
                scope.spawn(move |_| dispatch(Wide(|| add_images_dense(batches, d, dim, task * images, lines))));
            }
            let local = self.image_local.chunks_mut((images * dim * l).max(1));
            for (task, lines) in local.enumerate() {
                let first = task * images;
                scope.spawn(move |_| match dim {
                    6 => dispatch(Wide(|| add_images_local::<6>(batches, l, first, lines))),
                    7 => dispatch(Wide(|| add_images_local::<7>(batches, l, first, lines))),
                    8 => dispatch(Wide(|| add_images_local::<8>(batches, l, first, lines))),
                    _ => dispatch(Wide(|| add_images_local::<MAX_DIM>(batches, l, first, lines))),
                });
            }
            let dense = self.local_dense.chunks_mut((locals * d).max(1));
            let local = self.local_local.chunks_mut((locals * local_width).max(1));
            let scores = self.score_local.chunks_mut(locals);
            let lengths = self.length_local.chunks_mut(locals);
            let squares = self.squares_local.chunks_mut(locals);
            let parts = dense.zip(local).zip(scores).zip(lengths).zip(squares);
            for (task, ((((dense, local), score), length), squares)) in parts.enumerate() {
                let first = task * locals;
                let lines = LocalLines { first, d, width: local_width, dense, local, score, length, squares };
                scope.spawn(move |_| dispatch(Wide(|| lines.add(batches))));
            }
        });
    }
}

/// Scores and lengths of the dense columns.
struct DenseScores<'a> {
    score: &'a mut [f64],
    length: &'a mut [f64],
    squares: &'a mut [f64],
}

impl DenseScores<'_> {
    #[inline(always)]
    fn add(self, batches: &[Batch]) {
        let d = self.score.len();
        let mut part = vec![0.0; d];
        for batch in batches {
            add(self.length, 1.0, &batch.length);
            let rows: Vec<_> = batch.rows.iter().zip(batch.panel.chunks_exact(d)).collect();
            for of_point in rows.chunk_by(|(a, _), (b, _)| a.group == b.group) {
                part.fill(0.0);
                for (row, line) in of_point {
                    add(&mut part, row.v, line);
                }
                add(self.score, 1.0, &part);
                self.squares.iter_mut().zip(&part).for_each(|(sum, part)| *sum += part * part);
            }
        }
    }
}

/// `columns += D'D`, columns from `first` on.
fn multiply(batches: &[Batch], d: usize, first: usize, columns: &mut [f64]) {
    let count = columns.len() / d;
    for batch in batches {
        let rows = MatRef::from_column_major_slice(&batch.panel, d, batch.rows.len());
        let product = MatMut::from_column_major_slice_mut(columns, d, count).subrows_mut(first, d - first);
        let (below, own) = (rows.subrows(first, d - first), rows.subrows(first, count));
        matmul(product, Accum::Add, below, own.transpose(), 1.0, Par::Seq);
    }
}

#[inline(always)]
fn add_images_dense(batches: &[Batch], d: usize, dim: usize, first: usize, lines: &mut [f64]) {
    let images = first..first + lines.len() / (dim * d).max(1);
    for batch in batches {
        for (row, line) in batch.rows.iter().zip(batch.panel.chunks_exact(d)) {
            let rank = row.rank as usize;
            if row.rank == NONE || !images.contains(&rank) {
                continue;
            }
            let own = &mut lines[(rank - first) * dim * d..(rank - first + 1) * dim * d];
            for (sum, value) in own.chunks_exact_mut(d).zip(row.image) {
                add(sum, value, line);
            }
        }
    }
}

#[inline(always)]
fn add_images_local<const D: usize>(batches: &[Batch], l: usize, first: usize, lines: &mut [f64]) {
    let images = first..first + lines.len() / (D * l).max(1);
    for batch in batches {
        for row in &batch.rows {
            let rank = row.rank as usize;
            if row.rank == NONE || !images.contains(&rank) {
                continue;
            }
            let own = &mut lines[(rank - first) * D * l..(rank - first + 1) * D * l];
            let (own, _) = own.as_chunks_mut::<D>();
            let image: [f64; D] = std::array::from_fn(|k| row.image[k]);
            let add = |sums: &mut [f64; D], entry: f64| {
                for (sum, value) in sums.iter_mut().zip(image) {
                    *sum += value * entry;
                }
            };
            for (column, entry) in &batch.locals[row.locals.clone()] {
                add(&mut own[*column as usize], *entry);
            }
            for share in &batch.shares[batch.groups[row.group as usize].clone()] {
                let taken: f64 = (0..3).map(|a| row.point[a] * share.taken[a]).sum();
                add(&mut own[share.column as usize], -taken);
            }
        }
    }
}

/// Sums of some local columns with everything.
struct LocalLines<'a> {
    first: usize,
    d: usize,
    /// Columns of `local`: all, or one where the diagonal is enough.
    width: usize,
    dense: &'a mut [f64],
    local: &'a mut [f64],
    score: &'a mut [f64],
    length: &'a mut [f64],
    squares: &'a mut [f64],
}

impl LocalLines<'_> {
    #[inline(always)]
    fn add(self, batches: &[Batch]) {
        let Self { first, d, width, dense, local, score, length, squares } = self;
        let own = first..first + score.len();
        for batch in batches {
            for (row, line) in batch.rows.iter().zip(batch.panel.chunks_exact(d)) {
                let locals = &batch.locals[row.locals.clone()];
                for (column, value) in locals.iter().filter(|(column, _)| own.contains(&(*column as usize))) {
                    let a = *column as usize;
                    add(&mut dense[(a - first) * d..(a - first + 1) * d], *value, line);
                    score[a - first] += value * row.v;
                    length[a - first] += value * value;
                    if width == 1 {
                        local[a - first] += value * value;
                        continue;
                    }
                    let line = &mut local[(a - first) * width..(a - first + 1) * width];
                    for (other, entry) in locals.iter().filter(|(other, _)| other >= column) {
                        line[*other as usize] += value * entry;
                    }
                }
            }
            for group in &batch.groups {
                let shares = &batch.shares[group.clone()];
                for (position, share) in shares.iter().enumerate() {
                    let a = share.column as usize;
                    if !own.contains(&a) {
                        continue;
                    }
                    squares[a - first] += share.score * share.score;
                    let taken = |other: &Share| -> f64 { (0..3).map(|k| share.taken[k] * other.moved[k]).sum() };
                    if width == 1 {
                        local[a - first] -= taken(share);
                        continue;
                    }
                    let line = &mut local[(a - first) * width..(a - first + 1) * width];
                    for other in &shares[position..] {
                        line[other.column as usize] -= taken(other);
                    }
                }
            }
        }
    }
}
