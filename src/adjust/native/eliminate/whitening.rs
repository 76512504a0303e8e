//! The factor of a point's normal matrix: what is multiplied by its inverse has unit weight.

use super::super::point::LEAST_PIVOT;
use super::products::take_products;
use nalgebra::Matrix3;
use pulp::Simd;

/// `L^-1` of `V = L L'`: by rows `1/l00`; `l10, 1/l11`; `l20, l21, 1/l22`.
pub struct Whitening {
    inverse: [f64; 3],
    below: [f64; 3],
}

impl Whitening {
    /// Of `V`, of which the lower triangle counts, with its diagonal raised by the factor `1 + damping`; `None` where
    /// rays do not meet.
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
    pub(super) fn forward(&self, r: [f64; 3]) -> [f64; 3] {
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
    pub(super) fn whiten<S: Simd>(&self, simd: S, rows: &mut [f64]) {
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
