//! The plain camera for eight measurements at a time, in vector registers of any width: the same text as for one
//! ([`super::PlainView`]), and the same numbers.

use super::plain::{PlainPrediction, PlainView};
use super::transpose::transpose;
use crate::camera::{DCX, DCY, Interior, PARAMETER_COUNT, PPX, PPY, fraser};
use crate::math::Number;
pub use crate::math::lane::{LANES, Lane};
use nalgebra::Vector3;
use pulp::Simd;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Numbers in a vector register.
#[derive(Clone, Copy)]
pub(super) struct Register<S: Simd> {
    pub simd: S,
    pub value: S::f64s,
}

macro_rules! operator {
    ($operator:ident, $function:ident, $instruction:ident) => {
        impl<S: Simd> $operator for Register<S> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self { simd: self.simd, value: self.simd.$instruction(self.value, other.value) }
            }
        }
    };
}
operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Mul<f64> for Register<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self * self.like(other)
    }
}

impl<S: Simd> Neg for Register<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { simd: self.simd, value: self.simd.neg_f64s(self.value) }
    }
}

impl<S: Simd> Number for Register<S> {
    #[inline(always)]
    fn like(self, value: f64) -> Self {
        Self { simd: self.simd, value: self.simd.splat_f64s(value) }
    }
}

/// Numbers of a frame that the plain camera is given: rotation by rows, projection centre.
const OF_FRAME: usize = 12;
/// First of those of the projection centre.
const CENTRE_OF_FRAME: usize = 9;
/// First of those of the rotation vector, which effects are given.
const VECTOR_OF_FRAME: usize = OF_FRAME;

/// What the plain camera is given of eight measurements.
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
pub struct Views {
    /// Of the image, measurement by measurement, then number by number: the first lanes of [`super::Frame::numbers`].
    image: [[Lane; LANES]; 2],
    /// Its interior orientation, likewise: the others.
    interior: [[Lane; LANES]; 2],
    /// The object point, likewise.
    object: [Lane; LANES],
    /// Whether one interior orientation holds in all.
    one_interior: bool,
}

/// Straight rays, as they were before effects bent them.
#[derive(Debug, Clone, Copy)]
pub struct Straight {
    image: [[Lane; LANES]; 2],
    object: [Lane; LANES],
}

/// First place in [`Predictions::rows`] of the derivatives by the interior orientation.
pub const CAMERA: usize = 0;
/// First place of those by the rotation `w`.
pub const ROTATION: usize = CAMERA + PARAMETER_COUNT;
/// First place of those by the projection centre.
pub const CENTRE: usize = ROTATION + 3;
/// First place of those by the object point.
pub const POINT: usize = CENTRE + 3;
/// Place of observed minus predicted, px, which the weighing puts there.
pub const MISCLOSURE: usize = POINT + 3;
/// Place of zeros.
pub const NOTHING: usize = MISCLOSURE + 1;
/// First place of the derivatives by the local list of effect parameters.
pub const THETA: usize = NOTHING + 1;

/// What the camera predicts of eight measurements; see [`super::PlainPrediction`].
#[derive(Debug, Clone)]
pub struct Predictions {
    /// Third coordinate in the camera frame, m; where it is not positive, the rest means nothing.
    pub depth: Lane,
    /// Image point, px.
    pub point: [Lane; 2],
    /// Derivatives of x and of y, by place.
    pub rows: [Vec<Lane>; 2],
}

impl Predictions {
    /// Room for a local list of `local_len` effect parameters.
    pub fn new(local_len: usize) -> Self {
        let row = vec![Lane::default(); THETA + local_len];
        Self { depth: Lane::default(), point: Default::default(), rows: [row.clone(), row] }
    }

    /// Makes room for a longer list, where it is.
    pub fn fit(&mut self, local_len: usize) {
        for row in &mut self.rows {
            row.resize(row.len().max(THETA + local_len), Lane::default());
        }
    }

    /// The centre of distortion follows the principal point.
    pub fn tie_centre(&mut self) {
        for row in &mut self.rows {
            for (to, from) in [(PPX, DCX), (PPY, DCY)] {
                let moved = row[CAMERA + from];
                row[CAMERA + to].iter_mut().zip(&*moved).for_each(|(to, from)| *to += from);
                row[CAMERA + from] = Lane::default();
            }
        }
    }

