//! Random values per image, `a_i ~ N(0, t^2)`: is their variance zero, and how large is it?
//!
//! With `M` the information of the values and `l_i` its eigenvalues, the score has in the eigenbasis independent
//! entries `s_i ~ N(0, phi l_i + t^2 l_i^2)`, `phi` the variance factor: their likelihood needs no refit. Sources: Lin
//! (1997), variance component testing in generalised linear models with random effects; Liu, Tang and Zhang (2009) for
//! the tail of a sum of weighted chi-squares.

use super::power::POWER_QUANTILE;
use super::{System, variance_factor};
use crate::math::statistics::chi_square_ln_sf;
use crate::math::variance_component::RandomValues;
use faer::{Mat, Side};

/// Information of a typical value, as multiples of its prior's, between which a variance is seen first.
const SEEN: [f64; 2] = [1e-5, 1e9];
/// Halvings of an interval that it lies in.
const HALVINGS: usize = 60;

/// A variance component at zero and away from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Component {
    /// Standardised sum of squares of the score.
    pub statistic: f64,
    /// Natural logarithm of the p-value of "the variance is zero".
    pub ln_p: f64,
    /// Moment estimate of the standard deviation `t`.
    pub deviation: f64,
    /// Standard deviation of `t`.
    pub sigma: f64,
    /// Variance factor, design effect included.
    pub variance: f64,
}

/// Values of a set in their eigenbasis. `None` where they are not determined.
pub fn values(system: &System, set: &[usize]) -> Option<RandomValues> {
    RandomValues::new(set.len(), |i, j| system.information[(set[i], set[j])], |i| system.score[set[i]])
}

/// Tests that the variance is zero. `design_effect`: factor on the variance of the scores from measurements that err
/// together. `None` where the base leaves nothing.
pub fn test(system: &System, set: &[usize], design_effect: f64) -> Option<Component> {
    let variance = design_effect * variance_factor(system.chi_square, system.redundancy);
    let n = set.len();
    let information = Mat::from_fn(n, n, |i, j| system.information[(set[i], set[j])]);
    let square = &information * &information;
    let inner = |a: &Mat<f64>, b: &Mat<f64>| -> f64 {
        (0..n).map(|j| a.col_as_slice(j).iter().zip(b.col_as_slice(j)).map(|(x, y)| x * y).sum::<f64>()).sum()
    };
    let trace: f64 = (0..n).map(|i| information[(i, i)]).sum();
    // Power sums of the eigenvalues.
    let moments = [trace, inner(&information, &information), inner(&square, &information), inner(&square, &square)];
    if moments[1] <= 0.0 {
        return None;
    }
    let q: f64 = set.iter().map(|c| system.score[*c].powi(2)).sum::<f64>() / variance;
    let spread = (2.0 * moments[1]).sqrt();
    let size = (variance * (q - moments[0]) / moments[1]).max(0.0);
    // Spread of the estimate: of the sum of squares under the alternative.
    let ratio = size / variance;
    let under = (2.0 * (moments[1] + 2.0 * ratio * moments[2] + ratio * ratio * moments[3])).sqrt();
    let of_variance = under * variance / moments[1];
    let deviation = size.sqrt();
    Some(Component {
        statistic: (q - moments[0]) / spread,
        ln_p: ln_tail(q, moments),
        deviation,
        sigma: if deviation > 0.0 { of_variance / (2.0 * deviation) } else { of_variance.sqrt() },
        variance,
    })
}

/// Share of the logarithm of a level at which [`may_vary`] lets a variance pass: its tail is that of two moments,
/// lighter than the exact one.
const SCREENED: f64 = 0.5;

/// Could a test at this level find that the variance is not zero? By two moments of the sum of squares, in O(n^2): for
/// screening before an exact look. Source: Satterthwaite (1946).
pub fn may_vary(system: &System, set: &[usize], design_effect: f64, ln_level: f64) -> bool {
    let variance = design_effect * variance_factor(system.chi_square, system.redundancy);
    let of = |i: usize, j: usize| system.information[(set[i], set[j])];
    let (mut trace, mut squares) = (0.0, 0.0);
    for j in 0..set.len() {
        trace += of(j, j);
        squares += (0..set.len()).map(|i| of(i, j).powi(2)).sum::<f64>();
    }
    if squares <= 0.0 {
        return false;
    }
    let q: f64 = set.iter().map(|c| system.score[*c].powi(2)).sum::<f64>() / variance;
    chi_square_ln_sf(q * trace / squares, trace * trace / squares) < SCREENED * ln_level
}

/// Logarithm of `P(sum l_k chi2_1 > q)` from the power sums of `l`, by a chi-square of the same skewness.
fn ln_tail(q: f64, moments: [f64; 4]) -> f64 {
    let skewness = moments[2] / moments[1].powf(1.5);
    let dof = 1.0 / (skewness * skewness);
    let standard = (q - moments[0]) / (2.0 * moments[1]).sqrt();
    chi_square_ln_sf((standard * (2.0 * dof).sqrt() + dof).max(0.0), dof).min(0.0)
}

