//! Sums over the rows of a batch with each point taken out, in whole vectors: `S += J'J - Z'Z`, `b += J'v - Z'z`, where
//! a point has `V = J_point' J_point = L L'`, `Z = L^-1 J_point' J` and `z = L^-1 J_point' v`.

use super::aligned::{Aligned, LINE};
use super::point::LEAST_PIVOT;
use super::rows::{GROUP, OfPoint, Rows};
use super::structure::{POINT, Structure};
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
    /// Work space: `Z` of a batch.
    z: Z,
}

struct Z {
    /// Of the border, three rows a point.
    shared: Aligned,
    /// Of the images, three rows a pair.
    image: Aligned,
}

impl BorderSums {
    /// Zeros for the images of a system.
    pub fn zeros(structure: &Structure, images: usize) -> Self {
        let square = structure.border.len().next_multiple_of(COLUMNS) * structure.width;
        let nothing = || Aligned::zeros(0);
        Self {
            direct: Aligned::zeros(square),
            taken: Aligned::zeros(square),
            images: Aligned::zeros(2 * images * structure.stride),
            z: Z { shared: nothing(), image: nothing() },
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
        let BorderSums { direct, taken, images, z } = sums;
        let pairs = rows.rank.len();
        add_outer(simd, direct, border, width, &rows.shared[..2 * pairs.next_multiple_of(GROUP) * width]);
        let z_rows = (3 * rows.points.len()).next_multiple_of(2 * GROUP);
        if z.shared.len() < z_rows * width {
            z.shared = Aligned::zeros(z_rows * width);
        }
        z.shared[3 * rows.points.len() * width..].fill(0.0);
        if z.image.len() < 3 * pairs * stride {
            z.image = Aligned::zeros(3 * pairs * stride);
        }
        for (number, point) in rows.points.iter().enumerate() {
            let z_shared = &mut z.shared[3 * number * width..][..3 * width];
            multiply(simd, rows, point, z_shared);
            let normal = Normal::of(z_shared, rows.point_column());
            for g in normal.gradient {
                system.gradient_points_max = system.gradient_points_max.max(g.abs());
            }
            let whitening = Whitening::of_damped(&normal.matrix, damping).ok_or(point.number)?;
            whitening.whiten(simd, z_shared);
            let z_shared = &*z_shared;
            for a in 0..3 {
                system.decrement_points += z_shared[(a + 1) * width - 1].powi(2);
            }
            let of_images = point.measured.clone();
            for pair in of_images.clone() {
                let rank = rows.rank[pair];
                let i = rank as usize - system.rows.start;
                let z = &mut z.image[3 * pair * stride..][..3 * stride];
                let image_sums = &mut images[2 * i * stride..][..2 * stride];
                let image = ImageRows::of(rows, pair);
                image.multiply(simd, &whitening, z, image_sums);
                let slot = structure.row_start[rank as usize] - system.first_slot;
                let block = &mut system.blocks[slot * D * stride..][..D * stride];
                image.add_product(simd, (D, stride), z, image.image, z, block);
                let strip = &mut system.strip[i * D * width..][..D * width];
                image.add_product(simd, (D, width), z, image.shared, z_shared, strip);
            }
            let blocks = &mut *system.blocks;
            for a in of_images.clone() {
                let rank = rows.rank[a];
                let slots = structure.slots(rank);
                let z_a = splat_columns::<S, D>(simd, &z.image[3 * a * stride..][..3 * stride]);
                for b in a + 1..of_images.end {
                    let slot = slots[(rows.rank[b] - rank) as usize] as usize - system.first_slot;
                    let block = &mut blocks[slot * D * stride..][..D * stride];
                    take_product(simd, &z_a, &z.image[3 * b * stride..][..3 * stride], block);
                }
            }
        }
        add_outer(simd, taken, border, width, &z.shared[..z_rows * width]);
        system.chi_square += rows.chi_square;
        Ok(())
    }
}

/// Sums that grow at the same time: each waits for its own last product alone.
const COLUMNS: usize = 4;

/// Upper triangle of `target += X'X`, `target` of `columns` rows (filled up to a multiple of [`COLUMNS`]) and X of rows
/// of `width`, a multiple of eight of them.
#[inline(always)]
fn add_outer<S: Simd>(simd: S, target: &mut [f64], columns: usize, width: usize, rows: &[f64]) {
    const ROWS: usize = 2 * GROUP;
    let pieces = width / S::F64_LANES;
    let (target, _) = S::as_mut_simd_f64s(target);
    for group in rows.chunks_exact(ROWS * width) {
        let (vectors, _) = S::as_simd_f64s(group);
        for piece in 0..pieces {
            let mut x = [simd.splat_f64s(0.0); ROWS];
            for row in 0..ROWS {
                x[row] = vectors[row * pieces + piece];
            }
            let above = columns.min((piece + 1) * S::F64_LANES);
            for first in (0..above).step_by(COLUMNS) {
                let mut sums = [simd.splat_f64s(0.0); COLUMNS];
                for k in 0..COLUMNS {
                    sums[k] = target[(first + k) * pieces + piece];
                }
                for (row, x) in group.chunks_exact(width).zip(x) {
                    for k in 0..COLUMNS {
                        sums[k] = simd.mul_add_f64s(simd.splat_f64s(row[first + k]), x, sums[k]);
                    }
                }
                for k in 0..COLUMNS {
                    target[(first + k) * pieces + piece] = sums[k];
                }
            }
        }
    }
}

/// `J_point' J` of a point over the rows of the border, into three rows.
#[inline(always)]
fn multiply<S: Simd>(simd: S, rows: &Rows, point: &OfPoint, out: &mut [f64]) {
    let (width, at) = (rows.width, rows.point_column());
    let pieces = width / S::F64_LANES;
    let (out, _) = S::as_mut_simd_f64s(out);
    for piece in 0..pieces {
        let mut sums = [simd.splat_f64s(0.0); 3];
        for pair in point.pairs() {
            for i in 0..2 {
                let row = rows.shared_row(pair, i);
                let x = S::as_simd_f64s(row).0[piece];
                for a in 0..3 {
                    sums[a] = simd.mul_add_f64s(simd.splat_f64s(row[at + a]), x, sums[a]);
                }
            }
        }
        for a in 0..3 {
            out[a * pieces + piece] = sums[a];
        }
    }
}

/// Normal equations of a point.
pub struct Normal {
    /// `V`.
    pub matrix: Matrix3<f64>,
    /// `J_point' v`.
    pub gradient: [f64; 3],
}

impl Normal {
    /// Out of the three rows of `J_point' J`.
    fn of(rows: &[f64], at: usize) -> Self {
        let width = at + POINT;
        Self {
            matrix: Matrix3::from_fn(|a, b| rows[a * width + at + b]),
            gradient: std::array::from_fn(|a| rows[a * width + at + 3]),
        }
    }
}

/// `L^-1` of `V = L L'`: by rows `1/l00`; `l10, 1/l11`; `l20, l21, 1/l22`.
pub struct Whitening {
    inverse: [f64; 3],
    below: [f64; 3],
}

impl Whitening {
    /// Of `V` with its diagonal raised by the factor `1 + damping`; `None` where rays do not meet.
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

