//! Products of rows in whole vectors, the same numbers at every width: each number is a sum of its own, in the order of
//! the rows.

use super::super::aligned::LINE;
use super::super::rows::{OfPoint, Rows, SECOND};
use nalgebra::Matrix3;
use pulp::Simd;

/// Rows of a sum that grow at the same time.
pub(super) const COLUMNS: usize = 4;

/// Upper triangle of `target += X'X`, `target` of `columns` rows (filled up to a multiple of [`COLUMNS`]) and X of rows
/// of `width`.
#[inline(always)]
pub(super) fn add_outer<S: Simd>(simd: S, target: &mut [f64], columns: usize, width: usize, rows: &[f64]) {
    let pieces = width / S::F64_LANES;
    let columns = columns.next_multiple_of(COLUMNS);
    let mut first = 0;
    while first < columns {
        // As many sums as there are registers for: processors with the widest have twice as many.
        let many = S::F64_LANES == LINE && columns - first >= 2 * COLUMNS;
        let mut piece = first / S::F64_LANES;
        while piece < pieces {
            let at = (first, piece);
            piece += match (many, pieces - piece) {
                (true, 1) => add_outer_pieces::<S, { 2 * COLUMNS }, 1>(simd, target, at, width, rows),
                (true, 2 | 4) => add_outer_pieces::<S, { 2 * COLUMNS }, 2>(simd, target, at, width, rows),
                (true, _) => add_outer_pieces::<S, { 2 * COLUMNS }, 3>(simd, target, at, width, rows),
                (false, 1) => add_outer_pieces::<S, COLUMNS, 1>(simd, target, at, width, rows),
                (false, _) => add_outer_pieces::<S, COLUMNS, 2>(simd, target, at, width, rows),
            };
        }
        first += if many { 2 * COLUMNS } else { COLUMNS };
    }
}

/// `C` rows and `N` vectors of [`add_outer`]: they stay in registers over all rows of X, and none waits for another.
/// Gives `N`.
#[inline(always)]
fn add_outer_pieces<S: Simd, const C: usize, const N: usize>(
    simd: S,
    target: &mut [f64],
    (column, piece): (usize, usize),
    width: usize,
    rows: &[f64],
) -> usize {
    let pieces = width / S::F64_LANES;
    let (target, _) = S::as_mut_simd_f64s(target);
    let mut sums = [[simd.splat_f64s(0.0); N]; C];
    for k in 0..C {
        for n in 0..N {
            sums[k][n] = target[(column + k) * pieces + piece + n];
        }
    }
    for row in rows.chunks_exact(width) {
        let (x, _) = S::as_simd_f64s(row);
        for k in 0..C {
            let factor = simd.splat_f64s(row[column + k]);
            for n in 0..N {
                sums[k][n] = simd.mul_add_f64s(factor, x[piece + n], sums[k][n]);
            }
        }
    }
    for k in 0..C {
        for n in 0..N {
            target[(column + k) * pieces + piece + n] = sums[k][n];
        }
    }
    N
}

/// `J_point' J` of a point over the rows of the border, into three rows.
#[inline(always)]
pub(super) fn multiply<S: Simd>(simd: S, rows: &Rows, point: &OfPoint, out: &mut [f64]) {
    let pieces = rows.width / S::F64_LANES;
    let mut piece = 0;
    while piece < pieces {
        piece += match pieces - piece {
            4.. => multiply_pieces::<S, 4>(simd, rows, point, piece, out),
            3 => multiply_pieces::<S, 3>(simd, rows, point, piece, out),
            2 => multiply_pieces::<S, 2>(simd, rows, point, piece, out),
            _ => multiply_pieces::<S, 1>(simd, rows, point, piece, out),
        };
    }
}

/// So many vectors of [`multiply`]: sums that grow at the same time do not wait for each other. Gives their number.
#[inline(always)]
fn multiply_pieces<S: Simd, const N: usize>(
    simd: S,
    rows: &Rows,
    point: &OfPoint,
    first: usize,
    out: &mut [f64],
) -> usize {
    let pieces = rows.width / S::F64_LANES;
    let mut sums = [[simd.splat_f64s(0.0); N]; 3];
    for pairs in [&point.measured, &point.surveyed] {
        for (shared, by_point) in rows.shared_and_points(pairs) {
            let (x, _) = S::as_simd_f64s(shared);
            for i in 0..2 {
                for a in 0..3 {
                    let factor = simd.splat_f64s(by_point[SECOND * i + a]);
                    for k in 0..N {
                        sums[a][k] = simd.mul_add_f64s(factor, x[i * pieces + first + k], sums[a][k]);
                    }
                }
            }
        }
    }
    let (out, _) = S::as_mut_simd_f64s(out);
    for a in 0..3 {
        for k in 0..N {
            out[a * pieces + first + k] = sums[a][k];
        }
    }
    N
}

