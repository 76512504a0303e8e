//! Outcomes by key, and the few figures that are computed from several of them.

use super::case::Case;
use super::outcome::{Adjusted, Outcome};
use anyhow::{Context, Result};
use std::collections::BTreeMap;

/// Outcomes by the key of their case.
#[derive(Debug, Clone, Default)]
pub struct Results {
    outcomes: BTreeMap<String, Outcome>,
}

impl Results {
    /// Of cases and their outcomes, in the same order.
    pub fn new(cases: &[Case], outcomes: Vec<Outcome>) -> Self {
        Self { outcomes: cases.iter().map(|case| case.key.clone()).zip(outcomes).collect() }
    }

    /// The outcome of a case that was run.
    ///
    /// # Errors
    /// It was not.
    pub fn outcome(&self, key: &str) -> Result<&Outcome> {
        self.outcomes.get(key).with_context(|| format!("case `{key}` was not run"))
    }

    /// A case that was run and could be adjusted.
    ///
    /// # Errors
    /// It was not run, or cannot be adjusted; with the reason.
    pub fn adjusted(&self, key: &str) -> Result<&Adjusted> {
        match self.outcome(key)? {
            Outcome::Adjusted(adjusted) => Ok(adjusted),
            Outcome::Impossible { reason, .. } => anyhow::bail!("case `{key}` cannot be adjusted: {reason}"),
        }
    }

    /// Was the case run?
    pub fn has(&self, key: &str) -> bool {
        self.outcomes.contains_key(key)
    }

    /// Every case, in order of its key.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Outcome)> {
        self.outcomes.iter().map(|(key, outcome)| (key.as_str(), outcome))
    }
}

/// How far values are from `y = slope x`: the slope, and the largest departure as a share of the largest value.
pub fn proportionality(points: &[[f64; 2]]) -> (f64, f64) {
    let slope = points.iter().map(|[x, y]| x * y).sum::<f64>() / points.iter().map(|[x, _]| x * x).sum::<f64>();
    let largest = points.iter().map(|[_, y]| y.abs()).fold(0.0, f64::max);
    let departure = points.iter().map(|[x, y]| (y - slope * x).abs()).fold(0.0, f64::max);
    (slope, departure / largest)
}

/// Largest difference between the sizes of the values at `x` and `-x`, as a share of their mean.
pub fn asymmetry(points: &[[f64; 2]]) -> f64 {
    let opposite = |x: f64| points.iter().find(|[other, _]| *other == -x).map(|[_, y]| y.abs());
    let share = |[x, y]: &[f64; 2]| {
        let other = opposite(*x).filter(|_| *x > 0.0)?;
        Some((y.abs() - other).abs() / (0.5 * (y.abs() + other)))
    };
    points.iter().filter_map(share).fold(0.0, f64::max)
}

/// `y = factor x^exponent`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    /// Exponent.
    pub exponent: f64,
    /// Value at 1.
    pub factor: f64,
    /// Largest departure of the fitted points as a share of the law's value.
    pub departure: f64,
}

impl PowerLaw {
    /// Its value.
    pub fn at(&self, x: f64) -> f64 {
        self.factor * x.powf(self.exponent)
    }
}

/// The law by least squares of the logarithms. `None` for fewer than two points or values that are not positive.
pub fn power_law(points: &[[f64; 2]]) -> Option<PowerLaw> {
    if points.len() < 2 || points.iter().flatten().any(|value| value.is_nan() || *value <= 0.0) {
        return None;
    }
    let n = points.len() as f64;
    let logs: Vec<[f64; 2]> = points.iter().map(|[x, y]| [x.ln(), y.ln()]).collect();
    let [mx, my] = [0, 1].map(|k| logs.iter().map(|p| p[k]).sum::<f64>() / n);
    let exponent = logs.iter().map(|[x, y]| (x - mx) * (y - my)).sum::<f64>()
        / logs.iter().map(|[x, _]| (x - mx).powi(2)).sum::<f64>();
    let law = PowerLaw { exponent, factor: (my - exponent * mx).exp(), departure: 0.0 };
    let departure = points.iter().map(|[x, y]| (y / law.at(*x) - 1.0).abs()).fold(0.0, f64::max);
    Some(PowerLaw { departure, ..law })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn laws_of_known_values() {
        let (slope, departure) = proportionality(&[[-1.0, -2.0], [1.0, 2.0], [2.0, 4.0]]);
        assert_relative_eq!(slope, 2.0);
        assert_relative_eq!(departure, 0.0, epsilon = 1e-15);
        assert!(proportionality(&[[1.0, 1.0], [2.0, 4.0]]).1 > 0.1);
        assert_relative_eq!(asymmetry(&[[-5.0, 0.9], [5.0, 1.1], [0.0, 0.0]]), 0.2, epsilon = 1e-12);
        let law = power_law(&[[1.0, 3.0], [2.0, 12.0], [4.0, 48.0]]).unwrap();
        assert_relative_eq!(law.exponent, 2.0, epsilon = 1e-12);
        assert_relative_eq!(law.factor, 3.0, epsilon = 1e-12);
        assert!(law.departure < 1e-12);
        assert_relative_eq!(law.at(8.0), 192.0, epsilon = 1e-9);
        assert!(power_law(&[[1.0, 3.0], [2.0, 12.0], [4.0, 24.0]]).unwrap().departure > 0.2);
        assert!(power_law(&[[1.0, -3.0], [2.0, 12.0]]).is_none());
    }
}