    /// Shrinks the derivatives along the unit vectors `u` by shares.
    #[inline(always)]
    pub fn shrink_along<S: Simd>(&mut self, simd: S, u: &[Lane; 2], shares: &Lane) {
        let [x, y] = &mut self.rows;
        let derivatives = x.iter_mut().zip(y).enumerate().filter(|(k, _)| ![MISCLOSURE, NOTHING].contains(k));
        for (_, (x, y)) in derivatives {
            for piece in 0..LANES / S::F64_LANES {
                let (u_x, u_y) = (u[0].get::<S>(piece), u[1].get::<S>(piece));
                let (of_x, of_y) = (x.get::<S>(piece), y.get::<S>(piece));
                let rest = simd.sub_f64s(simd.splat_f64s(1.0), shares.get::<S>(piece));
                let along = simd.mul_f64s(rest, simd.mul_add_f64s(u_x, of_x, simd.mul_f64s(u_y, of_y)));
                x.set::<S>(piece, simd.negate_mul_add_f64s(along, u_x, of_x));
                y.set::<S>(piece, simd.negate_mul_add_f64s(along, u_y, of_y));
            }
        }
    }
}

impl Views {
    /// Takes `lane` for a point in an image with these numbers ([`super::Frame::numbers`]).
    #[inline(always)]
    pub fn set<S: Simd>(&mut self, simd: S, lane: usize, image: &[Lane; 4], object: &Vector3<f64>) {
        let [of_pose_0, of_pose_1, of_interior_0, of_interior_1] = image;
        (self.image[0][lane], self.image[1][lane]) = (*of_pose_0, *of_pose_1);
        if !self.one_interior {
            (self.interior[0][lane], self.interior[1][lane]) = (*of_interior_0, *of_interior_1);
        }
        let (registers, _) = S::as_mut_simd_f64s(&mut *self.object[lane]);
        for (register, numbers) in registers.iter_mut().zip(object.as_slice().chunks(S::F64_LANES)) {
            *register = simd.partial_load_f64s(numbers);
        }
    }

    /// Makes what was set ready for [`Self::predict`] and [`Self::project`].
    #[inline(always)]
    pub fn turn<S: Simd>(&mut self, simd: S) {
        let [first, second] = &mut self.image;
        transpose(simd, first);
        transpose(simd, second);
        transpose(simd, &mut self.object);
        if !self.one_interior {
            let [first, second] = &mut self.interior;
            transpose(simd, first);
            transpose(simd, second);
        }
    }

    /// The interior orientation that holds in all, from now on; `None`: each image has its own.
    pub fn set_interior(&mut self, one: Option<&Interior>) {
        self.one_interior = one.is_some();
        for (lane, value) in self.interior.as_flattened_mut().iter_mut().zip(one.into_iter().flatten()) {
            *lane = Lane::splat(*value);
        }
    }

    /// The projection centre of each, once turned.
    #[inline(always)]
    pub fn centre(&self) -> [Lane; 3] {
        let image = self.image.as_flattened();
        [image[CENTRE_OF_FRAME], image[CENTRE_OF_FRAME + 1], image[CENTRE_OF_FRAME + 2]]
    }

    /// Rotation vector and projection centre of each, once turned.
    #[inline(always)]
    pub fn pose(&self) -> [Lane; 6] {
        let vector = &self.image.as_flattened()[VECTOR_OF_FRAME..];
        let [x, y, z] = self.centre();
        [vector[0], vector[1], vector[2], x, y, z]
    }

    /// The object point of each, once turned.
    #[inline(always)]
    pub fn object(&self) -> [Lane; 3] {
        [self.object[0], self.object[1], self.object[2]]
    }

    /// The rays, once turned, to be bent more than once.
    pub fn straight(&self) -> Straight {
        Straight { image: self.image, object: self.object }
    }

    /// Puts them back.
    pub fn straighten(&mut self, straight: &Straight) {
        (self.image, self.object) = (straight.image, straight.object);
    }

    /// The interior orientation of each.
    pub fn interior(&self) -> &[Lane] {
        &self.interior.as_flattened()[..PARAMETER_COUNT]
    }

