//! Sums over the rows of a batch with each point taken out, in whole vectors: `S += J'J - Z'Z`, `b += J'v - Z'z`, where
//! a point has `V = J_point' J_point = L L'`, `Z = L^-1 J_point' J` and `z = L^-1 J_point' v`.
//!
//! What an image shares with itself and with the border is summed as `J'(J - Q Z)`, `Q = J_point L^-T` of its two rows: two products
//! for each number instead of five.

use super::aligned::{Aligned, LINE};
use super::point::LEAST_PIVOT;
use super::rows::{OfPoint, Rows, SECOND};
use super::structure::Structure;
use super::system::System;
use nalgebra::Matrix3;
use pulp::{Simd, WithSimd};

/// Sums of a chunk of points that go over into its system at the end.
pub struct BorderSums {
    /// `J'J` of the rows of the border, before points are taken out; the misclosure is the last column.
    direct: Aligned,
    /// `Z'Z`.
    taken: Aligned,
    /// Per image of the chunk: `J'v` and the squares of its unknowns, before points are taken out.
    images: Aligned,
    /// Work space: `Z` of the border, three rows for each point of a batch.
    z_shared: Aligned,
    /// Work space: `Z` of the images of a point, three rows a pair.
    z_images: Aligned,
}

impl BorderSums {
    /// Zeros for the images of a system.
    pub fn zeros(structure: &Structure, images: usize) -> Self {
        let square = structure.border.len().next_multiple_of(COLUMNS) * structure.width;
        Self {
            direct: Aligned::zeros(square),
            taken: Aligned::zeros(square),
            images: Aligned::zeros(2 * images * structure.stride),
            z_shared: Aligned::zeros(0),
            z_images: Aligned::zeros(0),
        }
    }

    /// Adds them to the system whose rows they are of.
    pub fn finish(self, structure: &Structure, system: &mut System) {
        let Structure { dim, width, stride, .. } = *structure;
        for (i, sums) in self.images.chunks_exact(2 * stride).enumerate() {
            for k in 0..dim {
                system.gradient_images[i * dim + k] += sums[k];
                system.diagonal_images[i * dim + k] += sums[stride + k];
                system.rhs_images[i * dim + k] += system.strip[(i * dim + k) * width + width - 1];
            }
        }
        let rows = self.direct.chunks_exact(width).zip(self.taken.chunks_exact(width));
        for (i, ((direct, taken), border)) in rows.zip(system.border.chunks_exact_mut(width)).enumerate() {
            system.gradient_border[i] += direct[width - 1];
            system.diagonal_border[i] += direct[i];
            system.rhs_border[i] += direct[width - 1] - taken[width - 1];
            for ((border, direct), taken) in border.iter_mut().zip(direct).zip(taken) {
                *border += direct - taken;
            }
        }
    }
}

/// Adds a batch. `D`: unknowns of an image. Output: the point whose rays do not fix it.
pub struct Eliminate<'a, const D: usize> {
    pub structure: &'a Structure,
    pub rows: &'a Rows,
    pub damping: f64,
    pub sums: &'a mut BorderSums,
    pub system: &'a mut System,
}

