//! The price of a hypothesis: the drop of the objective that it reaches by chance with a stated probability, whatever
//! was searched to find it.

use crate::diagnose::select::Searched;
use crate::math::statistics::{chi_square_ln_sf, f_ln_sf};
use crate::score::multiple::{best_of, best_over_range};

/// Halvings of an interval that a quantile lies in.
const HALVINGS: usize = 60;
/// Parameters of a place on the sensor that a finer search moves after the grid that is counted: two of the place and a
/// width. Each takes one unit of `v'Pv` in the mean.
pub const PLACE_PARAMETERS: f64 = 3.0;

/// What the price of a law depends on.
pub struct Law {
    /// Degrees of freedom.
    pub dof: f64,
    /// Design effect: measurements that err together make every drop larger by this factor.
    pub design_effect: f64,
    /// Drop of `v'Pv` that it brings, where it is a place that was searched.
    pub drop: f64,
    /// How it was found.
    pub searched: Searched,
    /// Variants of it that compete, each as likely as the others.
    pub variants: f64,
    /// Angle through which the statistic's direction turns over a range that is searched.
    pub angle: f64,
}

impl Law {
    /// Price at the level `exp(ln_level)`, `redundancy` without the law.
    pub fn price(&self, ln_level: f64, redundancy: f64) -> f64 {
        let Self { dof, design_effect, drop: found, searched, variants, angle } = *self;
        let rest = (redundancy - dof).max(1.0);
        let f = |drop: f64, dof: f64| f_ln_sf(drop / dof, dof, rest).min(0.0);
        let ln_p = |drop: f64| match searched {
            Searched::Places { count, .. } => best_of(f(drop, 1.0), count),
            // The place is estimated with the size, so that its parameters take their share by chance.
            Searched::Placed { count } => best_of(f(drop - (dof - 1.0), 1.0), count),
            Searched::Range(_) if variants > 1.0 => best_over_range(f(drop, dof), drop, angle),
            Searched::Variant => best_of(f(drop, dof), variants),
            Searched::Option => f(drop, dof + 1.0),
            _ => f(drop, dof),
        };
        let drop = match searched {
            // The grid alone is counted. Finer grids find a larger share of what is there, of chance as of a flaw: a
            // place is significant where its drop on the grid is.
            Searched::Places { drop: on_grid, elsewhere, .. } => {
                let on_counted = design_effect.max(elsewhere) * quantile(ln_p, ln_level);
                // Without a drop on the grid no place is significant, whatever was found beside it.
                let finer = if found > on_grid { found / on_grid.max(0.0) } else { 1.0 };
                (on_counted * finer).max(on_counted + PLACE_PARAMETERS)
            }
            _ => design_effect * quantile(ln_p, ln_level),
        };
        // Of the redundancy's share that the law takes at its F quantile: the variance factor is that without the law.
        redundancy / (1.0 + rest / drop)
    }
}

impl Law {
    /// Price of a law that contains another one of `smaller` degrees of freedom: that of the other one, and that of
    /// what it adds to it. At its own price alone it would take the place of a smaller one that is true for less than
    /// chance gives: of the two, most of the price is that of being asked at all.
    pub fn price_beyond(&self, smaller: f64, ln_level: f64, redundancy: f64) -> f64 {
        let of = |dof: f64| Law { dof, ..*self }.price(ln_level, redundancy);
        of(smaller) + of(self.dof - smaller)
    }
}

/// What an option that is not the default costs beside the law with the default: one more parameter.
pub fn of_option(ln_level: f64) -> f64 {
    let of = |dof: f64| quantile(|drop| chi_square_ln_sf(drop, dof), ln_level);
    of(2.0) - of(1.0)
}

/// Price of one variance: half of its chance values are zero. `design_effect`: see [`Law`].
pub fn of_variance(design_effect: f64, ln_level: f64) -> f64 {
    design_effect * quantile(|drop| 0.5f64.ln() + chi_square_ln_sf(drop, 1.0), ln_level)
}

/// Where the logarithm of a tail probability falls to `ln_level`.
fn quantile(ln_sf: impl Fn(f64) -> f64, ln_level: f64) -> f64 {
    let mut high = 1.0;
    while ln_sf(high) > ln_level && high < 1e12 {
        high *= 2.0;
    }
    let mut low = 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if ln_sf(middle) > ln_level { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::statistics::chi_square_quantile;
    use approx::assert_relative_eq;

    fn law(dof: f64, searched: Searched) -> Law {
        Law { dof, design_effect: 1.0, drop: 0.0, searched, variants: 1.0, angle: 0.0 }
    }

    #[test]
    fn an_option_costs_one_more_parameter() {
        let level: f64 = 1e-5;
        let [default, other] = [Searched::None, Searched::Option].map(|search| law(1.0, search).price(level.ln(), 1e9));
        assert_relative_eq!(other - default, of_option(level.ln()), max_relative = 1e-3);
        assert!(of_option(level.ln()) > 2.0 && of_option(level.ln()) < 6.0);
    }

    #[test]
    fn a_law_costs_the_quantile_of_its_test() {
        let level = 1e-4f64;
        let large = law(2.0, Searched::None).price(level.ln(), 1e9);
        assert_relative_eq!(large, chi_square_quantile(1.0 - level, 2.0), max_relative = 1e-6);
        // With ten degrees of freedom left F = t^2 has its quantile at 6.211^2 (two-sided, Student's t).
        let small = law(1.0, Searched::None).price(level.ln(), 11.0);
        let squared = 6.2110f64.powi(2);
        assert_relative_eq!(small, 11.0 * squared / (10.0 + squared), max_relative = 1e-4);
    }

    #[test]
    fn correlated_noise_and_searched_places_make_a_law_dearer() {
        let level = 1e-4f64.ln();
        let plain = law(1.0, Searched::None).price(level, 1e9);
        let doubled = Law { design_effect: 2.0, ..law(1.0, Searched::None) };
        assert_relative_eq!(doubled.price(level, 1e9), 2.0 * plain, max_relative = 1e-6);
        let placed = law(1.0, Searched::Places { count: 100.0, drop: 0.0, elsewhere: 1.0 }).price(level, 1e9);
        let strict = law(1.0, Searched::None).price(level - 100f64.ln(), 1e9);
        assert_relative_eq!(placed, strict + PLACE_PARAMETERS, max_relative = 1e-4);
        // Significant where the drop on the counted grid is, whatever finer grids found.
        let refined = Law { drop: 50.0, ..law(1.0, Searched::Places { count: 100.0, drop: 30.0, elsewhere: 1.0 }) };
        assert_relative_eq!(refined.price(level, 1e9), strict * 50.0 / 30.0, max_relative = 1e-4);
    }

    #[test]
    fn a_law_pays_for_what_it_adds_to_one_that_it_contains() {
        let level = 1e-4f64;
        let price = law(24.0, Searched::None).price_beyond(3.0, level.ln(), 1e9);
        let parts = chi_square_quantile(1.0 - level, 3.0) + chi_square_quantile(1.0 - level, 21.0);
        assert_relative_eq!(price, parts, max_relative = 1e-6);
    }

    #[test]
    fn a_variance_is_zero_in_half_of_all_null_cases() {
        let level = 1e-3f64;
        assert_relative_eq!(of_variance(1.0, level.ln()), chi_square_quantile(1.0 - 2.0 * level, 1.0), epsilon = 1e-6);
    }
}
