//! Derivatives through the effects: one text for one measurement and for several side by side.

use super::frame::Stages;
use super::interior_chain::InteriorChain;
use super::lanes::{CAMERA, CENTRE, MISCLOSURE, POINT, ROTATION, THETA};
use super::ray::Ray;
use super::rays::Rays;
use crate::camera::PARAMETER_COUNT;
use crate::effects::answer::Inputs;
use crate::effects::{IMAGE_INTERIOR, Stage};
use crate::math::Several;
use nalgebra::SMatrix;
use std::ops::Range;

/// Derivatives of an image point, by place (see `lanes`): of one measurement, or of several.
pub(super) trait Derivatives {
    /// Of one measurement, or of several.
    type Number: Several;
    /// That of coordinate `i`.
    fn get(&self, i: usize, place: usize) -> Self::Number;
    /// Replaces it.
    fn set(&mut self, i: usize, place: usize, value: Self::Number);
}

/// What is kept of their numbers.
type Kept<D> = <<D as Derivatives>::Number as Several>::Kept;

/// From derivatives by the turn of the camera that the ray reaches and by its point to those by the pose, the point and
/// the parameters `locals` of what the ray went through.
#[inline(always)]
pub(super) fn through_ray<D: Derivatives>(d: &mut D, ray: &Ray<Kept<D>>, locals: &[usize]) {
    for i in 0..2 {
        let by_turn = [d.get(i, ROTATION), d.get(i, ROTATION + 1), d.get(i, ROTATION + 2)];
        let by_shift = [d.get(i, POINT), d.get(i, POINT + 1), d.get(i, POINT + 2)];
        if ray.bends {
            for k in 0..6 {
                // By a turn of the camera that moves nothing else there is what there was.
                if k < CENTRE - ROTATION && !ray.turns && !ray.shifts_by_turn {
                    continue;
                }
                let mut sum = product(&by_shift, &ray.shift_by_pose, k, 6);
                if ray.turns {
                    sum = sum + product(&by_turn, &ray.turn_by_pose, k, 6);
                } else if k < CENTRE - ROTATION {
                    sum = sum + by_turn[k];
                }
                d.set(i, ROTATION + k, sum);
            }
            set_by_point(d, i, &by_shift, ray);
        }
        for (by_theta, local) in ray.by_theta.iter().zip(locals) {
            let mut sum = product(&by_shift, by_theta, 3, 1);
            if ray.turns {
                sum = sum + product(&by_turn, by_theta, 0, 1);
            }
            d.set(i, THETA + local, sum);
        }
    }
}

/// From derivatives by the point of a ray that reaches the camera to those by the point that it came from.
#[inline(always)]
pub(super) fn point_through_ray<D: Derivatives>(d: &mut D, ray: &Ray<Kept<D>>) {
    for i in 0..2 {
        let by_shift = [d.get(i, POINT), d.get(i, POINT + 1), d.get(i, POINT + 2)];
        set_by_point(d, i, &by_shift, ray);
    }
}

#[inline(always)]
fn set_by_point<D: Derivatives>(d: &mut D, i: usize, by_shift: &[D::Number; 3], ray: &Ray<Kept<D>>) {
    for k in 0..3 {
        d.set(i, POINT + k, product(by_shift, &ray.shift_by_point, k, 3));
    }
}

/// With the numbers from `first` on, by steps of `step`.
#[inline(always)]
fn product<T: Several>(a: &[T; 3], kept: &[T::Kept], first: usize, step: usize) -> T {
    let [x, y, z] = *a;
    x * x.of(kept[first]) + y * y.of(kept[first + step]) + z * z.of(kept[first + 2 * step])
}

/// Numbers that an image effect gets.
pub(super) const IMAGE_INPUTS: usize = Stage::Image.inputs();