impl<const D: usize> WithSimd for Eliminate<'_, D> {
    type Output = Result<(), usize>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { structure, rows, damping, sums, system } = self;
        let (width, border) = (structure.width, structure.border.len());
        let stride = D.next_multiple_of(LINE);
        let BorderSums { direct, taken, images, z_shared: z_of_points, z_images } = sums;
        let pairs = rows.rank.len();
        add_outer(simd, direct, border, width, &rows.shared[..2 * pairs * width]);
        let z_rows = 3 * rows.points.len();
        if z_of_points.len() < z_rows * width {
            *z_of_points = Aligned::zeros(z_rows * width);
        }
        if z_images.len() < 3 * pairs * stride {
            *z_images = Aligned::zeros(3 * pairs * stride);
        }
        for (number, point) in rows.points.iter().enumerate() {
            let z_shared = &mut z_of_points[3 * number * width..][..3 * width];
            multiply(simd, rows, point, z_shared);
            for row in z_shared.chunks_exact(width) {
                system.gradient_points_max = system.gradient_points_max.max(row[width - 1].abs());
            }
            let whitening = Whitening::of_damped(&normal(rows, point), damping).ok_or(point.number)?;
            whitening.whiten(simd, z_shared);
            let z_shared = &*z_shared;
            for a in 0..3 {
                system.decrement_points += z_shared[(a + 1) * width - 1].powi(2);
            }
            let of_images = point.measured.clone();
            for (pair, z) in of_images.clone().zip(z_images.chunks_exact_mut(3 * stride)) {
                let rank = rows.rank[pair];
                let i = rank as usize - system.rows.start;
                let image_sums = &mut images[2 * i * stride..][..2 * stride];
                let image = ImageRows::<S, D>::of(simd, rows, pair, &whitening);
                image.multiply(simd, z, image_sums);
                let slot = structure.row_start[rank as usize] - system.first_slot;
                image.add_product(simd, image.image, z, &mut system.blocks[slot * D * stride..][..D * stride]);
                image.add_product(simd, image.shared, z_shared, &mut system.strip[i * D * width..][..D * width]);
            }
            let blocks = &mut *system.blocks;
            let (z_images, ranks) = (z_images.chunks_exact(3 * stride), &rows.rank[of_images]);
            for (a, (rank, z_a)) in ranks.iter().zip(z_images.clone()).enumerate() {
                let slots = structure.slots(*rank);
                let z_a = splat_columns::<S, D>(simd, z_a);
                for (other, z_b) in ranks.iter().zip(z_images.clone()).skip(a + 1) {
                    let slot = slots[(other - rank) as usize] as usize - system.first_slot;
                    take_product(simd, &z_a, z_b, &mut blocks[slot * D * stride..][..D * stride]);
                }
            }
        }
        add_outer(simd, taken, border, width, &z_of_points[..z_rows * width]);
        system.chi_square += rows.chi_square;
        Ok(())
    }
}

/// Rows of a sum that grow at the same time.
const COLUMNS: usize = 4;

/// Upper triangle of `target += X'X`, `target` of `columns` rows (filled up to a multiple of [`COLUMNS`]) and X of rows of `width`.
#[inline(always)]
fn add_outer<S: Simd>(simd: S, target: &mut [f64], columns: usize, width: usize, rows: &[f64]) {
    let pieces = width / S::F64_LANES;
    for first in (0..columns).step_by(COLUMNS) {
        let mut piece = first / S::F64_LANES;
        while piece < pieces {
            piece += match pieces - piece {
                1 => add_outer_pieces::<S, 1>(simd, target, (first, piece), width, rows),
                _ => add_outer_pieces::<S, 2>(simd, target, (first, piece), width, rows),
            };
        }
    }
}

/// [`COLUMNS`] rows and `N` vectors of [`add_outer`]: they stay in registers over all rows of X, and none waits for another. Gives `N`.
#[inline(always)]
fn add_outer_pieces<S: Simd, const N: usize>(
    simd: S,
    target: &mut [f64],
    (column, piece): (usize, usize),
    width: usize,
    rows: &[f64],
) -> usize {
    let pieces = width / S::F64_LANES;
    let (target, _) = S::as_mut_simd_f64s(target);
    let mut sums = [[simd.splat_f64s(0.0); N]; COLUMNS];
    for k in 0..COLUMNS {
        for n in 0..N {
            sums[k][n] = target[(column + k) * pieces + piece + n];
        }
    }
    for row in rows.chunks_exact(width) {
        let (x, _) = S::as_simd_f64s(row);
        for k in 0..COLUMNS {
            let factor = simd.splat_f64s(row[column + k]);
            for n in 0..N {
                sums[k][n] = simd.mul_add_f64s(factor, x[piece + n], sums[k][n]);
            }
        }
    }
    for k in 0..COLUMNS {
        for n in 0..N {
            target[(column + k) * pieces + piece + n] = sums[k][n];
        }
    }
    N
}

