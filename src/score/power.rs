//! The smallest effect that a test sees.

use crate::math::statistics::chi_square_quantile;

/// Standard normal quantile of a power of 80 %.
pub const POWER_QUANTILE: f64 = 0.841_621_233_572_914_4;

/// Noncentrality that a chi-square test of this level and these degrees of freedom sees with 80 % power (normal
/// approximation of the noncentral distribution: mean `dof + l`, variance `2 dof + 4 l`).
pub fn noncentrality(level: f64, dof: f64) -> f64 {
    let threshold = chi_square_quantile(1.0 - level, dof);
    // Solve threshold = dof + l - 0.84 sqrt(2 dof + 4 l) by iteration; it contracts.
    let mut l = threshold;
    for _ in 0..50 {
        l = threshold - dof + POWER_QUANTILE * (2.0 * dof + 4.0 * l).sqrt();
    }
    l
}
