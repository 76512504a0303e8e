//! Probabilities of test statistics, accurate far into the upper tail, and the summary numbers of a sample.
//!
//! A test with thousands of degrees of freedom easily has a p-value below the smallest `f64`: every upper tail has a
//! twin that returns its natural logarithm. Arguments outside a distribution's domain give NaN, never a guess.
//!
//! Sources: Abramowitz and Stegun, 6.5.31 and 26.5.8 (continued fractions), evaluated by the modified Lentz method
//! (Thompson and Barnett 1986); Stephens (1970) for the Kolmogorov-Smirnov test of a finite sample.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};
use statrs::function::gamma::ln_gamma;
use std::f64::consts::{LN_2, PI};

/// Below this upper tail the logarithm is taken from the continued fraction: well above the smallest normal `f64`
/// (2e-308), so that no digit is lost to underflow.
const TAIL_FLOOR: f64 = 1e-280;

/// A continued fraction has converged when its factor differs from one by less than this: a few roundings.
const CONVERGED: f64 = 4.0 * f64::EPSILON;

/// Bound on the terms of a continued fraction; about the square root of the largest parameter is needed.
const MAX_TERMS: usize = 200_000;

/// Replaces a vanishing denominator in the Lentz method.
const TINY: f64 = 1e-300;

/// Mean; NaN for an empty sample.
pub fn mean(sample: &[f64]) -> f64 {
    sample.iter().sum::<f64>() / sample.len() as f64
}

/// Standard deviation with `n - 1`; NaN for fewer than two values.
pub fn std(sample: &[f64]) -> f64 {
    if sample.len() < 2 {
        return f64::NAN;
    }
    let centre = mean(sample);
    (sample.iter().map(|x| (x - centre).powi(2)).sum::<f64>() / (sample.len() - 1) as f64).sqrt()
}

/// Root of the mean square; NaN for an empty sample.
pub fn rms(sample: &[f64]) -> f64 {
    (sample.iter().map(|x| x * x).sum::<f64>() / sample.len() as f64).sqrt()
}

/// Median; NaN for an empty sample or one that has a NaN.
pub fn median(sample: &[f64]) -> f64 {
    if sample.is_empty() || sample.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let mut parted = sample.to_vec();
    let half = parted.len() / 2;
    let (below, upper, _) = parted.select_nth_unstable_by(half, f64::total_cmp);
    if sample.len() % 2 == 1 {
        return *upper;
    }
    let lower = below.iter().copied().max_by(f64::total_cmp).unwrap_or(*upper);
    0.5 * (lower + *upper)
}

/// Median of the absolute deviations from the median, unscaled: 1.4826 times it estimates the standard deviation of a
/// normal sample.
pub fn mad(sample: &[f64]) -> f64 {
    let centre = median(sample);
    median(&sample.iter().map(|x| (x - centre).abs()).collect::<Vec<_>>())
}

/// Upper tail of the standard normal distribution, `P(Z > z)`.
pub fn normal_sf(z: f64) -> f64 {
    // Z^2 is chi-square distributed with one degree of freedom. (The erfc of statrs is good to ten digits only.)
    let outside = 0.5 * chi_square_sf(z * z, 1.0);
    if z > 0.0 { outside } else { 1.0 - outside }
}

/// Natural logarithm of [`normal_sf`].
pub fn normal_ln_sf(z: f64) -> f64 {
    if z > 0.0 { chi_square_ln_sf(z * z, 1.0) - LN_2 } else { normal_sf(z).ln() }
}

/// `P(|Z| > |z|)`.
pub fn normal_two_sided(z: f64) -> f64 {
    chi_square_sf(z * z, 1.0)
}

/// The `z` with `P(Z <= z) = p`; NaN outside `0 <= p <= 1`.
pub fn normal_quantile(p: f64) -> f64 {
    if !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    Normal::standard().inverse_cdf(p)
}

/// Upper tail of chi-square with `dof` degrees of freedom, `P(X > x)`.
pub fn chi_square_sf(x: f64, dof: f64) -> f64 {
    match ChiSquared::new(dof) {
        Ok(distribution) if !x.is_nan() => distribution.sf(x),
        _ => f64::NAN,
    }
}

