//! Smoothing splines: a smooth curve through noisy values at some times, with its derivative and the standard
//! deviation of that.
//!
//! The curve is a straight line and an integrated Wiener process, the values have independent errors of variance `s^2`:
//!
//! ```text
//! x = H b + f + e        H = (1, t)        cov f = s^2 r K        cov e = s^2 I
//! K(t, u) = m^2 (3 M - m) / 6              m, M the smaller and the larger of t and u
//! ```
//!
//! The best prediction of `H b + f` is the cubic smoothing spline; `r` is the one ratio of all curves of a set, at its
//! maximum of the restricted likelihood. Source: Wahba (1978); Harville (1977).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix2, Vector2};

/// Ratios that are tried, by powers of ten: from curves that are straight lines to curves through every value.
const EXPONENTS: std::ops::RangeInclusive<i32> = -8..=8;
/// Ratios for each power of ten.
const PER_DECADE: i32 = 2;

/// Values at ascending times.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Times, ascending, each once.
    pub times: Vec<f64>,
    /// Values of several coordinates, each at every time.
    pub values: Vec<Vec<f64>>,
}

/// Derivatives of a curve at its times.
#[derive(Debug, Clone, PartialEq)]
pub struct Slopes {
    /// Of each coordinate at every time.
    pub values: Vec<Vec<f64>>,
    /// Standard deviation at every time.
    pub sigmas: Vec<f64>,
    /// Standard deviation of the mean of the derivatives. Errors of one curve are alike: those of a straight line are
    /// all the same.
    pub mean_sigma: f64,
    /// Standard deviation of a value of the curve.
    pub noise: f64,
}

/// Derivatives of the smoothing splines of some curves of at least three times each, which have one ratio and one
/// variance of errors.
pub fn slopes(curves: &[Curve]) -> Vec<Slopes> {
    let scale = time_scale(curves);
    let exponents = (PER_DECADE * EXPONENTS.start()..=PER_DECADE * EXPONENTS.end()).map(f64::from);
    let ratios = std::iter::once(0.0).chain(exponents.map(|e| 10f64.powf(e / f64::from(PER_DECADE))));
    let tried = ratios.filter_map(|ratio| Some((criterion(curves, ratio, scale)?, ratio)));
    let best = tried.min_by(|(a, _), (b, _)| a.total_cmp(b)).map_or(0.0, |(_, ratio)| ratio);
    let fits: Option<Vec<Fit>> = curves.iter().map(|curve| Fit::new(curve, best, scale)).collect();
    let Some(fits) = fits else { return curves.iter().map(Slopes::unknown).collect() };
    let variance = variance(curves, &fits);
    fits.iter().zip(curves).map(|(fit, curve)| fit.slopes(curve, variance)).collect()
}

impl Slopes {
    fn unknown(curve: &Curve) -> Self {
        let n = curve.times.len();
        Self {
            values: vec![vec![f64::NAN; n]; curve.values.len()],
            sigmas: vec![f64::NAN; n],
            mean_sigma: f64::NAN,
            noise: f64::NAN,
        }
    }
}

/// A typical step of time: ratios count from it, so that they do not depend on the unit.
fn time_scale(curves: &[Curve]) -> f64 {
    let mut steps: Vec<f64> = curves.iter().flat_map(|c| c.times.windows(2).map(|pair| pair[1] - pair[0])).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1.0)
}

/// -2 ln of the restricted likelihood at the likeliest variance, but for a constant.
fn criterion(curves: &[Curve], ratio: f64, scale: f64) -> Option<f64> {
    let fits: Vec<Fit> = curves.iter().map(|curve| Fit::new(curve, ratio, scale)).collect::<Option<_>>()?;
    let redundancy = redundancy(curves);
    let determinants: f64 = fits.iter().zip(curves).map(|(f, c)| c.values.len() as f64 * f.ln_determinants).sum();
    Some(redundancy * variance(curves, &fits).max(f64::MIN_POSITIVE).ln() + determinants)
}

