//! The smallest effect that a test sees.

use crate::math::statistics::chi_square_sf;

/// Probability with which an effect of the smallest size that counts as seen is found.
pub const POWER: f64 = 0.8;
/// Standard normal quantile of [`POWER`].
pub const POWER_QUANTILE: f64 = 0.841_621_233_572_914_4;
/// Halvings of an interval that a noncentrality lies in.
const HALVINGS: usize = 60;
/// Standard deviations of a Poisson variable beyond which its values count for nothing.
const FAR: f64 = 9.0;

/// Noncentrality at which a chi-square of `dof` degrees of freedom exceeds `price` with a probability of [`POWER`]: the
/// drop of `v'Pv` that an effect of this size brings. One column of information `m` has it at the size
/// `sqrt(noncentrality / m)`.
pub fn noncentrality(price: f64, dof: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while exceeds(price, dof, high) < POWER && high < 1e12 {
        high *= 2.0;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if exceeds(price, dof, middle) < POWER { low = middle } else { high = middle }
    }
    high
}

/// Probability that a noncentral chi-square exceeds `x`: a mixture of central ones with Poisson weights (Johnson, Kotz
/// and Balakrishnan, Continuous Univariate Distributions 2, ch. 29).
fn exceeds(x: f64, dof: f64, noncentrality: f64) -> f64 {
    let mean = 0.5 * noncentrality;
    let reach = FAR * (mean + 1.0).sqrt();
    let first = (mean - reach).max(0.0).floor() as u64;
    let last = (mean + reach).ceil() as u64;
    let mut ln_weight = -mean + (1..=first).map(|j| (mean / j as f64).ln()).sum::<f64>();
    let mut sum = 0.0;
    for j in first..=last {
        if j > first {
            ln_weight += (mean / j as f64).ln();
        }
        sum += ln_weight.exp() * chi_square_sf(x, dof + 2.0 * j as f64);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn four_of_five_drops_reach_the_price() {
        const DRAWS: usize = 20_000;
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for (price, dof) in [(4.0, 1), (16.0, 1), (30.0, 2), (40.0, 11)] {
            let mean = noncentrality(price, dof as f64).sqrt();
            let mut normal = |mean: f64| mean + Distribution::<f64>::sample(&StandardNormal, &mut random);
            let mut drop = || (0..dof).map(|k| normal(if k == 0 { mean } else { 0.0 }).powi(2)).sum::<f64>();
            let found = (0..DRAWS).filter(|_| drop() > price).count();
            // Standard deviation of the share: 0.003.
            assert!((found as f64 / DRAWS as f64 - POWER).abs() < 0.01, "{price} of {dof}: {found}");
        }
    }

    #[test]
    fn one_value_is_seen_a_quantile_beyond_the_root_of_the_price() {
        for price in [10.0f64, 25.0, 100.0] {
            assert!((noncentrality(price, 1.0).sqrt() - price.sqrt() - POWER_QUANTILE).abs() < 1e-3, "{price}");
        }
    }
}
