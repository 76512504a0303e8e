//! Products of the dense columns of batches among each other, added to sums.

use super::batch::{Batch, By};
use super::products::{LANES, add_rows};
use pulp::{Simd, WithSimd};

/// Rows whose share of a tile of [`Multiply`] stays in the nearest cache.
const ROWS_TOGETHER: usize = 64;

/// Lower triangle of `columns += D'D`, columns from `first` on: both multiples of [`LANES`]. Each number is a sum of
/// its own, in the order of the rows.
pub(super) struct Multiply<'a> {
    /// `D`, row by row.
    pub rows: &'a [f64],
    /// Number of its columns.
    pub d: usize,
    /// The first of those that are multiplied with all from there on.
    pub first: usize,
    /// Their products, column by column.
    pub columns: &'a mut [f64],
    /// Of each, up to which column these are wanted. Further ones may be there or not.
    pub until: &'a [usize],
}

impl WithSimd for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, d, first, columns, until } = self;
        let pieces = d / S::F64_LANES;
        for rows in rows.chunks(ROWS_TOGETHER * d) {
            let mut piece = first / S::F64_LANES;
            while piece < pieces {
                let count = (pieces - piece).min(3);
                let below = ((piece + count) * S::F64_LANES - first).min(columns.len() / d);
                let mut column = 0;
                while column < below {
                    // As many sums as there are registers for.
                    let wide = S::F64_LANES == LANES && below - column >= 8;
                    let at = (first + column, piece);
                    let wanted = until[column..][..if wide { 8 } else { 4 }].iter().max();
                    if wanted.is_some_and(|until| *until <= piece * S::F64_LANES) {
                        column += if wide { 8 } else { 4 };
                        continue;
                    }
                    let own = &mut columns[column * d..];
                    column += match (wide, count) {
                        (true, 3) => multiply_tile::<S, 8, 3>(simd, own, at, d, rows),
                        (true, 2) => multiply_tile::<S, 8, 2>(simd, own, at, d, rows),
                        (true, _) => multiply_tile::<S, 8, 1>(simd, own, at, d, rows),
                        (false, 3) => multiply_tile::<S, 4, 3>(simd, own, at, d, rows),
                        (false, 2) => multiply_tile::<S, 4, 2>(simd, own, at, d, rows),
                        (false, _) => multiply_tile::<S, 4, 1>(simd, own, at, d, rows),
                    };
                }
                piece += count;
            }
        }
    }
}

/// `C` columns and `N` vectors of [`Multiply`]: none of the sums waits for another. Gives `C`.
#[inline(always)]
fn multiply_tile<S: Simd, const C: usize, const N: usize>(
    simd: S,
    columns: &mut [f64],
    (column, piece): (usize, usize),
    d: usize,
    rows: &[f64],
) -> usize {
    let pieces = d / S::F64_LANES;
    let (columns, _) = S::as_mut_simd_f64s(columns);
    let mut sums = [[simd.splat_f64s(0.0); N]; C];
    for c in 0..C {
        for n in 0..N {
            sums[c][n] = columns[c * pieces + piece + n];
        }
    }
    for row in rows.chunks_exact(d) {
        let (x, _) = S::as_simd_f64s(row);
        let (x, factors) = (&x[piece..piece + N], &row[column..column + C]);
        for c in 0..C {
            let factor = simd.splat_f64s(factors[c]);
            for n in 0..N {
                sums[c][n] = simd.mul_add_f64s(factor, x[n], sums[c][n]);
            }
        }
    }
    for c in 0..C {
        for n in 0..N {
            columns[c * pieces + piece + n] = sums[c][n];
        }
    }
    C
}

/// Finished rows added to scores and informations over the dense columns from `block`, a register of them, on.
pub(super) struct Informations<'a> {
    /// What is added.
    pub batches: &'a [Batch],
    /// Number of dense columns.
    pub d: usize,
    /// The first register of columns.
    pub block: usize,
    /// What the rows are summed by.
    pub by: By,
    /// Sums of the groups from `first` on; the last of all are those of the rows of none.
    pub sums: &'a mut [Information],
    /// See `sums`.
    pub first: usize,
    /// Number of groups.
    pub groups: usize,
}

