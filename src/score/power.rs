//! The smallest effect that a test sees.

/// Standard normal quantile of a power of 80 %.
pub const POWER_QUANTILE: f64 = 0.841_621_233_572_914_4;

/// Size of one value, in standard deviations of its estimate, that drops `v'Pv` by more than `price` with a power of
/// 80 %: the drop is the square of a normal variable with this mean.
pub fn detectable(price: f64) -> f64 {
    price.max(0.0).sqrt() + POWER_QUANTILE
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
        for price in [4.0, 16.0, 30.0] {
            let mut drop = || (detectable(price) + Distribution::<f64>::sample(&StandardNormal, &mut random)).powi(2);
            let found = (0..DRAWS).filter(|_| drop() > price).count();
            // Standard deviation of the share: 0.003.
            assert!((found as f64 / DRAWS as f64 - 0.8).abs() < 0.01, "{price}: {found}");
        }
    }
}
