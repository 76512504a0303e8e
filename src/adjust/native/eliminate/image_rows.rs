//! What an image measurement adds to the sums of its image.

use super::super::rows::{Rows, SECOND};
use super::products::{add_products, take_products};
use super::whitening::Whitening;
use pulp::Simd;

/// The two rows of an image measurement. `D`: unknowns of an image.
pub(super) struct ImageRows<'a, S: Simd, const D: usize> {
    pub shared: [&'a [f64]; 2],
    pub image: [&'a [f64]; 2],
    /// `Q`: by the point, whitened.
    by_point: [[f64; 3]; 2],
    /// The derivatives by each unknown of the image, in all places of a register.
    by_unknown: [[S::f64s; 2]; D],
}

impl<'a, S: Simd, const D: usize> ImageRows<'a, S, D> {
    #[inline(always)]
    pub fn of(simd: S, rows: &'a Rows, pair: usize, whitening: &Whitening) -> Self {
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
    pub fn multiply(&self, simd: S, z: &mut [f64], image_sums: &mut [f64]) {
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
    pub fn add_product(&self, simd: S, x: [&[f64]; 2], z: &[f64], target: &mut [f64]) {
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
