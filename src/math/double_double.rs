//! Double-double arithmetic: a number as the unevaluated sum of two doubles, 106 bits of mantissa. For certificates,
//! whose digits have to be beyond those of whom they judge.
//!
//! Source: Joldes, Muller, Popescu, "Tight and rigorous error bounds for basic building blocks of double-word
//! arithmetic" (2017); the exact product after Dekker (1971), so that it is as fast where the processor's fused
//! multiplication is not to be had.

use super::Number;
use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// `hi + lo`, `|lo|` at most half a unit in the last place of `hi`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DoubleDouble {
    /// The number as a double.
    pub hi: f64,
    /// What that leaves.
    pub lo: f64,
}

/// Splits a double into two of 26 bits.
const SPLITTER: f64 = 134_217_729.0;

/// `a + b` and its rounding error, exactly.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

/// [`two_sum`] where `|a| >= |b|`.
#[inline(always)]
fn quick_two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    DoubleDouble { hi, lo: b - (hi - a) }
}

#[inline(always)]
fn split(a: f64) -> (f64, f64) {
    let scaled = SPLITTER * a;
    let high = scaled - (scaled - a);
    (high, a - high)
}

/// `a b` and its rounding error, exactly (numbers below 1e300).
#[inline(always)]
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    (product, ((ah * bh - product) + ah * bl + al * bh) + al * bl)
}

impl DoubleDouble {
    /// Zero.
    pub const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    /// One.
    pub const ONE: Self = Self { hi: 1.0, lo: 0.0 };
    /// `ln 2`.
    const LN_2: Self = Self { hi: std::f64::consts::LN_2, lo: 2.319_046_813_846_299_6e-17 };

    /// Square root; NaN of a negative number.
    pub fn sqrt(self) -> Self {
        let root = self.hi.sqrt();
        if root == 0.0 {
            return Self::ZERO;
        }
        // One step of Newton doubles the digits.
        let root = Self::from(root);
        root + (self - root * root) / (root * 2.0)
    }

    /// Exponential.
    pub fn exp(self) -> Self {
        let k = (self.hi / std::f64::consts::LN_2).round();
        // 2^-9 of the rest has a series of eleven terms; then it is squared nine times.
        const HALVINGS: i32 = 9;
        let x = (self - Self::LN_2 * k) * 0.5f64.powi(HALVINGS);
        let mut term = x;
        let mut sum = x;
        for n in 2..12 {
            term = term * x / Self::from(f64::from(n));
            sum += term;
        }
        // exp(2x) - 1 = s (2 + s): the one is added last, so that no digit of a small sum is lost.
        for _ in 0..HALVINGS {
            sum = sum * (sum + Self::from(2.0));
        }
        (sum + Self::ONE) * 2f64.powi(k as i32)
    }

    /// Natural logarithm; NaN of a negative number.
    pub fn ln(self) -> Self {
        let start = Self::from(self.hi.ln());
        if !start.hi.is_finite() {
            return start;
        }
        // Newton on exp: y + x exp(-y) - 1.
        start + (self * (-start).exp() - Self::ONE)
    }
}

impl From<f64> for DoubleDouble {
    #[inline(always)]
    fn from(value: f64) -> Self {
        Self { hi: value, lo: 0.0 }
    }
}

impl From<DoubleDouble> for f64 {
    fn from(value: DoubleDouble) -> Self {
        value.hi
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (high, high_error) = two_sum(self.hi, other.hi);
        let (low, low_error) = two_sum(self.lo, other.lo);
        let first = quick_two_sum(high, high_error + low);
        quick_two_sum(first.hi, low_error + first.lo)
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (product, error) = two_product(self.hi, other.hi);
        quick_two_sum(product, error + (self.hi * other.lo + self.lo * other.hi))
    }
}

impl Mul<f64> for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        let (product, error) = two_product(self.hi, other);
        quick_two_sum(product, error + self.lo * other)
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        // Three digits in base 2^53, the last for the rounding of the others.
        let first = self.hi / other.hi;
        let rest = self - other * first;
        let second = rest.hi / other.hi;
        let third = (rest - other * second).hi / other.hi;
        quick_two_sum(first, second) + Self::from(third)
    }
}

impl AddAssign for DoubleDouble {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for DoubleDouble {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl PartialOrd for DoubleDouble {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        (*self - *other).hi.partial_cmp(&0.0)
    }
}

impl Number for DoubleDouble {
    #[inline(always)]
    fn like(self, value: f64) -> Self {
        Self::from(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Some thirty digits.
    const CLOSE: f64 = 1e-30;

    fn relative(a: DoubleDouble, b: DoubleDouble) -> f64 {
        ((a - b).hi / b.hi).abs()
    }

    #[test]
    fn sums_and_products_keep_what_a_double_drops() {
        let tiny = DoubleDouble::from(1e-25);
        assert_eq!((DoubleDouble::ONE + tiny - DoubleDouble::ONE).hi, 1e-25);
        // (1 + e)(1 - e) = 1 - e^2.
        let e = DoubleDouble::from(2f64.powi(-40));
        let product = (DoubleDouble::ONE + e) * (DoubleDouble::ONE - e);
        assert_eq!((DoubleDouble::ONE - product).hi, 2f64.powi(-80));
    }

    #[test]
    fn quotients_and_roots_go_back() {
        for value in [3.0, 7.0e-9, 1.0 / 3.0, 5510.09, 1.4e24] {
            let value = DoubleDouble::from(value);
            let third = value / DoubleDouble::from(3.0);
            assert!(relative(third * 3.0, value) < CLOSE, "{value:?} / 3");
            let root = value.sqrt();
            assert!(relative(root * root, value) < CLOSE, "root of {value:?}");
        }
        assert!(DoubleDouble::from(-1.0).sqrt().hi.is_nan());
        assert_eq!(DoubleDouble::ZERO.sqrt(), DoubleDouble::ZERO);
    }

    /// e and ln 10 to 32 digits, as two doubles each.
    #[test]
    fn exponentials_and_logarithms_have_thirty_digits() {
        let e = DoubleDouble { hi: std::f64::consts::E, lo: 1.445_646_891_729_250_2e-16 };
        assert!(relative(DoubleDouble::ONE.exp(), e) < CLOSE);
        let ln_10 = DoubleDouble { hi: std::f64::consts::LN_10, lo: -2.170_756_223_382_249_4e-16 };
        assert!(relative(DoubleDouble::from(10.0).ln(), ln_10) < CLOSE);
        for x in [-40.0, -0.7, 1e-12, 0.3, 25.0] {
            let back = DoubleDouble::from(x).exp().ln();
            assert!(((back - DoubleDouble::from(x)).hi / x.abs().max(1.0)).abs() < CLOSE, "{x}");
        }
    }
}
