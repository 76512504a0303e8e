//! Sums over the rows of a batch with each point taken out, in whole vectors: `S += J'J - Z'Z`, `b += J'v - Z'z`, where
//! a point has `V = J_point' J_point = L L'`, `Z = L^-1 J_point' J` and `z = L^-1 J_point' v`.
//!
//! What an image shares with itself and with the border is summed as `J'(J - Q Z)`, `Q = J_point L^-T` of its two rows:
//! two products for each number instead of five.

mod image_rows;
mod products;
mod whitening;

use super::aligned::{Aligned, LINE};
use super::rows::Rows;
use super::structure::Structure;
use super::system::System;
use image_rows::ImageRows;
use products::{COLUMNS, add_outer, multiply, normal, splat_columns, take_product};
use pulp::{Simd, WithSimd};
pub use whitening::Whitening;

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
