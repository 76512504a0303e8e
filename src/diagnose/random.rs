//! Score test of a random effect `a_i ~ N(0, s^2)` as a variance component: is the sum of squared scores larger than chance?
//!
//! With `s` the scores of the per-image values and `M` their projected normal matrix, `Q = s's` has under the null the distribution of
//! `sum l_k chi2_1` with the eigenvalues `l` of `M`; `E Q = tr M + s^2 tr M^2`.
//! Source: Lin, Variance component testing in generalised linear models with random effects (1997); tail by Liu, Tang and Zhang (2009).

use super::candidate::Candidate;
use super::score::{At, Estimate, Score};
use crate::effects::Role;
use crate::math::statistics::chi_square_ln_sf;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::collections::BTreeMap;

/// Tests the random effect with these columns of the profile.
pub(super) fn score(at: &At<'_>, candidate: Candidate, columns: Vec<usize>) -> Score {
    let profile = at.profile;
    let n = columns.len();
    let factor = profile.chi_square / at.redundancy;
    // Raw units: every image's value counts alike.
    let information = DMatrix::from_fn(n, n, |i, j| {
        profile.information[(columns[i], columns[j])] / (profile.unit[columns[i]] * profile.unit[columns[j]])
    });
    let scores = DVector::from_fn(n, |i, _| profile.score[columns[i]] / profile.unit[columns[i]]);
    let q = scores.norm_squared() / factor;
    let eigenvalues: Vec<f64> =
        SymmetricEigen::new(information.clone()).eigenvalues.iter().map(|l| l.max(0.0)).collect();
    let moment = |k: i32| eigenvalues.iter().map(|l| l.powi(k)).sum::<f64>();
    let c = [moment(1), moment(2), moment(3), moment(4)];
    let ln_p = if c[1] > 0.0 { ln_tail(q, c) } else { 0.0 };
    let variance = (factor * (q - c[0]) / c[1]).max(0.0);
    let deviation = variance.sqrt();

    // Values and drop of a refit with this standard deviation.
    let mut values = DVector::zeros(n);
    let mut drop = 0.0;
    if variance > 0.0 {
        let mut damped = information.clone();
        for i in 0..n {
            damped[(i, i)] += factor / variance;
        }
        if let Some(solved) = damped.cholesky().map(|c| c.solve(&scores)) {
            drop = scores.dot(&solved);
            for i in 0..n {
                values[i] = solved[i] / profile.unit[columns[i]];
            }
        }
    }
    // Spread of Q under the alternative, by its moments there.
    let alternative: Vec<f64> = eigenvalues.iter().map(|l| l + variance / factor * l * l).collect();
    let spread = (2.0 * alternative.iter().map(|l| l * l).sum::<f64>()).sqrt() * factor / c[1];
    let sigma = if deviation > 0.0 { spread / (2.0 * deviation) } else { spread.sqrt() };
    let mut estimates = BTreeMap::new();
    if let Some(term) = candidate.term() {
        for parameter in &term.effect.descriptor().parameters {
            if let Role::Random(name) = parameter.role {
                let unit = parameter.unit.to_string();
                estimates.insert(name.to_string(), Estimate { value: deviation, sigma, unit });
            }
        }
    }
    let level = (at.base.significance / at.tests).ln();
    let detectable = (c[1] > 0.0).then(|| smallest_deviation(c, level) * factor.sqrt());
    let statistic = if c[1] > 0.0 { (q - c[0]) / (2.0 * c[1]).sqrt() } else { 0.0 };
    Score::of_random(candidate, columns, values, drop, statistic, ln_p, estimates, detectable)
}

/// Logarithm of `P(sum l_k chi2_1 > q)` from the power sums `c` of `l`, by a (noncentral, here central) chi-square of the same skewness.
fn ln_tail(q: f64, c: [f64; 4]) -> f64 {
    let skewness = c[2] / c[1].powf(1.5);
    let dof = 1.0 / (skewness * skewness);
    let standard = (q - c[0]) / (2.0 * c[1]).sqrt();
    chi_square_ln_sf((standard * (2.0 * dof).sqrt() + dof).max(0.0), dof)
}

/// Standard deviation (unit weight) at which the mean of `Q` reaches the threshold of the level plus 0.84 of its own spread (80 % power).
fn smallest_deviation(c: [f64; 4], ln_level: f64) -> f64 {
    let (mut low, mut high) = (c[0], c[0] + 100.0 * (2.0 * c[1]).sqrt());
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if ln_tail(middle, c) > ln_level { low = middle } else { high = middle }
    }
    let spread = (2.0 * c[1]).sqrt();
    ((high + 0.84 * spread - c[0]) / c[1]).max(0.0).sqrt()
}
