//! The numbers that a formula is written for: plain ones, and ones that carry derivatives.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// What a formula is written for: `f64`, or a number that carries derivatives. A plain number stands on the right: `x * 2.0`.
pub trait Number:
    Copy
    + From<f64>
    + PartialOrd
    + PartialOrd<f64>
    + PartialEq<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// The value alone, for branches.
    fn value(self) -> f64;
    /// Sine.
    fn sin(self) -> Self;
    /// Cosine.
    fn cos(self) -> Self;
    /// Exponential.
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Square root; not at zero.
    fn sqrt(self) -> Self;
    /// Whole power.
    fn powi(self, power: i32) -> Self;
}

impl Number for f64 {
    fn value(self) -> f64 {
        self
    }
    fn sin(self) -> Self {
        f64::sin(self)
    }
    fn cos(self) -> Self {
        f64::cos(self)
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn ln(self) -> Self {
        f64::ln(self)
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn powi(self, power: i32) -> Self {
        f64::powi(self, power)
    }
}

/// A value and its derivatives by `N` variables.
#[derive(Debug, Clone, Copy)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// Derivative by each variable.
    pub slope: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// Variable number `k`.
    pub fn variable(value: f64, k: usize) -> Self {
        let mut slope = [0.0; N];
        slope[k] = 1.0;
        Self { value, slope }
    }

    /// A function of it: value, and derivative there.
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self { value, slope: self.slope.map(|slope| slope * derivative) }
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    fn from(value: f64) -> Self {
        Self { value, slope: [0.0; N] }
    }
}

impl<const N: usize> PartialEq for Dual<N> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<const N: usize> PartialOrd for Dual<N> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<const N: usize> PartialEq<f64> for Dual<N> {
    fn eq(&self, other: &f64) -> bool {
        self.value == *other
    }
}

impl<const N: usize> PartialOrd<f64> for Dual<N> {
    fn partial_cmp(&self, other: &f64) -> Option<std::cmp::Ordering> {
        self.value.partial_cmp(other)
    }
}

/// An operation with another number, and with a plain one.
macro_rules! operation {
    ($trait:ident, $method:ident, $a:ident, $b:ident, $value:expr, $by_a:expr, $by_b:expr) => {
        impl<const N: usize> $trait for Dual<N> {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                let ($a, $b) = (self.value, other.value);
                let (by_a, by_b) = ($by_a, $by_b);
                let slope = std::array::from_fn(|k| self.slope[k] * by_a + other.slope[k] * by_b);
                Self { value: $value, slope }
            }
        }

        impl<const N: usize> $trait<f64> for Dual<N> {
            type Output = Self;
            fn $method(self, other: f64) -> Self {
                let ($a, $b) = (self.value, other);
                self.chain($value, $by_a)
            }
        }
    };
}
operation!(Add, add, a, b, a + b, 1.0, 1.0);
operation!(Sub, sub, a, b, a - b, 1.0, -1.0);
operation!(Mul, mul, a, b, a * b, b, a);
operation!(Div, div, a, b, a / b, 1.0 / b, -a / (b * b));

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const N: usize> Number for Dual<N> {
    fn value(self) -> f64 {
        self.value
    }
    fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }
    fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin())
    }
    fn exp(self) -> Self {
        self.chain(self.value.exp(), self.value.exp())
    }
    fn ln(self) -> Self {
        self.chain(self.value.ln(), 1.0 / self.value)
    }
    fn sqrt(self) -> Self {
        self.chain(self.value.sqrt(), 0.5 / self.value.sqrt())
    }
    fn powi(self, power: i32) -> Self {
        self.chain(self.value.powi(power), f64::from(power) * self.value.powi(power - 1))
    }
}
