//! Products of a batch with itself, added to sums.
//!
//! What is summed over many rows stays in registers while their entries of some neighbouring columns go by.

use super::batch::{Batch, Row, Share};
use super::families::Families;
use nalgebra::Matrix3;
use pulp::{Simd, WithSimd};
use std::array::from_fn;
use std::ops::Range;

/// Columns that are summed side by side: a register of the widest kind. Rows have a whole number of them.
pub(super) const LANES: usize = 8;

/// `line += a x`.
#[inline(always)]
pub(super) fn add(line: &mut [f64], a: f64, x: &[f64]) {
    for (l, x) in line.iter_mut().zip(x) {
        *l += a * x;
    }
}

/// Adds the squares of each column of `X` to `length`.
pub(super) struct Lengths<'a> {
    /// `X`, row by row.
    pub panel: &'a [f64],
    /// As many as it has columns.
    pub length: &'a mut [f64],
}

impl WithSimd for Lengths<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (panel, _) = self.panel.as_chunks::<LANES>();
        let (length, _) = self.length.as_chunks_mut::<LANES>();
        let blocks = length.len();
        for (block, length) in length.iter_mut().enumerate() {
            let mut sum = *length;
            for line in panel.chunks_exact(blocks) {
                let x = &line[block];
                sum = from_fn(|l| sum[l] + x[l] * x[l]);
            }
            *length = sum;
        }
    }
}

/// `X -= J V^-1 J'X` for the rows of a point, `J` their derivatives by it, and then the part `X'v` that the point has
/// of a score.
pub(super) struct PointOut<'a> {
    /// Its rows, of whose `v` it is taken out.
    pub rows: &'a [Row],
    /// `V^-1 = (J'J)^-1`.
    pub inverse: &'a Matrix3<f64>,
    /// `X`.
    pub panel: &'a mut [f64],
    /// Sums of the parts, one for each column of `X`.
    pub score: &'a mut [f64],
    /// Sums of their squares.
    pub squares: &'a mut [f64],
}

impl WithSimd for PointOut<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { rows, inverse, panel, score, squares } = self;
        let (panel, _) = panel.as_chunks_mut::<LANES>();
        let (score, _) = score.as_chunks_mut::<LANES>();
        let (squares, _) = squares.as_chunks_mut::<LANES>();
        let blocks = score.len();
        for (block, (score, squares)) in score.iter_mut().zip(squares).enumerate() {
            let mut moved = [[0.0; LANES]; 3];
            for (row, line) in rows.iter().zip(panel.chunks_exact(blocks)) {
                let x = &line[block];
                for (sum, by_point) in moved.iter_mut().zip(row.point) {
                    *sum = from_fn(|l| sum[l] + by_point * x[l]);
                }
            }
            let [m0, m1, m2] = moved;
            let [m0, m1, m2] = [0, 1, 2].map(|a| {
                let [i0, i1, i2] = [inverse[(a, 0)], inverse[(a, 1)], inverse[(a, 2)]];
                from_fn::<f64, LANES, _>(|l| i0 * m0[l] + i1 * m1[l] + i2 * m2[l])
            });
            let mut part = [0.0; LANES];
            for (row, line) in rows.iter().zip(panel.chunks_exact_mut(blocks)) {
                let ([a, b, c], v) = (row.point, row.v);
                let x = &mut line[block];
                *x = from_fn(|l| x[l] - (a * m0[l] + b * m1[l] + c * m2[l]));
                part = from_fn(|l| part[l] + v * x[l]);
            }
            *score = from_fn(|l| score[l] + part[l]);
            *squares = from_fn(|l| squares[l] + part[l] * part[l]);
        }
    }
}

/// `lines[k] += sum of a[k] X` over rows `X` of a panel of `d` columns, each with its numbers `a`. Lines have the
/// registers of columns that are `blocks`; the first `skipped` of these stay as they are.
#[inline(always)]
pub(super) fn add_rows<const D: usize>(
    lines: &mut [f64],
    (panel, d): (&[f64], usize),
    blocks: Range<usize>,
    skipped: usize,
    rows: impl Iterator<Item = (u32, [f64; D])> + Clone,
) {
    let (panel, _) = panel.as_chunks::<LANES>();
    let (lines, _) = lines.as_chunks_mut::<LANES>();
    let (of_row, width) = (d / LANES, blocks.len());
    let mut at = skipped;
    // With one number a row each register of columns has one sum, which waits for itself: only several of them keep the
    // processor busy.
    if D == 1 {
        while at + 8 <= width {
            add_blocks::<D, 8>(lines, (width, at), (panel, of_row, blocks.start + at), rows.clone());
            at += 8;
        }
        while at + 4 <= width {
            add_blocks::<D, 4>(lines, (width, at), (panel, of_row, blocks.start + at), rows.clone());
            at += 4;
        }
    }
    // What is read of a row serves two registers of columns.
    while at + 2 <= width {
        add_blocks::<D, 2>(lines, (width, at), (panel, of_row, blocks.start + at), rows.clone());
        at += 2;
    }
    if at < width {
        add_blocks::<D, 1>(lines, (width, at), (panel, of_row, blocks.start + at), rows);
    }
}

