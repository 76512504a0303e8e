//! Formulas that are written once for a number and for several numbers side by side.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number, or a lane of numbers in a vector register: what a formula does to one it does to each.
///
/// Formulas over it are written out, without closures: a closure is a function of its own, which does not inherit the
/// instructions that its caller is compiled for.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
{
    /// `value` in each place of a lane like this one.
    fn like(self, value: f64) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn like(self, value: f64) -> Self {
        value
    }
}

/// A number of one measurement, or of several side by side, with the form in which it is kept in memory.
pub trait Several: Number {
    /// What is kept of it.
    type Kept: Copy + PartialEq + Default;

    /// What is kept.
    fn keep(self) -> Self::Kept;

    /// What was kept, as a number like this one.
    fn of(self, kept: Self::Kept) -> Self;

    /// One value, kept for each.
    fn splat(value: f64) -> Self::Kept;

    /// Its absolute value.
    fn abs(self) -> Self;

    /// Its square root.
    fn sqrt(self) -> Self;

    /// Its exponential.
    fn exp(self) -> Self;

    /// Its sine and its cosine.
    fn sin_cos(self) -> (Self, Self);

    /// Zero where it is zero, one elsewhere.
    fn not_zero(self) -> Self;

    /// Is it zero for all?
    fn is_zero(self) -> bool;

    /// The place of the first that is not above zero, NaN included.
    fn not_positive(kept: &Self::Kept) -> Option<usize>;
}

impl Several for f64 {
    type Kept = f64;

    #[inline(always)]
    fn keep(self) -> f64 {
        self
    }

    #[inline(always)]
    fn of(self, kept: f64) -> f64 {
        kept
    }

    #[inline(always)]
    fn splat(value: f64) -> f64 {
        value
    }

    #[inline(always)]
    fn abs(self) -> f64 {
        f64::abs(self)
    }

    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn exp(self) -> f64 {
        f64::exp(self)
    }

    #[inline(always)]
    fn sin_cos(self) -> (f64, f64) {
        f64::sin_cos(self)
    }

    #[inline(always)]
    fn not_zero(self) -> f64 {
        if self == 0.0 { 0.0 } else { 1.0 }
    }

    #[inline(always)]
    fn is_zero(self) -> bool {
        self == 0.0
    }

    #[inline(always)]
    fn not_positive(kept: &f64) -> Option<usize> {
        if *kept > 0.0 { None } else { Some(0) }
    }
}
