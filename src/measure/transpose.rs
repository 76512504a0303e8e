//! Eight by eight numbers transposed, in vector registers where there are any: what is by measurement becomes by
//! quantity, and back. One number at a time costs as much as the camera itself.

use crate::math::lane::{LANES, Lane};
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};
use pulp::{Simd, cast};
use std::any::Any;

/// Transposes `square`.
#[inline(always)]
pub fn transpose<S: Simd>(simd: S, square: &mut [Lane; LANES]) {
    // Which registers there are is known when this is compiled: of the branches one is left.
    #[cfg(target_arch = "x86_64")]
    {
        let simd: &dyn Any = &simd;
        if let Some(simd) = simd.downcast_ref::<V4>() {
            return by_eights(*simd, square);
        }
        if let Some(simd) = simd.downcast_ref::<V3>() {
            return by_fours(*simd, square);
        }
    }
    one_by_one(square);
}

#[inline(always)]
fn one_by_one(square: &mut [Lane; LANES]) {
    for i in 0..LANES {
        for k in 0..i {
            (square[i][k], square[k][i]) = (square[k][i], square[i][k]);
        }
    }
}

/// Pairs of numbers change places within pairs of rows, then pairs within fours, then fours.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn by_eights(simd: V4, square: &mut [Lane; LANES]) {
    /// Pairs 0 and 2 of both, and pairs 1 and 3.
    const EVEN: i32 = 0b10_00_10_00;
    const ODD: i32 = 0b11_01_11_01;
    let simd = simd.avx512f;
    let mut rows = [cast(square[0].0); LANES];
    for (row, numbers) in rows.iter_mut().zip(&*square) {
        *row = cast(numbers.0);
    }
    let mut pairs = rows;
    for k in [0, 2, 4, 6] {
        pairs[k] = simd._mm512_unpacklo_pd(rows[k], rows[k + 1]);
        pairs[k + 1] = simd._mm512_unpackhi_pd(rows[k], rows[k + 1]);
    }
    let mut fours = pairs;
    for k in [0, 1, 4, 5] {
        fours[k] = simd._mm512_shuffle_f64x2::<EVEN>(pairs[k], pairs[k + 2]);
        fours[k + 2] = simd._mm512_shuffle_f64x2::<ODD>(pairs[k], pairs[k + 2]);
    }
    for k in 0..4 {
        square[k].0 = cast(simd._mm512_shuffle_f64x2::<EVEN>(fours[k], fours[k + 4]));
        square[k + 4].0 = cast(simd._mm512_shuffle_f64x2::<ODD>(fours[k], fours[k + 4]));
    }
}

/// Quarter by quarter; those beside the diagonal change places.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn by_fours(simd: V3, square: &mut [Lane; LANES]) {
    const HALF: usize = LANES / 2;
    /// The lower halves of both, and the upper halves.
    const LOWER: i32 = 0x20;
    const UPPER: i32 = 0x31;
    let simd = simd.avx;
    let mut quarters = [[cast([0.0; HALF]); 2]; LANES];
    for (quarters, numbers) in quarters.iter_mut().zip(&*square) {
        *quarters = cast(numbers.0);
    }
    for (above, left) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let at = HALF * above;
        let (a, b) = (quarters[at][left], quarters[at + 1][left]);
        let (c, d) = (quarters[at + 2][left], quarters[at + 3][left]);
        let (even, odd) = (simd._mm256_unpacklo_pd(a, b), simd._mm256_unpackhi_pd(a, b));
        let (even_below, odd_below) = (simd._mm256_unpacklo_pd(c, d), simd._mm256_unpackhi_pd(c, d));
        let rows = [
            simd._mm256_permute2f128_pd::<LOWER>(even, even_below),
            simd._mm256_permute2f128_pd::<LOWER>(odd, odd_below),
            simd._mm256_permute2f128_pd::<UPPER>(even, even_below),
            simd._mm256_permute2f128_pd::<UPPER>(odd, odd_below),
        ];
        for (k, row) in rows.into_iter().enumerate() {
            let numbers: [f64; HALF] = cast(row);
            square[HALF * left + k][at..at + HALF].copy_from_slice(&numbers);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Scalar, WithSimd};

    struct Transpose<'a>(&'a mut [Lane; LANES]);

    impl WithSimd for Transpose<'_> {
        type Output = ();
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            transpose(simd, self.0);
        }
    }

    #[test]
    fn rows_become_columns_at_every_width() {
        let square: [Lane; LANES] = std::array::from_fn(|i| Lane(std::array::from_fn(|k| (10 * i + k) as f64)));
        let expected: [Lane; LANES] = std::array::from_fn(|i| Lane(std::array::from_fn(|k| square[k][i])));
        let mut found = square;
        Simd::vectorize(Scalar, Transpose(&mut found));
        assert_eq!(found, expected);
        #[cfg(target_arch = "x86_64")]
        {
            found = square;
            if let Some(simd) = V3::try_new() {
                Simd::vectorize(simd, Transpose(&mut found));
                assert_eq!(found, expected);
            }
            found = square;
            if let Some(simd) = V4::try_new() {
                Simd::vectorize(simd, Transpose(&mut found));
                assert_eq!(found, expected);
            }
        }
    }
}
