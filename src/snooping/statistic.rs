//! How large a residual is for the redundancy that it has.

use crate::math::statistics::{chi_square_quantile, median};
use nalgebra::{Matrix2, Vector2};

/// Directions with less redundancy are not tested: twenty sigma there show as less than five.
const SMALLEST_REDUNDANCY: f64 = 0.05;

/// A measurement tested against the others of its point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Statistic {
    /// Statistic, the lesser of its own and of its difference from the neighbours.
    pub(super) statistic: f64,
    /// Directions that have redundancy: one or two.
    pub(super) dof: f64,
}

/// `R^-1` over the directions that have redundancy.
#[derive(Clone, Copy)]
pub(super) struct Weight {
    inverse: Matrix2<f64>,
    dof: f64,
}

impl Weight {
    /// `None` where no direction has redundancy.
    pub(super) fn of(redundancy: Matrix2<f64>) -> Option<Self> {
        // Most have redundancy in all directions: the lesser eigenvalue tells.
        let (half, apart) = (0.5 * redundancy.trace(), 0.5 * (redundancy[(0, 0)] - redundancy[(1, 1)]));
        if half - apart.hypot(redundancy[(0, 1)]) > SMALLEST_REDUNDANCY {
            return redundancy.try_inverse().map(|inverse| Self { inverse, dof: 2.0 });
        }
        let eigen = redundancy.symmetric_eigen();
        let mut weight = Self { inverse: Matrix2::zeros(), dof: 0.0 };
        for k in (0..2).filter(|k| eigen.eigenvalues[*k] > SMALLEST_REDUNDANCY) {
            let direction = eigen.eigenvectors.column(k);
            weight.inverse += direction * direction.transpose() / eigen.eigenvalues[k];
            weight.dof += 1.0;
        }
        (weight.dof > 0.0).then_some(weight)
    }

    /// `v' R^-1 v`.
    pub(super) fn verdict(&self, residual: Vector2<f64>) -> Statistic {
        Statistic { statistic: residual.dot(&(self.inverse * residual)), dof: self.dof }
    }
}

/// Statistics of a block, those with one direction and those with two.
#[derive(Default)]
pub(super) struct Statistics([Vec<f64>; 2]);

impl Statistics {
    pub(super) fn add(&mut self, Statistic { statistic, dof }: Statistic) {
        self.0[usize::from(dof > 1.0)].push(statistic);
    }

    pub(super) fn append(&mut self, other: Self) {
        self.0.iter_mut().zip(other.0).for_each(|(own, mut other)| own.append(&mut other));
    }

    pub(super) fn len(&self) -> usize {
        self.0.iter().map(Vec::len).sum()
    }

    /// Variance factor from the median of those that are more; 1 where nothing can be tested.
    pub(super) fn variance<const N: usize>(of: [&Self; N]) -> f64 {
        let [one, two] = [0, 1].map(|k| of.iter().flat_map(|own| own.0[k].iter().copied()).collect::<Vec<_>>());
        let (sample, dof) = if two.len() >= one.len() { (two, 2.0) } else { (one, 1.0) };
        let variance = median(&sample) / chi_square_quantile(0.5, dof);
        if variance > 0.0 { variance } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_without_redundancy_is_not_tested() {
        let one = Weight::of(Matrix2::new(0.5, 0.0, 0.0, 0.01)).expect("one direction");
        let verdict = one.verdict(Vector2::new(3.0, 100.0));
        assert!((verdict.statistic - 18.0).abs() < 1e-12 && verdict.dof == 1.0);
        assert!(Weight::of(Matrix2::zeros()).is_none());
    }

    #[test]
    fn with_redundancy_in_all_directions_it_is_that_of_the_inverse() {
        let redundancy = Matrix2::new(0.5, 0.2, 0.2, 0.3);
        let verdict = Weight::of(redundancy).expect("two directions").verdict(Vector2::new(1.0, -2.0));
        // By hand: (1, -2) adj(R) (1, -2)' / det R.
        assert!(
            (verdict.statistic - (0.3 + 4.0 * 0.2 + 4.0 * 0.5) / (0.15 - 0.04)).abs() < 1e-12 && verdict.dof == 2.0
        );
    }

    #[test]
    fn the_variance_is_that_of_the_larger_sample() {
        let mut all = Statistics::default();
        let mut more = Statistics::default();
        for k in 1..=9 {
            more.add(Statistic { statistic: f64::from(k), dof: 1.0 });
        }
        all.add(Statistic { statistic: 1e6, dof: 2.0 });
        all.append(more);
        let variance = Statistics::variance([&all]);
        assert!((variance - 5.0 / chi_square_quantile(0.5, 1.0)).abs() < 1e-12, "{variance}");
        assert_eq!(Statistics::variance([&Statistics::default()]), 1.0);
    }
}
