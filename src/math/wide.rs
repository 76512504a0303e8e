//! Eight measurements as one number: in as many vector registers as they take.

use super::lane::{LANES, Lane};
use super::{Number, Several};
use pulp::Simd;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// One number of each of eight measurements, for formulas over [`Number`].
#[derive(Clone, Copy)]
pub struct Wide<S: Simd> {
    /// Which registers there are.
    pub simd: S,
    /// The numbers.
    pub lane: Lane,
}

/// Registers that eight numbers take.
const fn pieces<S: Simd>() -> usize {
    LANES / S::F64_LANES
}

macro_rules! operator {
    ($operator:ident, $function:ident, $instruction:ident) => {
        impl<S: Simd> $operator for Wide<S> {
            type Output = Self;
            #[inline(always)]
            fn $function(mut self, other: Self) -> Self {
                for piece in 0..pieces::<S>() {
                    let value = self.simd.$instruction(self.lane.get::<S>(piece), other.lane.get::<S>(piece));
                    self.lane.set::<S>(piece, value);
                }
                self
            }
        }
    };
}
operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Mul<f64> for Wide<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self * self.like(other)
    }
}

/// What an instruction makes of a number of each. A macro: a closure would not inherit the instructions that its caller
/// is compiled for.
macro_rules! each {
    ($number:ident, $instruction:ident) => {{
        let mut number = $number;
        for piece in 0..pieces::<S>() {
            let value = number.simd.$instruction(number.lane.get::<S>(piece));
            number.lane.set::<S>(piece, value);
        }
        number
    }};
}

impl<S: Simd> Neg for Wide<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        each!(self, neg_f64s)
    }
}

impl<S: Simd> Number for Wide<S> {
    #[inline(always)]
    fn like(self, value: f64) -> Self {
        Self { simd: self.simd, lane: Lane::splat(value) }
    }
}

impl<S: Simd> Several for Wide<S> {
    type Kept = Lane;

    #[inline(always)]
    fn keep(self) -> Lane {
        self.lane
    }

    #[inline(always)]
    fn of(self, kept: Lane) -> Self {
        Self { simd: self.simd, lane: kept }
    }

    #[inline(always)]
    fn splat(value: f64) -> Lane {
        Lane::splat(value)
    }

    /// Without the sign bit; `abs_f64s` of pulp 0.22 calls a function for it.
    #[inline(always)]
    fn abs(mut self) -> Self {
        let magnitude = self.simd.splat_f64s(f64::from_bits(!(1 << 63)));
        for piece in 0..pieces::<S>() {
            let value = self.simd.and_f64s(magnitude, self.lane.get::<S>(piece));
            self.lane.set::<S>(piece, value);
        }
        self
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        each!(self, sqrt_f64s)
    }

    /// One by one: the same function, and so the same bits, as for one measurement.
    #[inline(always)]
    fn exp(mut self) -> Self {
        self.lane.iter_mut().for_each(|value| *value = value.exp());
        self
    }

    /// One by one, as [`Self::exp`].
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (mut sine, mut cosine) = (self, self);
        for (sine, cosine) in sine.lane.iter_mut().zip(cosine.lane.iter_mut()) {
            (*sine, *cosine) = sine.sin_cos();
        }
        (sine, cosine)
    }

    #[inline(always)]
    fn not_zero(mut self) -> Self {
        self.lane.iter_mut().for_each(|value| *value = if *value == 0.0 { 0.0 } else { 1.0 });
        self
    }

    #[inline(always)]
    fn is_zero(self) -> bool {
        let mut zero = true;
        for piece in 0..pieces::<S>() {
            let is_zero = self.simd.equal_f64s(self.lane.get::<S>(piece), self.simd.splat_f64s(0.0));
            zero &= self.simd.first_true_m64s(self.simd.not_m64s(is_zero)) == S::F64_LANES;
        }
        zero
    }

    #[inline(always)]
    fn not_positive(kept: &Lane) -> Option<usize> {
        kept.iter().position(|value| value.is_nan() || *value <= 0.0)
    }
}
