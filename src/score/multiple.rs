//! Many tests at once: families, scans, ranges.

/// Natural logarithm of the p-value of the best of `count` independent tests: Šidák's formula.
pub fn best_of(ln_p: f64, count: f64) -> f64 {
    if count <= 1.0 {
        return ln_p;
    }
    // 1 - (1 - p)^n; for tiny p this is n p to rounding.
    let small = ln_p + count.ln();
    if small < -20.0 { small } else { (-(count * (-ln_p.exp()).ln_1p()).exp_m1()).ln().min(0.0) }
}

/// The same for the best over a range of a parameter, `angle` that through which the statistic's direction turns over
/// it: Davies' bound `P(sup > c) <= P(c) + angle / pi exp(-c^2 / 2)`. Source: Davies (1977), Biometrika 64.
pub fn best_over_range(ln_p: f64, chi_square: f64, angle: f64) -> f64 {
    let bound = (angle / std::f64::consts::PI).ln() - 0.5 * chi_square;
    let (larger, smaller) = (ln_p.max(bound), ln_p.min(bound));
    if smaller == f64::NEG_INFINITY { larger } else { (larger + (smaller - larger).exp().ln_1p()).min(0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_best_of_many() {
        assert_relative_eq!(best_of(0.01f64.ln(), 10.0).exp(), 1.0 - 0.99f64.powi(10), epsilon = 1e-12);
        assert_relative_eq!(best_of(-100.0, 50.0), -100.0 + 50.0f64.ln(), epsilon = 1e-12);
        assert_eq!(best_of(-3.0, 1.0), -3.0);
    }

    #[test]
    fn a_range_without_turn_costs_nothing() {
        assert_eq!(best_over_range(-8.0, 14.0, 0.0), -8.0);
        let one = best_over_range(-8.0, 14.0, std::f64::consts::PI);
        assert_relative_eq!(one.exp(), (-8.0f64).exp() + (-7.0f64).exp(), epsilon = 1e-15);
    }
}
