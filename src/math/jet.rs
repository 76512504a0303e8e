//! A number with its derivatives by `N` unknowns: forward-mode automatic differentiation.

use super::{DoubleDouble, Number};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Value and derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet<T, const N: usize> {
    /// The value.
    pub value: T,
    /// Its derivatives.
    pub slope: [T; N],
}

impl<T: Number, const N: usize> Jet<T, N> {
    /// A number that depends on nothing.
    pub fn constant(value: T) -> Self {
        Self { value, slope: [value.like(0.0); N] }
    }

    /// The unknown `k`.
    pub fn unknown(value: T, k: usize) -> Self {
        let mut jet = Self::constant(value);
        jet.slope[k] = value.like(1.0);
        jet
    }

    /// A function of this number: its value here and its derivative.
    pub fn chain(self, value: T, derivative: T) -> Self {
        Self { value, slope: self.slope.map(|slope| slope * derivative) }
    }
}

// Calls: a formula of inlined products of a dozen double-doubles each is compiled for longer than it is ever run.
impl<T: Number, const N: usize> Add for Jet<T, N> {
    type Output = Self;
    #[inline(never)]
    fn add(mut self, other: Self) -> Self {
        self.value = self.value + other.value;
        for k in 0..N {
            self.slope[k] = self.slope[k] + other.slope[k];
        }
        self
    }
}

impl<T: Number, const N: usize> Sub for Jet<T, N> {
    type Output = Self;
    #[inline(never)]
    fn sub(mut self, other: Self) -> Self {
        self.value = self.value - other.value;
        for k in 0..N {
            self.slope[k] = self.slope[k] - other.slope[k];
        }
        self
    }
}

impl<T: Number, const N: usize> Mul for Jet<T, N> {
    type Output = Self;
    #[inline(never)]
    fn mul(mut self, other: Self) -> Self {
        for k in 0..N {
            self.slope[k] = self.slope[k] * other.value + other.slope[k] * self.value;
        }
        self.value = self.value * other.value;
        self
    }
}

impl<T: Number, const N: usize> Div for Jet<T, N> {
    type Output = Self;
    #[inline(never)]
    fn div(mut self, other: Self) -> Self {
        let inverse = other.value.like(1.0) / other.value;
        self.value = self.value / other.value;
        for k in 0..N {
            self.slope[k] = (self.slope[k] - self.value * other.slope[k]) * inverse;
        }
        self
    }
}

impl<T: Number, const N: usize> Neg for Jet<T, N> {
    type Output = Self;
    fn neg(mut self) -> Self {
        self.value = -self.value;
        self.slope = self.slope.map(|slope| -slope);
        self
    }
}

impl<T: Number, const N: usize> Mul<f64> for Jet<T, N> {
    type Output = Self;
    #[inline(never)]
    fn mul(mut self, other: f64) -> Self {
        self.value = self.value * other;
        self.slope = self.slope.map(|slope| slope * other);
        self
    }
}

impl<T: Number, const N: usize> Number for Jet<T, N> {
    fn like(self, value: f64) -> Self {
        Self::constant(self.value.like(value))
    }
}

/// A [`Number`] with the functions that forward models need.
pub trait Real: Number {
    /// Its value as a double, for decisions.
    fn double(self) -> f64;
    /// Square root.
    fn root(self) -> Self;
    /// Exponential.
    fn exponential(self) -> Self;
}

impl Real for DoubleDouble {
    fn double(self) -> f64 {
        self.hi
    }
    fn root(self) -> Self {
        self.sqrt()
    }
    fn exponential(self) -> Self {
        self.exp()
    }
}

impl Real for f64 {
    fn double(self) -> f64 {
        self
    }
    fn root(self) -> Self {
        self.sqrt()
    }
    fn exponential(self) -> Self {
        self.exp()
    }
}

impl<T: Real, const N: usize> Real for Jet<T, N> {
    fn double(self) -> f64 {
        self.value.double()
    }
    fn root(self) -> Self {
        let root = self.value.root();
        self.chain(root, root.like(0.5) / root)
    }
    fn exponential(self) -> Self {
        let exponential = self.value.exponential();
        self.chain(exponential, exponential)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_differences() {
        let formula = |x: Jet<f64, 2>, y: Jet<f64, 2>| {
            (x * y - x / y + (x * 3.0).exponential()).root() * y - x.like(2.0) + -(y * y)
        };
        let at = |x: f64, y: f64| formula(Jet::unknown(x, 0), Jet::unknown(y, 1));
        let (x, y, step) = (0.7, 1.3, 1e-6);
        let by_x = (at(x + step, y).value - at(x - step, y).value) / (2.0 * step);
        let by_y = (at(x, y + step).value - at(x, y - step).value) / (2.0 * step);
        let [dx, dy] = at(x, y).slope;
        assert!((dx - by_x).abs() < 1e-8 && (dy - by_y).abs() < 1e-8, "{dx} {by_x}, {dy} {by_y}");
    }
}