fn redundancy(curves: &[Curve]) -> f64 {
    curves.iter().map(|curve| curve.values.len() as f64 * (curve.times.len() as f64 - 2.0)).sum()
}

fn variance(curves: &[Curve], fits: &[Fit]) -> f64 {
    let squares: f64 = fits.iter().zip(curves).map(|(fit, curve)| fit.squares(curve)).sum();
    squares / redundancy(curves).max(1.0)
}

/// A curve's matrices at one ratio.
struct Fit {
    times: Vec<f64>,
    ratio: f64,
    scale: f64,
    h: DMatrix<f64>,
    v: Cholesky<f64, Dyn>,
    /// `V^-1 H`.
    v_h: DMatrix<f64>,
    /// `(H' V^-1 H)^-1`.
    covariance: Matrix2<f64>,
    /// `ln|V| + ln|H' V^-1 H|`.
    ln_determinants: f64,
}

impl Fit {
    fn new(curve: &Curve, ratio: f64, scale: f64) -> Option<Self> {
        let first = *curve.times.first()?;
        let times: Vec<f64> = curve.times.iter().map(|t| (t - first) / scale).collect();
        let n = times.len();
        let kernel = |a: f64, b: f64| {
            let (m, large) = (a.min(b), a.max(b));
            m * m * (3.0 * large - m) / 6.0
        };
        let v = DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) + ratio * kernel(times[i], times[j]));
        let v = v.cholesky()?;
        let h = DMatrix::from_fn(n, 2, |i, k| if k == 0 { 1.0 } else { times[i] });
        let v_h = v.solve(&h);
        let normal = h.transpose() * &v_h;
        let normal = Matrix2::new(normal[(0, 0)], normal[(0, 1)], normal[(1, 0)], normal[(1, 1)]);
        let covariance = normal.try_inverse()?;
        let ln_v: f64 = 2.0 * (0..n).map(|i| v.l_dirty()[(i, i)].ln()).sum::<f64>();
        let ln_determinants = ln_v + normal.determinant().ln();
        ln_determinants.is_finite().then_some(Self { times, ratio, scale, h, v, v_h, covariance, ln_determinants })
    }

    /// The line and `V^-1` times what it leaves.
    fn solved(&self, values: &[f64]) -> (Vector2<f64>, DVector<f64>) {
        let y = DVector::from_column_slice(values);
        let right = self.v_h.transpose() * &y;
        let line = self.covariance * Vector2::new(right[0], right[1]);
        let left = y - &self.h * DVector::from_column_slice(line.as_slice());
        (line, self.v.solve(&left))
    }

    /// `v' V^-1 v` over all coordinates.
    fn squares(&self, curve: &Curve) -> f64 {
        let of = |values: &Vec<f64>| {
            let (line, weighed) = self.solved(values);
            let left = DVector::from_column_slice(values) - &self.h * DVector::from_column_slice(line.as_slice());
            left.dot(&weighed)
        };
        curve.values.iter().map(of).sum()
    }

    fn slopes(&self, curve: &Curve, variance: f64) -> Slopes {
        let n = self.times.len();
        // Covariance of the derivative at `t` and the curve at `u`.
        let slope_kernel = |t: f64, u: f64| if t < u { t * u - 0.5 * t * t } else { 0.5 * u * u };
        let crosses: Vec<DVector<f64>> = (0..n)
            .map(|i| DVector::from_fn(n, |j, _| self.ratio * slope_kernel(self.times[i], self.times[j])))
            .collect();
        let of = |values: &Vec<f64>| {
            let (line, weighed) = self.solved(values);
            crosses.iter().map(|cross| (line[1] + cross.dot(&weighed)) / self.scale).collect()
        };
        let weighed: Vec<DVector<f64>> = crosses.iter().map(|cross| self.v.solve(cross)).collect();
        let beside_line = |cross: &DVector<f64>| {
            let of_line = self.v_h.transpose() * cross;
            Vector2::new(-of_line[0], 1.0 - of_line[1])
        };
        let beside_line: Vec<Vector2<f64>> = crosses.iter().map(beside_line).collect();
        let covariance = |i: usize, j: usize| {
            let of_process = self.ratio * self.times[i].min(self.times[j]) - crosses[i].dot(&weighed[j]);
            of_process + (beside_line[i].transpose() * self.covariance * beside_line[j])[0]
        };
        let unit = variance.sqrt() / self.scale;
        let sum: f64 = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| covariance(i, j)).sum();
        Slopes {
            values: curve.values.iter().map(of).collect(),
            sigmas: (0..n).map(|i| unit * covariance(i, i).max(0.0).sqrt()).collect(),
            mean_sigma: unit * sum.max(0.0).sqrt() / n as f64,
            noise: variance.sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    fn times(n: usize) -> Vec<f64> {
        (0..n).map(|k| 100.0 + 3.0 * k as f64).collect()
    }

    #[test]
    fn an_exact_line_has_its_slope() {
        let times = times(5);
        let values = vec![times.iter().map(|t| 4.0 - 2.5 * t).collect()];
        let slopes = &slopes(&[Curve { times, values }])[0];
        slopes.values[0].iter().for_each(|slope| assert_relative_eq!(*slope, -2.5, epsilon = 1e-9));
    }

    #[test]
    fn a_noisy_line_is_smoothed_and_its_sigma_holds() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let noise = Normal::new(0.0, 0.5).expect("a distribution");
        let mut within = 0;
        for _ in 0..100 {
            let times = times(12);
            let values = vec![times.iter().map(|t| 5.0 * t + noise.sample(&mut random)).collect()];
            let slopes = &slopes(&[Curve { times, values }])[0];
            within += usize::from((slopes.values[0][5] - 5.0).abs() < 2.0 * slopes.sigmas[5]);
            assert!((slopes.values[0][5] - 5.0).abs() < 0.3);
        }
        assert!(within > 80, "{within} of 100 within two standard deviations");
    }

    #[test]
    fn the_mean_slope_varies_as_stated() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let noise = Normal::new(0.0, 0.5).expect("a distribution");
        let times = times(12);
        let lines = |_| Curve {
            times: times.clone(),
            values: vec![times.iter().map(|t| 5.0 * t + noise.sample(&mut random)).collect()],
        };
        let curves: Vec<Curve> = (0..200).map(lines).collect();
        let found = slopes(&curves);
        let mean = |of: &Slopes| of.values[0].iter().sum::<f64>() / 12.0;
        let squares: f64 = found.iter().map(|of| ((mean(of) - 5.0) / of.mean_sigma).powi(2)).sum();
        // Of 200: within four standard deviations of chi-square.
        assert!((squares - 200.0).abs() < 4.0 * 400f64.sqrt(), "{squares}");
        assert_relative_eq!(found[0].noise, 0.5, max_relative = 0.1);
        // That of the slope of a straight line through n values, a step apart: s sqrt(12 / (n (n^2 - 1))) / step.
        let of_line = 0.5 * (12.0f64 / (12.0 * 143.0)).sqrt() / 3.0;
        assert_relative_eq!(found[0].mean_sigma, of_line, max_relative = 0.1);
    }

    #[test]
    fn a_curve_with_small_errors_is_followed() {
        let times = times(40);
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let noise = Normal::new(0.0, 0.01).expect("a distribution");
        let values = vec![times.iter().map(|t| 50.0 * (t / 20.0).sin() + noise.sample(&mut random)).collect()];
        let of = &slopes(&[Curve { times: times.clone(), values }])[0];
        for (t, slope) in times.iter().zip(&of.values[0]).skip(2).take(36) {
            assert!((slope - 2.5 * (t / 20.0).cos()).abs() < 0.05, "{slope} at {t}");
        }
    }
}