/// Through an image effect with derivatives `d_in` (2 x [`IMAGE_INPUTS`]) by what it got and `d_own` by its own
/// parameters, which stand from `own` on in the local list; `before` are those of the effects before it. All but
/// `inputs` it hands on.
#[inline(always)]
pub(super) fn through_image<D: Derivatives>(
    d: &mut D,
    (d_in, d_own): (&[Kept<D>], &[Kept<D>]),
    own: Range<usize>,
    before: impl Iterator<Item = usize>,
    inputs: Inputs,
) {
    let seed = d.get(0, CAMERA);
    if !inputs.is_empty() {
        let by_point = by_image_point::<D>(seed, d_in);
        for place in CAMERA..MISCLOSURE {
            move_on(d, &by_point, place);
        }
        for local in before {
            move_on(d, &by_point, THETA + local);
        }
        for k in (0..PARAMETER_COUNT).filter(|k| inputs.contains(IMAGE_INTERIOR + k)) {
            for i in 0..2 {
                d.set(i, CAMERA + k, d.get(i, CAMERA + k) + seed.of(d_in[i * IMAGE_INPUTS + IMAGE_INTERIOR + k]));
            }
        }
    }
    let count = own.len();
    for i in 0..2 {
        for (p, local) in own.clone().enumerate() {
            d.set(i, THETA + local, seed.of(d_own[i * count + p]));
        }
    }
}

/// Adds what image effect `e`, given `input`, does by itself as the place moves. `Err`: the place of the first
/// measurement outside its domain.
#[inline(always)]
pub(super) fn add_by_place<D: Derivatives, R: Rays<Number = D::Number>>(
    d: &mut D,
    rays: &R,
    stages: &Stages,
    e: usize,
    input: &[Kept<D>],
) -> Result<(), usize> {
    for (n, axis) in stages.place_axes.iter().enumerate().filter(|(_, axis)| stages.reads_place[e][**axis]) {
        let mut own = [Kept::<D>::default(); 2];
        rays.by_place(e, input, *axis, &mut own)?;
        for i in 0..2 {
            let before = d.get(i, THETA + stages.local_len + n);
            d.set(i, THETA + stages.local_len + n, before + before.of(own[i]));
        }
    }
    Ok(())
}

/// Derivatives by the object point through an image effect; `d_in` as in [`through_image`].
#[inline(always)]
pub(super) fn point_through_image<D: Derivatives>(d: &mut D, d_in: &[Kept<D>]) {
    let by_point = by_image_point::<D>(d.get(0, POINT), d_in);
    for place in POINT..MISCLOSURE {
        move_on(d, &by_point, place);
    }
}

/// Derivatives of the image point that an image effect gives by the one that it gets.
#[inline(always)]
fn by_image_point<D: Derivatives>(seed: D::Number, d_in: &[Kept<D>]) -> [[D::Number; 2]; 2] {
    [[seed.of(d_in[0]), seed.of(d_in[1])], [seed.of(d_in[IMAGE_INPUTS]), seed.of(d_in[IMAGE_INPUTS + 1])]]
}

/// Derivatives of a point become those of one that follows it by `by_point`.
#[inline(always)]
fn move_on<D: Derivatives>(d: &mut D, by_point: &[[D::Number; 2]; 2], place: usize) {
    let (x, y) = (d.get(0, place), d.get(1, place));
    for i in 0..2 {
        d.set(i, place, by_point[i][0] * x + by_point[i][1] * y);
    }
}

/// From derivatives by the interior orientation after its effects to those by that before them.
pub(super) fn through_interior(d: &mut impl Derivatives<Number = f64>, chain: &InteriorChain) {
    for i in 0..2 {
        for (local, entry, value) in chain.by_theta() {
            d.set(i, THETA + local, d.get(i, THETA + local) + value * d.get(i, CAMERA + entry));
        }
        if chain.adds() {
            continue;
        }
        let by_interior = SMatrix::<f64, 1, PARAMETER_COUNT>::from_fn(|_, k| d.get(i, CAMERA + k));
        if let Some(d_rotation) = &chain.d_rotation {
            let by_rotation = by_interior * **d_rotation;
            for k in 0..3 {
                d.set(i, ROTATION + k, d.get(i, ROTATION + k) + by_rotation[k]);
            }
        }
        if let Some(d_interior) = &chain.d_interior {
            let through = by_interior * **d_interior;
            for k in 0..PARAMETER_COUNT {
                d.set(i, CAMERA + k, through[k]);
            }
        }
    }
}