/// `J_point' J` of a point over the rows of the border, into three rows.
#[inline(always)]
fn multiply<S: Simd>(simd: S, rows: &Rows, point: &OfPoint, out: &mut [f64]) {
    let pieces = rows.width / S::F64_LANES;
    let mut piece = 0;
    while piece < pieces {
        piece += match pieces - piece {
            4.. => multiply_pieces::<S, 4>(simd, rows, point, piece, out),
            2..4 => multiply_pieces::<S, 2>(simd, rows, point, piece, out),
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
fn normal(rows: &Rows, point: &OfPoint) -> Matrix3<f64> {
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

/// `L^-1` of `V = L L'`: by rows `1/l00`; `l10, 1/l11`; `l20, l21, 1/l22`.
pub struct Whitening {
    inverse: [f64; 3],
    below: [f64; 3],
}

impl Whitening {
    /// Of `V`, of which the lower triangle counts, with its diagonal raised by the factor `1 + damping`; `None` where rays do not meet.
    pub fn of_damped(v: &Matrix3<f64>, damping: f64) -> Option<Self> {
        let d = |i: usize| v[(i, i)] * (1.0 + damping);
        let known = |i: usize, pivot: f64| {
            let above_rounding = pivot > 0.0 && pivot >= LEAST_PIVOT * d(i) && pivot.is_finite();
            above_rounding.then(|| pivot.sqrt().recip())
        };
        let i0 = known(0, d(0))?;
        let (l10, l20) = (v[(1, 0)] * i0, v[(2, 0)] * i0);
        let i1 = known(1, d(1) - l10 * l10)?;
        let l21 = (v[(2, 1)] - l20 * l10) * i1;
        let i2 = known(2, d(2) - l20 * l20 - l21 * l21)?;
        Some(Self { inverse: [i0, i1, i2], below: [l10, l20, l21] })
    }

    /// `L^-1 r`.
    #[inline(always)]
    fn forward(&self, r: [f64; 3]) -> [f64; 3] {
        let ([i0, i1, i2], [l10, l20, l21]) = (self.inverse, self.below);
        let y0 = r[0] * i0;
        let y1 = (r[1] - l10 * y0) * i1;
        [y0, y1, (r[2] - l20 * y0 - l21 * y1) * i2]
    }

    /// `V^-1 r`.
    pub fn solve(&self, r: [f64; 3]) -> [f64; 3] {
        let ([i0, i1, i2], [l10, l20, l21]) = (self.inverse, self.below);
        let [y0, y1, y2] = self.forward(r);
        let z = y2 * i2;
        let y = (y1 - l21 * z) * i1;
        [(y0 - l10 * y - l20 * z) * i0, y, z]
    }

    /// Replaces three rows by `L^-1` times them.
    #[inline(always)]
    fn whiten<S: Simd>(&self, simd: S, rows: &mut [f64]) {
        let ([i0, i1, i2], [l10, l20, l21]) = (self.inverse, self.below);
        let (rows, _) = S::as_mut_simd_f64s(rows);
        let pieces = rows.len() / 3;
        for piece in 0..pieces {
            let w = [rows[piece], rows[pieces + piece], rows[2 * pieces + piece]];
            let z0 = simd.mul_f64s(w[0], simd.splat_f64s(i0));
            let w1 = take_products(simd, [l10], [z0], w[1]);
            let z1 = simd.mul_f64s(w1, simd.splat_f64s(i1));
            let w2 = take_products(simd, [l20, l21], [z0, z1], w[2]);
            let z2 = simd.mul_f64s(w2, simd.splat_f64s(i2));
            (rows[piece], rows[pieces + piece], rows[2 * pieces + piece]) = (z0, z1, z2);
        }
    }
}

/// The two rows of an image measurement. `D`: unknowns of an image.
struct ImageRows<'a, S: Simd, const D: usize> {
    shared: [&'a [f64]; 2],
    image: [&'a [f64]; 2],
    /// `Q`: by the point, whitened.
    by_point: [[f64; 3]; 2],
    /// The derivatives by each unknown of the image, in all places of a register.
    by_unknown: [[S::f64s; 2]; D],
}

impl<'a, S: Simd, const D: usize> ImageRows<'a, S, D> {
    #[inline(always)]
    fn of(simd: S, rows: &'a Rows, pair: usize, whitening: &Whitening) -> Self {
        let (shared, image) =
            ([rows.shared_row(pair, 0), rows.shared_row(pair, 1)], [rows.image_row(pair, 0), rows.image_row(pair, 1)]);
        let (mut by_point, mut by_unknown) = ([[0.0; 3]; 2], [[simd.splat_f64s(0.0); 2]; D]);
        for i in 0..2 {
            let at = &rows.by_point[pair][SECOND * i..];
            by_point[i] = whitening.forward([at[0], at[1], at[2]]);
            for k in 0..D {
                by_unknown[k][i] = simd.splat_f64s(image[i][k]);
            }
        }
        Self { shared, image, by_point, by_unknown }
    }

    /// `Z` of the image into three rows, and its sums before the point is taken out.
    #[inline(always)]
    fn multiply(&self, simd: S, z: &mut [f64], image_sums: &mut [f64]) {
        let ((x, _), (y, _)) = (S::as_simd_f64s(self.image[0]), S::as_simd_f64s(self.image[1]));
        let pieces = x.len();
        let [v_x, v_y] = [self.shared[0][self.shared[0].len() - 1], self.shared[1][self.shared[1].len() - 1]];
        let [q_x, q_y] = self.by_point;
        let (z, _) = S::as_mut_simd_f64s(z);
        let (sums, _) = S::as_mut_simd_f64s(image_sums);
        for piece in 0..pieces {
            let row = [x[piece], y[piece]];
            for a in 0..3 {
                z[a * pieces + piece] = add_products(simd, [q_x[a], q_y[a]], row, simd.splat_f64s(0.0));
            }
            sums[piece] = add_products(simd, [v_x, v_y], row, sums[piece]);
            let squares = simd.mul_add_f64s(row[1], row[1], sums[pieces + piece]);
            sums[pieces + piece] = simd.mul_add_f64s(row[0], row[0], squares);
        }
    }

    /// `target += J'(X - Q Z)`: J by the image's unknowns, `X` two rows and `Z` three.
    #[inline(always)]
    fn add_product(&self, simd: S, x: [&[f64]; 2], z: &[f64], target: &mut [f64]) {
        let ((x, _), (y, _)) = (S::as_simd_f64s(x[0]), S::as_simd_f64s(x[1]));
        let (z, _) = S::as_simd_f64s(z);
        let (target, _) = S::as_mut_simd_f64s(target);
        let pieces = x.len();
        assert!(y.len() == pieces && target.len() == D * pieces && z.len() == 3 * pieces, "rows of one shape");
        for piece in 0..pieces {
            let z = [z[piece], z[pieces + piece], z[2 * pieces + piece]];
            let x = take_products(simd, self.by_point[0], z, x[piece]);
            let y = take_products(simd, self.by_point[1], z, y[piece]);
            for k in 0..D {
                let sum = simd.mul_add_f64s(self.by_unknown[k][0], x, target[k * pieces + piece]);
                target[k * pieces + piece] = simd.mul_add_f64s(self.by_unknown[k][1], y, sum);
            }
        }
    }
}

/// `sum + a . x`, in the order of the products.
#[inline(always)]
fn add_products<S: Simd, const N: usize>(simd: S, a: [f64; N], x: [S::f64s; N], sum: S::f64s) -> S::f64s {
    let mut sum = sum;
    for k in 0..N {
        sum = simd.mul_add_f64s(simd.splat_f64s(a[k]), x[k], sum);
    }
    sum
}

/// `sum - a . x`, in the order of the products.
#[inline(always)]
fn take_products<S: Simd, const N: usize>(simd: S, a: [f64; N], x: [S::f64s; N], sum: S::f64s) -> S::f64s {
    let mut sum = sum;
    for k in 0..N {
        sum = simd.negate_mul_add_f64s(simd.splat_f64s(a[k]), x[k], sum);
    }
    sum
}

/// The numbers of three rows, each in all places of a register, column by column.
#[inline(always)]
fn splat_columns<S: Simd, const D: usize>(simd: S, rows: &[f64]) -> [[S::f64s; 3]; D] {
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
fn take_product<S: Simd, const D: usize>(simd: S, a: &[[S::f64s; 3]; D], b: &[f64], block: &mut [f64]) {
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
