//! One ray or several side by side: what [`Ray`](super::ray::Ray) asks of those that it is computed for.

use super::frame::Frame;
use crate::effects::answer::{Answer, Inputs};
use crate::math::Several;
use nalgebra::{Matrix3, Vector3};

/// Rays to be bent: one, or eight side by side.
pub(super) trait Rays {
    /// What their numbers are computed with.
    type Number: Several;

    /// A number like those of the rays.
    fn seed(&self) -> Self::Number;

    /// A number of the image of each.
    fn of_frames(&self, number: impl Fn(&Frame) -> f64) -> Kept<Self>;

    /// A matrix that follows from a vector of each, row by row.
    fn matrices(&self, vector: &[Kept<Self>; 3], matrix: fn(&Vector3<f64>) -> Matrix3<f64>) -> [Kept<Self>; 9];

    /// Asks effect `e`; gives the inputs on which the answers may depend otherwise than by handing them on. `Err`: the
    /// place of the first ray outside its domain.
    fn ask(&self, e: usize, input: &[Kept<Self>], answer: &mut Answer<'_, Kept<Self>>) -> Result<Inputs, usize>;

    /// Derivatives of what effect `e` answers by the place, column (`axis` 0) or row (1). `Err`: as of [`Self::ask`].
    fn by_place(&self, e: usize, input: &[Kept<Self>], axis: usize, derivative: &mut [Kept<Self>])
    -> Result<(), usize>;
}

/// A number of rays in memory.
pub(super) type Kept<R> = <<R as Rays>::Number as Several>::Kept;

/// A matrix of the image of each, row by row.
#[inline(always)]
pub(super) fn of_matrices<R: Rays>(rays: &R, matrix: impl Fn(&Frame) -> &Matrix3<f64>) -> [Kept<R>; 9] {
    let mut rows = [Kept::<R>::default(); 9];
    for (k, slot) in rows.iter_mut().enumerate() {
        *slot = rays.of_frames(|frame| matrix(frame)[(k / 3, k % 3)]);
    }
    rows
}