    /// `V^-1 r`.
    pub fn solve(&self, r: [f64; 3]) -> [f64; 3] {
        let ([i0, i1, i2], [l10, l20, l21]) = (self.inverse, self.below);
        let y0 = r[0] * i0;
        let y1 = (r[1] - l10 * y0) * i1;
        let y2 = (r[2] - l20 * y0 - l21 * y1) * i2;
        let z = y2 * i2;
        let y = (y1 - l21 * z) * i1;
        [(y0 - l10 * y - l20 * z) * i0, y, z]
    }

    /// Replaces three rows by `L^-1` times them.
    #[inline(always)]
    fn whiten<S: Simd>(&self, simd: S, rows: &mut [f64]) {
        let (rows, _) = S::as_mut_simd_f64s(rows);
        let pieces = rows.len() / 3;
        for piece in 0..pieces {
            let w = [rows[piece], rows[pieces + piece], rows[2 * pieces + piece]];
            let z = self.whitened(simd, w);
            for a in 0..3 {
                rows[a * pieces + piece] = z[a];
            }
        }
    }

    #[inline(always)]
    fn whitened<S: Simd>(&self, simd: S, w: [S::f64s; 3]) -> [S::f64s; 3] {
        let [i0, i1, i2] = self.inverse;
        let [l10, l20, l21] = self.below;
        let z0 = simd.mul_f64s(w[0], simd.splat_f64s(i0));
        let w1 = take_products(simd, [l10], [z0], w[1]);
        let z1 = simd.mul_f64s(w1, simd.splat_f64s(i1));
        let w2 = take_products(simd, [l20, l21], [z0, z1], w[2]);
        [z0, z1, simd.mul_f64s(w2, simd.splat_f64s(i2))]
    }
}

/// The rows of an image measurement.
struct ImageRows<'a> {
    shared: [&'a [f64]; 2],
    image: [&'a [f64]; 2],
}

impl<'a> ImageRows<'a> {
    #[inline(always)]
    fn of(rows: &'a Rows, pair: usize) -> Self {
        Self {
            shared: [rows.shared_row(pair, 0), rows.shared_row(pair, 1)],
            image: [rows.image_row(pair, 0), rows.image_row(pair, 1)],
        }
    }

    /// `Z` of the image into three rows, and its sums before the point is taken out.
    #[inline(always)]
    fn multiply<S: Simd>(&self, simd: S, whitening: &Whitening, z: &mut [f64], image_sums: &mut [f64]) {
        let ((x, _), (y, _)) = (S::as_simd_f64s(self.image[0]), S::as_simd_f64s(self.image[1]));
        let pieces = x.len();
        // Read where they stand: copies of three numbers are stored in twos and loaded before they have arrived.
        let [of_x, of_y] = self.shared.map(|row| &row[row.len() - POINT..]);
        let (z, _) = S::as_mut_simd_f64s(z);
        let (sums, _) = S::as_mut_simd_f64s(image_sums);
        for piece in 0..pieces {
            let row = [x[piece], y[piece]];
            let mut w = [simd.splat_f64s(0.0); 3];
            for a in 0..3 {
                w[a] = add_products(simd, [of_x[a], of_y[a]], row, w[a]);
            }
            let whitened = whitening.whitened(simd, w);
            for a in 0..3 {
                z[a * pieces + piece] = whitened[a];
            }
            sums[piece] = add_products(simd, [of_x[3], of_y[3]], row, sums[piece]);
            let squares = simd.mul_add_f64s(row[1], row[1], sums[pieces + piece]);
            sums[pieces + piece] = simd.mul_add_f64s(row[0], row[0], squares);
        }
    }

    /// `target += J'X - Z'Z_x` of so many rows and columns, `X` two rows and `Z_x` three.
    #[inline(always)]
    fn add_product<S: Simd>(
        &self,
        simd: S,
        (rows, columns): (usize, usize),
        z: &[f64],
        x: [&[f64]; 2],
        z_x: &[f64],
        target: &mut [f64],
    ) {
        let stride = z.len() / 3;
        let (by, by_z) = ([self.image[0], self.image[1]], [&z[..stride], &z[stride..2 * stride], &z[2 * stride..]]);
        let ((x, _), (y, _)) = (S::as_simd_f64s(x[0]), S::as_simd_f64s(x[1]));
        let (z_x, _) = S::as_simd_f64s(z_x);
        let (target, _) = S::as_mut_simd_f64s(target);
        let pieces = columns / S::F64_LANES;
        assert!(rows <= stride && target.len() == rows * pieces && z_x.len() == 3 * pieces, "rows of one shape");
        for piece in 0..pieces {
            let factors = [x[piece], y[piece]];
            let z_factors = [z_x[piece], z_x[pieces + piece], z_x[2 * pieces + piece]];
            for k in 0..rows {
                let sum = add_products(simd, [by[0][k], by[1][k]], factors, target[k * pieces + piece]);
                target[k * pieces + piece] = take_products(simd, [by_z[0][k], by_z[1][k], by_z[2][k]], z_factors, sum);
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
    let (b, _) = S::as_simd_f64s(b);
    let (block, _) = S::as_mut_simd_f64s(block);
    let pieces = D.next_multiple_of(LINE) / S::F64_LANES;
    assert!(block.len() == D * pieces && b.len() == 3 * pieces, "blocks of one shape");
    for piece in 0..pieces {
        let [x, y, z] = [b[piece], b[pieces + piece], b[2 * pieces + piece]];
        for k in 0..D {
            let sum = simd.negate_mul_add_f64s(a[k][0], x, block[k * pieces + piece]);
            let sum = simd.negate_mul_add_f64s(a[k][1], y, sum);
            block[k * pieces + piece] = simd.negate_mul_add_f64s(a[k][2], z, sum);
        }
    }
}