/// Score and information of some columns in the rows of a group.
#[derive(Clone)]
pub(super) struct Information {
    /// `D'v`.
    pub score: Vec<f64>,
    /// `D'D`, row by row; of its registers of columns those from the diagonal on.
    pub information: Vec<f64>,
}

impl Information {
    /// Of no row.
    pub fn zeros(columns: usize) -> Self {
        Self { score: vec![0.0; columns], information: vec![0.0; columns * columns] }
    }
}

impl WithSimd for Informations<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { batches, d, block, by, sums, first, groups } = self;
        let end = first + sums.len();
        for batch in batches {
            for rows in batch.of(by, first..end.min(groups)) {
                let group = batch.group(by, rows[0]) as usize;
                add_information(&mut sums[group - first], batch, d, block, rows);
            }
            if (first..end).contains(&groups) {
                add_information(&mut sums[groups - first], batch, d, block, batch.of_none(by));
            }
        }
    }
}

/// Adds some rows of a batch.
#[inline(always)]
fn add_information(to: &mut Information, batch: &Batch, d: usize, block: usize, rows: &[u32]) {
    let Information { score, information } = to;
    let (panel, blocks, width) = ((&batch.panel[..], d), block..d / LANES, score.len());
    let rows = rows.iter().copied();
    add_rows::<1>(score, panel, blocks.clone(), 0, rows.clone().map(|row| (row, [batch.rows[row as usize].v])));
    let (lanes, _) = batch.panel.as_chunks();
    for (number, lines) in information.chunks_exact_mut(LANES * width).enumerate() {
        let rows = rows.clone().map(|row| (row, lanes[row as usize * (d / LANES) + block + number]));
        add_rows::<LANES>(lines, panel, blocks.clone(), number, rows);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vectors::dispatch;

    /// Products of columns `first..first + until.len()` of `d`, from one on.
    fn products(rows: &[f64], d: usize, first: usize, until: &[usize]) -> Vec<f64> {
        let mut columns = vec![1.0; until.len() * d];
        dispatch(Multiply { rows, d, first, columns: &mut columns, until });
        columns
    }

    fn rows_of(d: usize) -> Vec<f64> {
        (0..d * (ROWS_TOGETHER + 7)).map(|k| (k as f64 * 0.7).sin()).collect()
    }

    /// Tiles of every size, and more rows than go through at a time.
    #[test]
    fn products_are_sums_over_the_rows_in_their_order() {
        for d in [8, 16, 24, 40, 104] {
            let rows = rows_of(d);
            for first in (0..d).step_by(48) {
                let count = 48.min(d - first);
                let columns = products(&rows, d, first, &vec![d; count]);
                for c in 0..count {
                    for r in first + c..d {
                        let product = |sum: f64, row: &[f64]| row[first + c].mul_add(row[r], sum);
                        let expected = rows.chunks(d).fold(1.0, product);
                        assert_eq!(columns[c * d + r], expected, "{d} columns, row {r} of column {}", first + c);
                    }
                }
            }
        }
    }

    /// Columns of every end, and of ends that fall: what is wanted has the bits of the whole, and far beyond it nothing
    /// is added.
    #[test]
    fn products_that_nobody_wants_are_left_out() {
        let d = 104;
        let rows = rows_of(d);
        for first in [0, 48] {
            let count = 48;
            let whole = products(&rows, d, first, &vec![d; count]);
            for ends in [
                |c: usize| c + 1,
                |c: usize| c / 16 * 16 + 16,
                |c: usize| if c % 8 == 3 && c < 24 { 104 } else { c + 1 },
            ] {
                let until: Vec<usize> = (first..first + count).map(ends).collect();
                let columns = products(&rows, d, first, &until);
                let mut left_out = 0;
                for (c, end) in until.iter().enumerate() {
                    for r in first + c..d {
                        let (own, wanted) = (columns[c * d + r], whole[c * d + r]);
                        assert!(own == wanted || (own == 1.0 && r >= *end), "row {r} of column {}", first + c);
                        left_out += usize::from(own != wanted);
                    }
                }
                assert!(left_out > 0, "tiles beyond all that is wanted");
            }
        }
    }
}