/// Smallest standard deviation `t` of values whose likelihood ratio exceeds `price` with a power of 80 %. Where `t^2`
/// is `rho` times the variance factor, twice its logarithm is `sum rho l_i X_i - ln(1 + rho l_i)` with chi-squares
/// `X_i` of one degree of freedom; taken as normal. `None` where the base leaves nothing.
pub fn smallest_seen(system: &System, set: &[usize], price: f64) -> Option<f64> {
    let n = set.len();
    let information = Mat::from_fn(n, n, |i, j| system.information[(set[i], set[j])]);
    let eigenvalues = information.self_adjoint_eigenvalues(Side::Lower).ok()?;
    let mean = eigenvalues.iter().map(|l| l.max(0.0)).sum::<f64>() / n as f64;
    let lower_bound = |ratio: f64| {
        let of = |l: &f64| ratio * l.max(0.0);
        let drop: f64 = eigenvalues.iter().map(|l| of(l) - of(l).ln_1p()).sum();
        let spread = (2.0 * eigenvalues.iter().map(|l| of(l).powi(2)).sum::<f64>()).sqrt();
        drop - POWER_QUANTILE * spread
    };
    let [mut low, mut high] = SEEN.map(|share| (share / mean).ln());
    if mean <= 0.0 || lower_bound(high.exp()) < price {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if lower_bound(middle.exp()) < price { low = middle } else { high = middle }
    }
    Some((high.exp() * variance_factor(system.chi_square, system.redundancy)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Values of `n` images, each measured with information `m`: a law of size `law` times the image's place, chance
    /// of deviation `t`.
    fn images(n: usize, m: f64, law: f64, t: f64, seed: u64) -> System {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let place = |i: usize| i as f64 / n as f64 - 0.5;
        let score: Vec<f64> = (0..n).map(|i| m * (law * place(i) + t * normal()) + m.sqrt() * normal()).collect();
        let mut information = DMatrix::zeros(n + 1, n + 1);
        for i in 0..n {
            information[(i, i)] = m;
            information[(i, n)] = m * place(i);
            information[(n, i)] = m * place(i);
            information[(n, n)] += m * place(i).powi(2);
        }
        let of_law = (0..n).map(|i| place(i) * score[i]).sum();
        System {
            score: DVector::from_iterator(n + 1, score.into_iter().chain([of_law])),
            length: information.diagonal().iter().copied().collect(),
            information: information.into(),
            least: vec![0.0; n + 1],
            chi_square: 10_000.0,
            redundancy: 10_000.0,
        }
    }

    #[test]
    fn a_variance_is_found_again() {
        let values: Vec<usize> = (0..200).collect();
        let system = images(200, 4.0, 0.0, 2.0, 1);
        // Uncertainty of a variance from 200 values: a tenth.
        let size = super::values(&system, &values).expect("an eigenbasis").variance(1.0, 0.0);
        assert!((size / 4.0 - 1.0).abs() < 0.3, "{size}");
        let component = test(&system, &values, 1.0).expect("a test");
        assert!((component.deviation / 2.0 - 1.0).abs() < 0.2 && component.ln_p < -100.0, "{component:?}");
    }

    #[test]
    fn what_an_exact_test_finds_is_not_screened_out() {
        let values: Vec<usize> = (0..200).collect();
        for seed in 0..40 {
            let system = images(200, 4.0, 0.0, 0.25, seed);
            let found = test(&system, &values, 1.0).expect("a test").ln_p < -10.0;
            assert!(!found || may_vary(&system, &values, 1.0, -10.0), "seed {seed}");
        }
        assert!(!may_vary(&images(200, 4.0, 0.0, 0.0, 1), &values, 1.0, -10.0));
    }

    #[test]
    fn four_of_five_samples_reach_the_price() {
        let values: Vec<usize> = (0..60).collect();
        let (none, price) = (images(60, 4.0, 0.0, 0.0, 1), 15.0);
        let t = smallest_seen(&none, &values, price).expect("values");
        let drop = |seed: &u64| {
            let of = super::values(&images(60, 4.0, 0.0, t, *seed), &values).expect("an eigenbasis");
            of.likeliest_ratio(1.0).map_or(0.0, |ratio| of.likelihood_ratio(1.0, ratio))
        };
        let found = (0..400).filter(|seed| drop(seed) > price).count();
        // Standard deviation of the share: 0.02; the largest likelihood lies half a unit above that of the true size.
        assert!((0.76..=0.88).contains(&(found as f64 / 400.0)), "{found} of 400");
    }

    #[test]
    fn nothing_is_nothing() {
        let values: Vec<usize> = (0..200).collect();
        let small = (0..40)
            .filter(|seed| test(&images(200, 4.0, 0.0, 0.0, *seed), &values, 1.0).expect("a test").ln_p < 0.05f64.ln());
        // Two of 40 expected; more than seven once in a thousand sets of seeds.
        assert!(small.count() <= 7);
    }
}