    /// Number `k` behind the interior orientation of each, once turned.
    #[inline(always)]
    pub fn behind_interior(&self, k: usize) -> Lane {
        self.interior.as_flattened()[PARAMETER_COUNT + k]
    }

    /// Replaces projection centres and object points, once turned.
    #[inline(always)]
    pub fn set_ray(&mut self, centre: &[Lane; 3], object: &[Lane; 3]) {
        self.image.as_flattened_mut()[CENTRE_OF_FRAME..OF_FRAME].copy_from_slice(centre);
        self.object[..3].copy_from_slice(object);
    }

    /// Replaces rotations (by rows), once turned.
    pub fn set_rotation(&mut self, rotation: &[Lane; 9]) {
        self.image.as_flattened_mut()[..CENTRE_OF_FRAME].copy_from_slice(rotation);
    }

    /// The measurements of one register: `piece` of so many as eight take.
    #[inline(always)]
    fn view<S: Simd>(&self, simd: S, piece: usize) -> PlainView<Register<S>> {
        let nothing = Register { simd, value: simd.splat_f64s(0.0) };
        let mut image = [nothing; OF_FRAME];
        load::<S>(self.image.as_flattened(), piece, &mut image);
        let [a, b, c, d, e, f, g, h, i, centre @ ..] = image;
        let mut view = PlainView {
            rotation: [[a, b, c], [d, e, f], [g, h, i]],
            centre,
            object: [nothing; 3],
            interior: [nothing; PARAMETER_COUNT],
        };
        load(&self.object, piece, &mut view.object);
        load(self.interior(), piece, &mut view.interior);
        view
    }

    /// Predicts all eight.
    #[inline(always)]
    pub fn predict<S: Simd>(&self, simd: S, out: &mut Predictions) {
        for piece in 0..LANES / S::F64_LANES {
            let prediction = self.predict_piece(simd, piece, out);
            for (i, row) in out.rows.iter_mut().enumerate() {
                store(&prediction.d_camera[i], piece, &mut row[CAMERA..ROTATION]);
                store(&prediction.d_rotation[i], piece, &mut row[ROTATION..CENTRE]);
                let [a, b, c] = prediction.d_point[i];
                store(&[-a, -b, -c], piece, &mut row[CENTRE..POINT]);
            }
        }
    }

    /// Predicts the image points of all eight, their depths, and their derivatives by the object point.
    #[inline(always)]
    pub fn predict_by_point<S: Simd>(&self, simd: S, out: &mut Predictions) {
        for piece in 0..LANES / S::F64_LANES {
            self.predict_piece(simd, piece, out);
        }
    }

    /// What [`Self::predict_by_point`] asks for, of one register; gives all derivatives.
    #[inline(always)]
    fn predict_piece<S: Simd>(&self, simd: S, piece: usize, out: &mut Predictions) -> PlainPrediction<Register<S>> {
        let view = self.view(simd, piece);
        let camera_point = view.camera_point();
        let prediction = view.predict(camera_point);
        store(&[camera_point[2]], piece, std::slice::from_mut(&mut out.depth));
        store(&prediction.point, piece, &mut out.point);
        for (row, by_point) in out.rows.iter_mut().zip(&prediction.d_point) {
            store(by_point, piece, &mut row[POINT..MISCLOSURE]);
        }
        prediction
    }

    /// Predicts the image points of all eight, and their depths, without derivatives.
    #[inline(always)]
    pub fn project<S: Simd>(&self, simd: S, out: &mut Predictions) {
        for piece in 0..LANES / S::F64_LANES {
            let view = self.view(simd, piece);
            let camera_point = view.camera_point();
            let point = fraser::project_in_front(&view.interior, camera_point);
            store(&[camera_point[2]], piece, std::slice::from_mut(&mut out.depth));
            store(&point, piece, &mut out.point);
        }
    }
}

#[inline(always)]
fn load<S: Simd>(lanes: &[Lane], piece: usize, registers: &mut [Register<S>]) {
    for (register, lane) in registers.iter_mut().zip(lanes) {
        register.value = lane.get::<S>(piece);
    }
}

#[inline(always)]
fn store<S: Simd>(registers: &[Register<S>], piece: usize, lanes: &mut [Lane]) {
    for (lane, register) in lanes.iter_mut().zip(registers) {
        lane.set::<S>(piece, register.value);
    }
}