/// Natural logarithm of [`chi_square_sf`].
pub fn chi_square_ln_sf(x: f64, dof: f64) -> f64 {
    let p = chi_square_sf(x, dof);
    if p.is_nan() || p > TAIL_FLOOR || x == f64::INFINITY {
        return p.ln();
    }
    let (a, half) = (0.5 * dof, 0.5 * x);
    // Q(a, x) = exp(-x) x^a / Gamma(a) / (x + 1 - a - 1 (1 - a) / (x + 3 - a - ...)).
    let fraction = continued_fraction(half + 1.0 - a, |n| {
        let n = n as f64;
        (n * (a - n), half + 2.0 * n + 1.0 - a)
    });
    a * half.ln() - half - ln_gamma(a) - fraction.ln()
}

/// The `x` with `P(X <= x) = p`; NaN outside `0 <= p <= 1`.
pub fn chi_square_quantile(p: f64, dof: f64) -> f64 {
    match ChiSquared::new(dof) {
        Ok(distribution) if (0.0..=1.0).contains(&p) => distribution.inverse_cdf(p),
        _ => f64::NAN,
    }
}

/// Upper tail of F with `dof1` and `dof2` degrees of freedom, `P(X > x)`.
pub fn f_sf(x: f64, dof1: f64, dof2: f64) -> f64 {
    f_ln_sf(x, dof1, dof2).exp()
}

