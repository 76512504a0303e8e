//! Small matrices of numbers of one measurement or of several, kept row by row.

use crate::effects::answer::{Inputs, fill_column};
use crate::math::Several;
use std::ops::Range;

/// The sum of `count` products: `a` from `.0` on by steps of `.1` with `b` likewise.
#[inline(always)]
pub(super) fn dot<T: Several>(
    seed: T,
    a: (&[T::Kept], usize, usize),
    b: (&[T::Kept], usize, usize),
    count: usize,
) -> T {
    let mut sum = seed.of(a.0[a.1]) * seed.of(b.0[b.1]);
    for k in 1..count {
        sum = sum + seed.of(a.0[a.1 + k * a.2]) * seed.of(b.0[b.1 + k * b.2]);
    }
    sum
}

/// Does an effect with derivatives `matrix` by its input, of which `inputs` may matter, do more than hand on what it
/// got, from number `first` on? A [formula](crate::effects::formula) tells by its inputs; of others the derivatives do:
/// is the matrix `[0 I 0]`, `I` from column `first` on? All of its numbers are looked at: one sum costs less than a way
/// out at each.
#[inline(always)]
pub(super) fn changes<T: Several>(seed: T, matrix: &[T::Kept], rows: usize, first: usize, inputs: Inputs) -> bool {
    if inputs != Inputs::ANY {
        return !inputs.is_empty();
    }
    let columns = matrix.len() / rows;
    let mut apart = seed.like(0.0);
    for i in 0..rows {
        for k in 0..columns {
            let of_identity = seed.like(if k == first + i { 1.0 } else { 0.0 });
            apart = apart + (seed.of(matrix[i * columns + k]) - of_identity).abs();
        }
    }
    !apart.is_zero()
}

/// Fills the columns of `[0 I 0]` that an answer left out because they are these.
#[inline(always)]
pub(super) fn fill_left_out<T: Several>(
    matrix: &mut [T::Kept],
    rows: usize,
    first: usize,
    columns: Range<usize>,
    written: Inputs,
) {
    let count = matrix.len() / rows;
    for k in columns.filter(|k| !written.contains(*k)) {
        fill_column::<T>(matrix, count, first, k);
    }
}

/// Are two lists of numbers the same? All of them are looked at, as in [`changes`].
#[inline(always)]
pub(super) fn are_equal<T: Several>(seed: T, a: &[T::Kept], b: &[T::Kept]) -> bool {
    let mut apart = seed.like(0.0);
    for k in 0..a.len() {
        apart = apart + (seed.of(a[k]) - seed.of(b[k])).abs();
    }
    apart.is_zero()
}

/// `[0 I 0]`, see [`changes`].
#[inline(always)]
pub(super) fn identity<T: Several, const N: usize>(rows: usize, first: usize) -> [T::Kept; N] {
    let mut matrix = [T::splat(0.0); N];
    for i in 0..rows {
        matrix[i * (N / rows) + first + i] = T::splat(1.0);
    }
    matrix
}

/// The product of two matrices of six by six.
#[inline(always)]
pub(super) fn times_six<T: Several>(seed: T, a: &[T::Kept; 36], b: &[T::Kept; 36]) -> [T::Kept; 36] {
    let mut product = [T::Kept::default(); 36];
    for i in 0..6 {
        for k in 0..6 {
            product[6 * i + k] = dot(seed, (a, 6 * i, 1), (b, k, 6), 6).keep();
        }
    }
    product
}
