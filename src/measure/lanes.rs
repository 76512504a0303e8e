//! The plain camera for eight measurements at a time, in vector registers of any width: the same text as for one ([`super::PlainView`]), and the
//! same numbers.

use super::frame::Frame;
use super::plain::PlainView;
use crate::camera::{Interior, PARAMETER_COUNT, fraser};
use crate::math::Number;
use nalgebra::Vector3;
use pulp::Simd;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Measurements side by side.
pub const LANES: usize = 8;

/// One number of each.
pub type Lane = [f64; LANES];

/// Numbers in a vector register.
#[derive(Clone, Copy)]
struct Register<S: Simd> {
    simd: S,
    value: S::f64s,
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

/// What the plain camera is given of eight measurements.
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
pub struct Views {
    rotation: [[Lane; 3]; 3],
    centre: [Lane; 3],
    object: [Lane; 3],
    interior: [Lane; PARAMETER_COUNT],
}

/// What it predicts of them; see [`super::PlainPrediction`].
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
pub struct Predictions {
    /// Third coordinate in the camera frame, m; where it is not positive, the rest means nothing.
    pub depth: Lane,
    /// Image point, px.
    pub point: [Lane; 2],
    /// By the interior orientation.
    pub d_camera: [[Lane; PARAMETER_COUNT]; 2],
    /// By the rotation `w`.
    pub d_rotation: [[Lane; 3]; 2],
    /// By the object point.
    pub d_point: [[Lane; 3]; 2],
}

impl Predictions {
    /// Multiplies all derivatives by weights.
    #[inline(always)]
    pub fn weigh<S: Simd>(&mut self, simd: S, weights: &Lane) {
        let (weights, _) = S::as_simd_f64s(weights);
        let Self { d_camera, d_rotation, d_point, .. } = self;
        for i in 0..2 {
            for lane in d_camera[i].iter_mut().chain(&mut d_rotation[i]).chain(&mut d_point[i]) {
                for (value, weight) in S::as_mut_simd_f64s(lane).0.iter_mut().zip(weights) {
                    *value = simd.mul_f64s(*value, *weight);
                }
            }
        }
    }
}

impl Views {
    /// Takes `lane` for a point in the image of `frame`.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, frame: &Frame, object: &Vector3<f64>) {
        for k in 0..3 {
            for i in 0..3 {
                self.rotation[i][k][lane] = frame.rotation[(i, k)];
            }
            self.centre[k][lane] = frame.centre[k];
            self.object[k][lane] = object[k];
        }
    }

    /// The interior orientation that holds in `lane`.
    #[inline(always)]
    pub fn set_interior(&mut self, lane: usize, interior: &Interior) {
        for (slot, value) in self.interior.iter_mut().zip(interior) {
            slot[lane] = *value;
        }
    }

    /// The interior orientation that holds in all.
    pub fn set_interiors(&mut self, interior: &Interior) {
        self.interior = interior.map(|value| [value; LANES]);
    }

    /// The measurements of one register: `piece` of so many as eight take.
    #[inline(always)]
    fn view<S: Simd>(&self, simd: S, piece: usize) -> PlainView<Register<S>> {
        let nothing = Register { simd, value: simd.splat_f64s(0.0) };
        let mut view = PlainView {
            rotation: [[nothing; 3]; 3],
            centre: [nothing; 3],
            object: [nothing; 3],
            interior: [nothing; PARAMETER_COUNT],
        };
        for i in 0..3 {
            load(&self.rotation[i], piece, &mut view.rotation[i]);
        }
        load(&self.centre, piece, &mut view.centre);
        load(&self.object, piece, &mut view.object);
        load(&self.interior, piece, &mut view.interior);
        view
    }

    /// Predicts all eight.
    #[inline(always)]
    pub fn predict<S: Simd>(&self, simd: S, out: &mut Predictions) {
        for piece in 0..LANES / S::F64_LANES {
            let view = self.view(simd, piece);
            let camera_point = view.camera_point();
            let prediction = view.predict(camera_point);
            store(&[camera_point[2]], piece, std::slice::from_mut(&mut out.depth));
            store(&prediction.point, piece, &mut out.point);
            for i in 0..2 {
                store(&prediction.d_camera[i], piece, &mut out.d_camera[i]);
                store(&prediction.d_rotation[i], piece, &mut out.d_rotation[i]);
                store(&prediction.d_point[i], piece, &mut out.d_point[i]);
            }
        }
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
        register.value = S::as_simd_f64s(lane).0[piece];
    }
}

#[inline(always)]
fn store<S: Simd>(registers: &[Register<S>], piece: usize, lanes: &mut [Lane]) {
    for (lane, register) in lanes.iter_mut().zip(registers) {
        S::as_mut_simd_f64s(lane).0[piece] = register.value;
    }
}
