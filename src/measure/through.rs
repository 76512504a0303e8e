//! Derivatives through the effects: one text for one measurement and for several side by side.

use super::frame::InteriorChain;
use super::lanes::{CAMERA, CENTRE, MISCLOSURE, POINT, ROTATION, THETA};
use crate::camera::PARAMETER_COUNT;
use crate::effects::{IMAGE_INTERIOR, Stage};
use crate::math::Number;
use nalgebra::SMatrix;
use std::ops::Range;

/// Derivatives of an image point, by place (see `lanes`): of one measurement, or of those in a register.
pub(super) trait Derivatives {
    /// A number, or those of a register.
    type Number: Number;
    /// That of coordinate `i`.
    fn get(&self, i: usize, place: usize) -> Self::Number;
    /// Replaces it.
    fn set(&mut self, i: usize, place: usize, value: Self::Number);
}

/// Numbers in a fixed order, of one measurement or of those in a register.
pub(super) trait Numbers<T> {
    /// Number `k`.
    fn at(&self, k: usize) -> T;
}

impl Numbers<f64> for [f64] {
    #[inline(always)]
    fn at(&self, k: usize) -> f64 {
        self[k]
    }
}

/// Derivatives of an image effect that hands on what it gets, row by row.
pub(super) const IMAGE_IDENTITY: [f64; 2 * IMAGE_INPUTS] = identity(2, 0);

/// `[0 I 0]` of so many rows, `I` from column `first` on.
pub(super) const fn identity<const N: usize>(rows: usize, first: usize) -> [f64; N] {
    let mut matrix = [0.0; N];
    let mut row = 0;
    while row < rows {
        matrix[row * (N / rows) + first + row] = 1.0;
        row += 1;
    }
    matrix
}

/// First of the numbers of a [`super::ray::Ray`]: its turn by (w, C), 3 x 6 by columns.
pub(super) const TURN: usize = 0;
/// First of its shift by (w, C), 3 x 6 by columns.
pub(super) const SHIFT: usize = TURN + 18;
/// First of its shift by the object point, 3 x 3 by columns.
pub(super) const SHIFT_BY_POINT: usize = SHIFT + 18;
/// First of its turns and shifts by parameters, 3 and 3 for each.
pub(super) const BY_THETA: usize = SHIFT_BY_POINT + 9;

/// From derivatives by the turn of the camera that the ray reaches and by its point to those by the pose, the point and
/// the parameters `locals` of what the ray went through. `turns`: whether any of these turns the camera.
#[inline(always)]
pub(super) fn through_ray<D: Derivatives>(
    d: &mut D,
    ray: &(impl Numbers<D::Number> + ?Sized),
    turns: bool,
    locals: &[usize],
) {
    for i in 0..2 {
        let by_turn = [d.get(i, ROTATION), d.get(i, ROTATION + 1), d.get(i, ROTATION + 2)];
        let by_shift = [d.get(i, POINT), d.get(i, POINT + 1), d.get(i, POINT + 2)];
        for k in 0..6 {
            let mut sum = product(&by_shift, ray, SHIFT + 3 * k);
            if turns {
                sum = sum + product(&by_turn, ray, TURN + 3 * k);
            } else if k < CENTRE - ROTATION {
                sum = sum + by_turn[k];
            }
            d.set(i, ROTATION + k, sum);
        }
        for k in 0..3 {
            d.set(i, POINT + k, product(&by_shift, ray, SHIFT_BY_POINT + 3 * k));
        }
        for (k, local) in locals.iter().enumerate() {
            let mut sum = product(&by_shift, ray, BY_THETA + 6 * k + 3);
            if turns {
                sum = sum + product(&by_turn, ray, BY_THETA + 6 * k);
            }
            d.set(i, THETA + local, sum);
        }
    }
}

#[inline(always)]
fn product<T: Number>(a: &[T; 3], numbers: &(impl Numbers<T> + ?Sized), first: usize) -> T {
    a[0] * numbers.at(first) + a[1] * numbers.at(first + 1) + a[2] * numbers.at(first + 2)
}

/// Numbers that an image effect gets.
pub(super) const IMAGE_INPUTS: usize = Stage::Image.inputs();

/// Through an image effect with derivatives `d_in` (2 x [`IMAGE_INPUTS`]) by what it got and `d_own` by its own
/// parameters, which stand from `own` on in the local list; `before` are those of the effects before it. `identity`: it
/// hands on what it gets.
#[inline(always)]
pub(super) fn through_image<D: Derivatives>(
    d: &mut D,
    (d_in, d_own): (&(impl Numbers<D::Number> + ?Sized), &(impl Numbers<D::Number> + ?Sized)),
    own: Range<usize>,
    before: impl Iterator<Item = usize>,
    identity: bool,
) {
    if !identity {
        let by_point = [[d_in.at(0), d_in.at(1)], [d_in.at(IMAGE_INPUTS), d_in.at(IMAGE_INPUTS + 1)]];
        for place in (CAMERA..MISCLOSURE).chain(before.map(|k| THETA + k)) {
            let (x, y) = (d.get(0, place), d.get(1, place));
            for i in 0..2 {
                d.set(i, place, by_point[i][0] * x + by_point[i][1] * y);
            }
        }
        for i in 0..2 {
            for k in 0..PARAMETER_COUNT {
                d.set(i, CAMERA + k, d.get(i, CAMERA + k) + d_in.at(i * IMAGE_INPUTS + IMAGE_INTERIOR + k));
            }
        }
    }
    let count = own.len();
    for i in 0..2 {
        for (p, local) in own.clone().enumerate() {
            d.set(i, THETA + local, d_own.at(i * count + p));
        }
    }
}

/// From derivatives by the interior orientation after its effects to those by that before them.
pub(super) fn through_interior(d: &mut impl Derivatives<Number = f64>, chain: &InteriorChain) {
    for i in 0..2 {
        for (local, entry, value) in &chain.d_theta {
            d.set(i, THETA + local, d.get(i, THETA + local) + value * d.get(i, CAMERA + entry));
        }
        if chain.d_rotation.is_none() && chain.d_interior.is_none() {
            continue;
        }
        let by_interior = SMatrix::<f64, 1, PARAMETER_COUNT>::from_fn(|_, k| d.get(i, CAMERA + k));
        if let Some(d_rotation) = &chain.d_rotation {
            let by_rotation = by_interior * d_rotation;
            for k in 0..3 {
                d.set(i, ROTATION + k, d.get(i, ROTATION + k) + by_rotation[k]);
            }
        }
        if let Some(d_interior) = &chain.d_interior {
            let through = by_interior * d_interior;
            for k in 0..PARAMETER_COUNT {
                d.set(i, CAMERA + k, through[k]);
            }
        }
    }
}
