//! Formulas that are written once for a number and for several numbers side by side.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number, or a lane of numbers in a vector register: what a formula does to one it does to each.
///
/// Formulas over it are written out, without closures: a closure is a function of its own, which does not inherit the instructions that its
/// caller is compiled for.
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
