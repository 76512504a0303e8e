//! Is a set of columns zero? One F test, whatever the set is.

use super::pivoted::Pivoted;
use super::{System, variance_factor};
use crate::math::statistics::f_ln_sf;

/// What the test of a set says.
#[derive(Debug, Clone)]
pub struct Tested {
    /// `s'M^-1 s`: the drop of `v'Pv` that the set brings.
    pub drop: f64,
    /// Columns of the set that the base leaves.
    pub dof: f64,
    /// `drop / dof` over the variance factor and the design effect.
    pub statistic: f64,
    /// Natural logarithm of its p-value, which does not underflow.
    pub ln_p: f64,
    /// Factor by which the variance of the score exceeds that of independent measurements.
    pub design_effect: f64,
    /// Variance factor beside the set.
    pub variance: f64,
    /// The factorised set.
    pub set: Pivoted,
}

/// Tests that the columns of a set are zero. `None` where the base leaves nothing of them, or no redundancy is left.
/// Under independent normal errors the statistic is F distributed; `design_effect` of the whitened set widens it.
pub fn test(system: &System, set: &[usize], design_effect: impl FnOnce(&Pivoted) -> f64) -> Option<Tested> {
    let set = system.pivoted(set);
    let (drop, dof) = (set.drop(), set.kept.len() as f64);
    let rest = system.redundancy - dof;
    if dof == 0.0 || rest <= 0.0 {
        return None;
    }
    let variance = variance_factor(system.chi_square - drop, rest);
    let design_effect = design_effect(&set);
    let statistic = drop / (dof * variance * design_effect);
    let ln_p = f_ln_sf(statistic, dof, rest).min(0.0);
    Some(Tested { drop, dof, statistic, ln_p, design_effect, variance, set })
}

impl Tested {
    /// Variance factor times design effect: what the variances of the estimates are multiplied by.
    pub fn inflation(&self) -> f64 {
        self.variance * self.design_effect
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};

    fn system(score: f64, chi_square: f64) -> System {
        System {
            score: DVector::from_element(1, score),
            information: DMatrix::from_element(1, 1, 4.0).into(),
            length: vec![8.0],
            least: vec![0.0],
            chi_square,
            redundancy: 11.0,
        }
    }

    #[test]
    fn a_single_column_is_a_t_test() {
        // Estimate 3 of variance 1/4, variance factor (46 - 36) / 10 = 1: t = 6 with ten degrees of freedom.
        let tested = test(&system(12.0, 46.0), &[0], |_| 1.0).expect("a test");
        assert_relative_eq!(tested.statistic, 36.0, epsilon = 1e-12);
        // Two-sided tail of Student's t at 6 with 10 degrees of freedom.
        assert_relative_eq!(tested.ln_p.exp(), 1.322e-4, max_relative = 1e-3);
        let halved = test(&system(12.0, 46.0), &[0], |_| 2.0).expect("a test");
        assert_relative_eq!(halved.statistic, 18.0, epsilon = 1e-12);
    }

    #[test]
    fn nothing_left_is_not_tested() {
        let mut absorbed = system(0.1, 46.0);
        absorbed.information = DMatrix::from_element(1, 1, 1e-9).into();
        assert!(test(&absorbed, &[0], |_| 1.0).is_none());
        let mut unknown = system(12.0, 46.0);
        unknown.least[0] = 5.0;
        assert!(test(&unknown, &[0], |_| 1.0).is_none(), "known worse than its plausible range");
    }
}