/// The `x` with `P(X <= x) = p` of F with `dof1` and `dof2` degrees of freedom; NaN outside `0 <= p < 1`.
pub fn f_quantile(p: f64, dof1: f64, dof2: f64) -> f64 {
    if !(0.0..1.0).contains(&p) || f_ln_sf(1.0, dof1, dof2).is_nan() {
        return f64::NAN;
    }
    let ln_tail = (-p).ln_1p();
    let below = |x: &f64| f_ln_sf(*x, dof1, dof2) > ln_tail;
    let mut high = 1.0;
    while below(&high) {
        high *= 2.0;
    }
    let mut low = 0.0;
    // Until no number lies between the two.
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if below(&middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// Natural logarithm of [`f_sf`].
pub fn f_ln_sf(x: f64, dof1: f64, dof2: f64) -> f64 {
    let valid = |dof: f64| dof.is_finite() && dof > 0.0;
    if x.is_nan() || !valid(dof1) || !valid(dof2) {
        return f64::NAN;
    }
    if x <= 0.0 {
        return 0.0;
    }
    if x == f64::INFINITY {
        return f64::NEG_INFINITY;
    }
    // P(X > x) = I_z(dof2 / 2, dof1 / 2) with z = dof2 / (dof2 + dof1 x); 1 - z is formed without cancellation.
    let ratio = dof1 * x / dof2;
    ln_beta_regularised(0.5 * dof2, 0.5 * dof1, 1.0 / (1.0 + ratio), ratio / (1.0 + ratio))
}

/// Logarithm of the regularised incomplete beta function `I_x(a, b)`, with `y = 1 - x` given to full precision.
fn ln_beta_regularised(a: f64, b: f64, x: f64, y: f64) -> f64 {
    if x == 0.0 {
        return f64::NEG_INFINITY;
    }
    if y == 0.0 {
        return 0.0;
    }
    // The fraction converges fast on the smaller side of the mean; the other side is the complement.
    if x > (a + 1.0) / (a + b + 2.0) {
        return (-ln_beta_regularised(b, a, y, x).exp()).ln_1p();
    }
    // The smaller of x and y has the smaller rounding error; the other's logarithm follows from it.
    let (ln_x, ln_y) = if x < y { (x.ln(), (-x).ln_1p()) } else { ((-y).ln_1p(), y.ln()) };
    let ln_front = a * ln_x + b * ln_y + ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) - a.ln();
    let fraction = continued_fraction(1.0, |n| {
        let m = (n / 2) as f64;
        let term = if n % 2 == 0 {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        (term, 1.0)
    });
    ln_front - fraction.ln()
}

/// `b0 + a1 / (b1 + a2 / (b2 + ...))` with `term(n) = (a_n, b_n)`, by the modified Lentz method; NaN if it does not
/// converge.
fn continued_fraction(b0: f64, term: impl Fn(usize) -> (f64, f64)) -> f64 {
    let away_from_zero = |x: f64| if x.abs() < TINY { TINY } else { x };
    let mut value = away_from_zero(b0);
    let (mut c, mut d) = (value, 0.0);
    for n in 1..MAX_TERMS {
        let (a, b) = term(n);
        d = 1.0 / away_from_zero(b + a * d);
        c = away_from_zero(b + a / c);
        value *= c * d;
        if (c * d - 1.0).abs() < CONVERGED {
            return value;
        }
    }
    f64::NAN
}

/// Kolmogorov-Smirnov test of a sample against the distribution function `cdf`.
///
/// Returns the largest distance `D` and its p-value (Stephens' approximation for finite samples: relative error of p a
/// few percent from n = 5 on). NaN for an empty sample.
pub fn kolmogorov_smirnov(sample: &[f64], cdf: impl Fn(f64) -> f64) -> (f64, f64) {
    if sample.is_empty() {
        return (f64::NAN, f64::NAN);
    }
    let mut sorted = sample.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let mut distance: f64 = 0.0;
    for (i, &x) in sorted.iter().enumerate() {
        let p = cdf(x);
        if p.is_nan() {
            return (f64::NAN, f64::NAN);
        }
        distance = distance.max((i + 1) as f64 / n - p).max(p - i as f64 / n);
    }
    (distance, kolmogorov_sf((n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance))
}

/// Upper tail of Kolmogorov's limiting distribution.
pub fn kolmogorov_sf(lambda: f64) -> f64 {
    if lambda.is_nan() {
        return f64::NAN;
    }
    if lambda <= 0.0 {
        return 1.0;
    }
    // The two series are each other's theta transform. Either needs at most four terms on its side of one.
    if lambda < 1.0 {
        let t = -PI * PI / (8.0 * lambda * lambda);
        let sum: f64 = (0..4).map(|j| (t * f64::from((2 * j + 1) * (2 * j + 1))).exp()).sum();
        1.0 - (2.0 * PI).sqrt() / lambda * sum
    } else {
        let t = -2.0 * lambda * lambda;
        2.0 * (1..5).map(|j: i32| f64::from(1 - 2 * ((j + 1) % 2)) * (t * f64::from(j * j)).exp()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The logarithm of the gamma function and exponentials of large arguments lose three digits.
    const RELATIVE: f64 = 1e-12;

    // Reference values: mpmath with 40 digits, `gammainc(k/2, x/2, inf, regularized=True)`, `betainc(...)`, `erfc`.

    #[test]
    fn chi_square_tails() {
        for (x, dof, p, ln_p) in [
            (3.0, 1.0, 0.0832645166635504, -2.48573279098608),
            (50.0, 3.0, 7.98917924495147e-11, -23.2503479912172),
            (300.0, 10.0, 1.55467475438032e-58, -133.108669031071),
            (900.0, 1000.0, 0.98928276190871, -0.0107750813385705),
            (1500.0, 2.0, 0.0, -750.0),
            (5000.0, 40.0, 0.0, -2390.675384038),
            (120000.0, 100000.0, 0.0, -888.642150894248),
            (1000000.0, 10000.0, 0.0, -471983.92174374586),
        ] {
            // Cancellation among terms as large as dof ln(dof): 1e6 for the largest here.
            assert_relative_eq!(chi_square_ln_sf(x, dof), ln_p, max_relative = 1e-11);
            if p > 0.0 {
                assert_relative_eq!(chi_square_sf(x, dof), p, max_relative = 1e-11);
            }
        }
        assert_relative_eq!(chi_square_sf(chi_square_quantile(0.95, 7.0), 7.0), 0.05, max_relative = 1e-9);
    }

    #[test]
    fn f_tails() {
        for (x, dof1, dof2, p, ln_p) in [
            (2.5, 3.0, 7.0, 0.143509456278939, -1.94135434853939),
            (40.0, 1.0, 100.0, 7.1848149846428e-09, -18.7512960679707),
            (1e6, 2.0, 10.0, 3.12492187617186e-27, -61.0303882275884),
            (900.0, 1.0, 5000.0, 5.6916581178617e-182, -417.331485310115),
            (30.0, 5.0, 4990.0, 3.85940760043448e-30, -67.7270390895126),
            (0.8, 300.0, 500.0, 0.983359323263086, -0.0167806882286228),
        ] {
            // ln Gamma(2500) is 1.7e4: eleven digits are left after the cancellation.
            assert_relative_eq!(f_sf(x, dof1, dof2), p, max_relative = 1e-10);
            assert_relative_eq!(f_ln_sf(x, dof1, dof2), ln_p, max_relative = 1e-10);
        }
        for (p, dof1, dof2) in [(0.999, 1.0, 50.0), (0.2, 3.0, 7.0), (1.0 - 1e-12, 1.0, 1e5)] {
            assert_relative_eq!(f_ln_sf(f_quantile(p, dof1, dof2), dof1, dof2), (1.0f64 - p).ln(), max_relative = 1e-9);
        }
        // The square of Student's t; of many degrees of freedom that of a normal.
        let t = f_quantile(0.999, 1.0, 1e9).sqrt();
        assert_relative_eq!(t, normal_quantile(0.9995), max_relative = 1e-6);
    }

    #[test]
    fn normal_tails() {
        for (z, p, ln_p) in [
            (1.0, 0.158655253931457, -1.84102164500926),
            (5.0, 2.86651571879194e-07, -15.0649983939887),
            (10.0, 7.61985302416053e-24, -53.2312851505125),
            (37.0, 5.72557122252458e-300, -689.030585576891),
            (60.0, 0.0, -1805.01356068057),
        ] {
            assert_relative_eq!(normal_ln_sf(z), ln_p, max_relative = RELATIVE);
            if p > 0.0 {
                assert_relative_eq!(normal_sf(z), p, max_relative = 1e-11);
                assert_relative_eq!(normal_two_sided(-z), 2.0 * p, max_relative = 1e-11);
            }
        }
        assert_relative_eq!(normal_sf(-1.0), 1.0 - 0.158655253931457, max_relative = RELATIVE);
        assert_relative_eq!(normal_ln_sf(-1.0), (1.0f64 - 0.158655253931457).ln(), max_relative = 1e-11);
        assert_relative_eq!(normal_quantile(0.975), 1.95996398454005, max_relative = 1e-10);
    }

    #[test]
    fn outside_the_domain_is_nan() {
        assert!(chi_square_sf(1.0, 0.0).is_nan());
        assert!(chi_square_ln_sf(f64::NAN, 2.0).is_nan());
        assert!(f_sf(1.0, -1.0, 3.0).is_nan());
        assert!(
            normal_quantile(1.5).is_nan() && f_quantile(1.0, 1.0, 2.0).is_nan() && f_quantile(0.5, 0.0, 2.0).is_nan()
        );
        assert!(mean(&[]).is_nan() && rms(&[]).is_nan() && median(&[]).is_nan() && std(&[1.0]).is_nan());
        assert_eq!(chi_square_sf(0.0, 3.0), 1.0);
        assert_eq!(f_sf(0.0, 3.0, 4.0), 1.0);
        assert_eq!(f_sf(f64::INFINITY, 3.0, 4.0), 0.0);
        assert_eq!(chi_square_ln_sf(f64::INFINITY, 3.0), f64::NEG_INFINITY);
    }

    #[test]
    fn kolmogorov_smirnov_against_tables() {
        // Kolmogorov's distribution: lambda 1.3581 at 5 %, 1.6276 at 1 %, 0.8276 at 50 % (Smirnov 1948).
        assert_relative_eq!(kolmogorov_sf(1.3581), 0.05, max_relative = 1e-3);
        assert_relative_eq!(kolmogorov_sf(1.6276), 0.01, max_relative = 1e-3);
        assert_relative_eq!(kolmogorov_sf(0.8276), 0.5, max_relative = 1e-3);
        // Both series at the switch.
        assert_relative_eq!(kolmogorov_sf(1.0 - 1e-12), kolmogorov_sf(1.0), max_relative = 1e-10);
        // One value in the middle of a uniform distribution: D = 1/2.
        assert_eq!(kolmogorov_smirnov(&[0.5], |x| x).0, 0.5);
        // Critical D for n = 20 at 5 %: 0.294 (Miller 1956).
        let sample: Vec<f64> = (0..20).map(|i| (f64::from(i) + 1.0) / 20.0 * (1.0 - 0.294)).collect();
        let (distance, p) = kolmogorov_smirnov(&sample, |x| x);
        assert_relative_eq!(distance, 0.294, epsilon = 1e-12);
        assert_relative_eq!(p, 0.05, max_relative = 0.03);
    }

    #[test]
    fn summaries_by_hand() {
        let sample = [3.0, 1.0, 2.0, 6.0];
        assert_eq!(mean(&sample), 3.0);
        assert_relative_eq!(std(&sample), (14.0f64 / 3.0).sqrt());
        assert_relative_eq!(rms(&sample), 12.5f64.sqrt());
        assert_eq!(median(&sample), 2.5);
        assert_eq!(mad(&sample), 1.0);
        assert_eq!(median(&[2.0, 9.0, 4.0]), 4.0);
        assert!(median(&[1.0, f64::NAN]).is_nan());
    }
}