/// `V` of a point.
#[inline(always)]
pub(super) fn normal(rows: &Rows, point: &OfPoint) -> Matrix3<f64> {
    let mut v = Matrix3::zeros();
    for pairs in [&point.measured, &point.surveyed] {
        for by_point in &rows.by_point[pairs.clone()] {
            for a in 0..3 {
                for b in 0..=a {
                    v[(a, b)] += by_point[a] * by_point[b] + by_point[SECOND + a] * by_point[SECOND + b];
                }
            }
        }
    }
    v
}

/// `sum + a . x`, in the order of the products.
#[inline(always)]
pub(super) fn add_products<S: Simd, const N: usize>(simd: S, a: [f64; N], x: [S::f64s; N], sum: S::f64s) -> S::f64s {
    let mut sum = sum;
    for k in 0..N {
        sum = simd.mul_add_f64s(simd.splat_f64s(a[k]), x[k], sum);
    }
    sum
}

/// `sum - a . x`, in the order of the products.
#[inline(always)]
pub(super) fn take_products<S: Simd, const N: usize>(simd: S, a: [f64; N], x: [S::f64s; N], sum: S::f64s) -> S::f64s {
    let mut sum = sum;
    for k in 0..N {
        sum = simd.negate_mul_add_f64s(simd.splat_f64s(a[k]), x[k], sum);
    }
    sum
}

/// The numbers of three rows, each in all places of a register, column by column.
#[inline(always)]
pub(super) fn splat_columns<S: Simd, const D: usize>(simd: S, rows: &[f64]) -> [[S::f64s; 3]; D] {
    let stride = rows.len() / 3;
    let mut columns = [[simd.splat_f64s(0.0); 3]; D];
    for k in 0..D {
        for a in 0..3 {
            columns[k][a] = simd.splat_f64s(rows[a * stride + k]);
        }
    }
    columns
}

/// `block -= A'B` of `D` rows, `A` and `B` three rows each, `A` by its columns.
#[inline(always)]
pub(super) fn take_product<S: Simd, const D: usize>(simd: S, a: &[[S::f64s; 3]; D], b: &[f64], block: &mut [f64]) {
    let pieces = D.next_multiple_of(LINE) / S::F64_LANES;
    assert!(block.len() == D * pieces * S::F64_LANES && b.len() == 3 * pieces * S::F64_LANES, "blocks of one shape");
    let mut piece = 0;
    while piece < pieces {
        piece += match pieces - piece {
            1 => take_product_pieces::<S, D, 1>(simd, a, b, piece, block),
            _ => take_product_pieces::<S, D, 2>(simd, a, b, piece, block),
        };
    }
}

/// `N` vectors of each row of [`take_product`]: what `A` gives is loaded once for all of them. Gives `N`.
#[inline(always)]
fn take_product_pieces<S: Simd, const D: usize, const N: usize>(
    simd: S,
    a: &[[S::f64s; 3]; D],
    b: &[f64],
    piece: usize,
    block: &mut [f64],
) -> usize {
    let (b, _) = S::as_simd_f64s(b);
    let (block, _) = S::as_mut_simd_f64s(block);
    let pieces = b.len() / 3;
    let mut factors = [[simd.splat_f64s(0.0); 3]; N];
    for n in 0..N {
        for i in 0..3 {
            factors[n][i] = b[i * pieces + piece + n];
        }
    }
    for k in 0..D {
        for n in 0..N {
            let mut sum = block[k * pieces + piece + n];
            for i in 0..3 {
                sum = simd.negate_mul_add_f64s(a[k][i], factors[n][i], sum);
            }
            block[k * pieces + piece + n] = sum;
        }
    }
    N
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adjust::native::aligned::Aligned;
    use crate::math::vectors::dispatch;
    use pulp::WithSimd;

    struct Outer<'a>(&'a mut [f64], usize, usize, &'a [f64]);

    impl WithSimd for Outer<'_> {
        type Output = ();
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            add_outer(simd, self.0, self.1, self.2, self.3);
        }
    }

    /// Borders of one register of columns to five, and of any number of columns in the last.
    #[test]
    fn products_of_rows_are_sums_in_the_order_of_the_rows() {
        for width in (LINE..=5 * LINE).step_by(LINE) {
            let mut rows = Aligned::zeros(7 * width);
            rows.iter_mut().enumerate().for_each(|(k, value)| *value = (k as f64 * 0.7).sin());
            for columns in width - LINE + 1..=width {
                let mut target = Aligned::zeros(columns.next_multiple_of(COLUMNS) * width);
                target.fill(1.0);
                dispatch(Outer(&mut target, columns, width, &rows));
                for c in 0..columns {
                    for k in c..width {
                        let product = |sum: f64, row: &[f64]| row[c].mul_add(row[k], sum);
                        let expected = rows.chunks_exact(width).fold(1.0, product);
                        assert_eq!(target[c * width + k], expected, "column {k} of row {c}, {columns} of {width}");
                    }
                }
            }
        }
    }
}
