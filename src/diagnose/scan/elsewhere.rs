//! What a shape takes away at places other than its best one: a pattern all over the sensor, or measurements that err
//! together, makes the best of many places stand out that is no spot. A spot is one place that others are unlike.

/// Median of a chi-square of one degree of freedom.
const MEDIAN: f64 = 0.454_936;
/// Standard deviation of the median of `n` such values, relative to it, times the root of `n`: `1 / (2 f(m) m)` with
/// the density `f` at it.
const MEDIAN_DEVIATION: f64 = 2.33;
/// Fewer places tell nothing of a median.
const LEAST_PLACES: usize = 10;
/// Standard deviations above one that say that there is a pattern: one null case in 700, if places were independent.
/// Neighbours are not, which makes the median vary more; what the fit takes out of every place makes it smaller.
const SIGMAS: f64 = 3.0;

/// Factor by which `statistics` of places exceed a chi-square of one degree of freedom, by their median; one where that
/// is not above one by more than its own uncertainty, or where there are too few. Source: the genomic control of Devlin
/// and Roeder (1999).
pub(super) fn factor(mut statistics: Vec<f64>) -> f64 {
    if statistics.len() < LEAST_PLACES {
        return 1.0;
    }
    let middle = statistics.len() / 2;
    let (_, median, _) = statistics.select_nth_unstable_by(middle, f64::total_cmp);
    let factor = *median / MEDIAN;
    if factor > 1.0 + SIGMAS * MEDIAN_DEVIATION / (statistics.len() as f64).sqrt() { factor } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    /// Quantiles of a chi-square of one degree of freedom, times `size`.
    fn quantiles(count: usize, size: f64) -> Vec<f64> {
        let chi_square = ChiSquared::new(1.0).expect("a distribution");
        (0..count).map(|k| size * chi_square.inverse_cdf((k as f64 + 0.5) / count as f64)).collect()
    }

    #[test]
    fn a_pattern_is_seen_by_the_places_of_no_spot() {
        assert_eq!(factor(quantiles(101, 1.0)), 1.0);
        assert_relative_eq!(factor(quantiles(101, 4.0)), 4.0, epsilon = 1e-4);
        let mut with_spot = quantiles(101, 1.0);
        with_spot[..10].fill(1000.0);
        assert_eq!(factor(with_spot), 1.0, "a tenth of the places that a spot reaches says nothing of the others");
    }

    #[test]
    fn few_places_or_a_median_that_chance_gives_say_nothing() {
        assert_eq!(factor(quantiles(9, 9.0)), 1.0);
        assert_eq!(factor(quantiles(101, 1.6)), 1.0);
    }
}