/// The same of `B` registers of columns: from the `at`-th on of the `width` of a line, from `block` on of the `of_row`
/// of a row.
#[inline(always)]
fn add_blocks<const D: usize, const B: usize>(
    lines: &mut [[f64; LANES]],
    (width, at): (usize, usize),
    (panel, of_row, block): (&[[f64; LANES]], usize, usize),
    rows: impl Iterator<Item = (u32, [f64; D])>,
) {
    let mut sums = [[[0.0; LANES]; B]; D];
    for (number, a) in rows {
        let x = &panel[number as usize * of_row + block..][..B];
        for (sums, a) in sums.iter_mut().zip(a) {
            for (sum, x) in sums.iter_mut().zip(x) {
                *sum = from_fn(|l| sum[l] + a * x[l]);
            }
        }
    }
    for (line, sums) in lines.chunks_exact_mut(width).zip(&sums) {
        for (line, sum) in line[at..].iter_mut().zip(sums) {
            *line = from_fn(|l| line[l] + sum[l]);
        }
    }
}

/// Image unknowns, `D` an image, with columns.
pub(super) struct ImageLines<'a> {
    /// What is added.
    pub batch: &'a Batch,
    /// Number of columns.
    pub columns: usize,
    /// Rank of the first image.
    pub first: usize,
    /// Sums of the images from there on.
    pub lines: &'a mut [f64],
}

/// With dense columns: by image, then unknown of the image, then column.
pub(super) struct ImagesDense<'a, const D: usize>(pub ImageLines<'a>);

impl<const D: usize> WithSimd for ImagesDense<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let ImageLines { batch, columns, first, lines } = self.0;
        let size = D * columns;
        for rows in batch.of_images(first..first + lines.len() / size) {
            let own = batch.rows[rows[0] as usize].rank as usize - first;
            let rows = rows.iter().map(|number| (*number, from_fn(|k| batch.rows[*number as usize].image[k])));
            let panel = (&batch.panel[..], columns);
            add_rows::<D>(&mut lines[own * size..(own + 1) * size], panel, 0..columns / LANES, 0, rows);
        }
    }
}

/// With local columns: by image, then column, then unknown of the image.
pub(super) struct ImagesLocal<'a, const D: usize>(pub ImageLines<'a>);

impl<const D: usize> WithSimd for ImagesLocal<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let ImageLines { batch, columns, first, lines } = self.0;
        let (lines, _) = lines.as_chunks_mut::<D>();
        let images = first..first + lines.len() / columns;
        for row in batch.of_images(images).flatten().map(|number| &batch.rows[*number as usize]) {
            let own = row.rank as usize - first;
            let own = &mut lines[own * columns..(own + 1) * columns];
            for (column, entry) in &batch.locals[row.locals.clone()] {
                let sums = &mut own[*column as usize];
                *sums = from_fn(|k| sums[k] + row.image[k] * entry);
            }
            let [a, b, c] = row.point;
            for share in &batch.shares[batch.groups[row.group as usize].clone()] {
                let [t0, t1, t2] = share.taken;
                let taken = a * t0 + b * t1 + c * t2;
                let sums = &mut own[share.column as usize];
                *sums = from_fn(|k| sums[k] - row.image[k] * taken);
            }
        }
    }
}

/// Sums of some local columns with everything.
pub(super) struct LocalLines<'a> {
    /// What is added.
    pub batch: &'a Batch,
    /// The first of them.
    pub first: usize,
    /// Number of dense columns.
    pub d: usize,
    /// Columns of `local`: all, or one where the diagonal is enough.
    pub width: usize,
    /// Which products are wanted.
    pub families: &'a Families,
    /// With dense columns.
    pub dense: &'a mut [f64],
    /// With local ones.
    pub local: &'a mut [f64],
    /// With the misclosures.
    pub score: &'a mut [f64],
    /// Sum of squares before anything is taken out.
    pub length: &'a mut [f64],
    /// Sum of squares of the parts that points have of a score.
    pub squares: &'a mut [f64],
}

impl WithSimd for LocalLines<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { batch, first, d, width, families, dense, local, score, length, squares } = self;
        let own = first..first + score.len();
        for (a, dense) in dense.chunks_exact_mut(d).enumerate() {
            let entries = batch.of_local(first + a);
            // A batch sees few images and few cells of the sensor: what is added to nothing is not even read.
            if entries.is_empty() {
                continue;
            }
            let rows = entries.iter().map(|(row, value)| (*row, [*value]));
            let blocks = families.dense_of_local[first + a].div_ceil(LANES);
            add_rows::<1>(&mut dense[..blocks * LANES], (&batch.panel, d), 0..blocks, 0, rows);
            let local = &mut local[a * width..(a + 1) * width];
            let wanted = first + a..families.local[first + a];
            for (number, value) in entries {
                let row = &batch.rows[*number as usize];
                score[a] += value * row.v;
                length[a] += value * value;
                if width == 1 {
                    local[0] += value * value;
                    continue;
                }
                let others = &batch.locals[row.locals.clone()];
                for (other, entry) in others.iter().filter(|(other, _)| wanted.contains(&(*other as usize))) {
                    local[*other as usize] += value * entry;
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
                for other in shares[position..].iter().take_while(|other| (other.column as usize) < families.local[a]) {
                    line[other.column as usize] -= taken(other);
                }
            }
        }
    }
}
