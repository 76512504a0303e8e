//! Groups of surveyed coordinates: the factor on the standard deviations of each, and what the objective falls by when
//! several change.

use super::super::linearised::Linearised;
use super::super::settings::Settings;
use super::BELIEVED;
use crate::math::statistics::chi_square_quantile;
use crate::score::{Penalised, System, random};
use faer::Mat;
use faer::linalg::solvers::Solve;

/// Observed coordinates, each a column.
pub(super) struct Groups {
    /// Conditional on the model.
    beside: System,
    /// Column of the first coordinate.
    first: usize,
}

impl Groups {
    pub(super) fn of(linearised: &Linearised, first: usize, settings: &Settings<'_>) -> Self {
        Self { beside: linearised.situation(settings).beside().into_system(), first }
    }

    /// The same beside random values of some of them.
    pub(super) fn beside(&self, values: Penalised) -> Self {
        let random = Penalised { columns: self.of_system(&values.columns), ..values };
        Self { beside: self.beside.beside::<[usize; 0]>(&[], &[random]), first: self.first }
    }

    fn of_system(&self, group: &[usize]) -> Vec<usize> {
        group.iter().map(|column| self.first + column).collect()
    }

    /// Factor on the stated standard deviations of a group of coordinates, which were multiplied by `now` in the fit.
    /// What is stated stands unless it is improbable.
    pub(super) fn factor(&self, group: &[usize], now: f64, [least, most]: [f64; 2]) -> f64 {
        let own = self.of_system(group);
        if own.is_empty() {
            return now;
        }
        let as_stated = now.powi(-2) - 1.0;
        let Some(values) = random::values(&self.beside, &own) else { return 1.0 };
        let variance = 1.0;
        let of = |size: f64| values.likelihood_ratio(variance, size);
        let [least_size, most_size] = [least, most].map(|factor: f64| (factor / now).powi(2) - 1.0);
        let size = values.variance(variance, least_size).min(most_size);
        if of(size) - of(as_stated) <= price_of_group() {
            return 1.0;
        }
        // To the digit: a factor at this limit is a bound.
        if size == most_size { most } else { now * (1.0 + size).sqrt() }
    }

    /// What the objective falls by with all changes together, less the price of every group that is not as stated:
    /// what two groups could explain alike counts once. A group of which a sample takes part counts as all of it.
    pub(super) fn gain(&self, changes: &[Change]) -> f64 {
        let paid = |factor: f64| if factor == 1.0 { 0.0 } else { price_of_group() };
        let asked = changes.iter().filter(|change| !change.columns.is_empty());
        let prices: f64 = asked.map(|change| paid(change.next) - paid(change.now)).sum();
        let all: Vec<&Change> = changes.iter().collect();
        let mut strides: Vec<f64> = all.iter().map(|change| change.stride).filter(|stride| *stride > 1.0).collect();
        strides.sort_by(f64::total_cmp);
        strides.dedup();
        let beyond_sample = strides.into_iter().map(|stride| {
            let alike: Vec<&Change> = changes.iter().filter(|change| change.stride == stride).collect();
            (stride - 1.0) * self.likelihood_ratio(&alike)
        });
        self.likelihood_ratio(&all) + beyond_sample.sum::<f64>() - prices
    }

    /// Twice the logarithm of the likelihood ratio of changes. With `D` the changes of the variances as shares of the
    /// present ones it is `s' (I + D M)^-1 D s - ln|I + D M|`.
    fn likelihood_ratio(&self, changes: &[&Change]) -> f64 {
        let size = |change: &Change| (change.next / change.now).powi(2) - 1.0;
        let of = |change: &Change| {
            let size = size(change);
            change.columns.iter().map(|column| (self.first + column, size)).collect::<Vec<_>>()
        };
        let changed: Vec<(usize, f64)> =
            changes.iter().filter(|change| change.next != change.now).flat_map(|change| of(change)).collect();
        let (n, system) = (changed.len(), &self.beside);
        let scaled = Mat::from_fn(n, n, |i, j| {
            let unit = if i == j { 1.0 } else { 0.0 };
            unit + changed[i].1 * system.information[(changed[i].0, changed[j].0)]
        });
        let right = Mat::from_fn(n, 1, |i, _| changed[i].1 * system.score[changed[i].0]);
        let factors = scaled.partial_piv_lu();
        let solved = factors.solve(&right);
        let explained: f64 = (0..n).map(|i| system.score[changed[i].0] * solved[(i, 0)]).sum();
        let ln_determinant: f64 = (0..n).map(|k| factors.U()[(k, k)].abs().ln()).sum();
        explained - ln_determinant
    }
}

/// A group of coordinates, and the factor on its standard deviations.
pub(super) struct Change {
    /// Its columns, from the first coordinate on.
    pub(super) columns: Vec<usize>,
    /// Coordinates of the group for each of its columns.
    pub(super) stride: f64,
    /// In the fit.
    pub(super) now: f64,
    /// In the next one.
    pub(super) next: f64,
}

/// What a group pays that is not as precise as stated.
pub(super) fn price_of_group() -> f64 {
    chi_square_quantile(1.0 - BELIEVED, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    const EACH: usize = 20;

    /// Two groups of coordinates whose pairs share `common` of their information 0.5; all scores are `score`.
    fn two(common: f64, score: f64) -> Groups {
        let n = 2 * EACH;
        let information = DMatrix::from_fn(n, n, |i, j| match (i == j, i % EACH == j % EACH) {
            (true, _) => 0.5,
            (_, true) => common,
            _ => 0.0,
        });
        let beside = System {
            score: DVector::from_element(n, score),
            length: vec![0.5; n],
            information: information.into(),
            least: vec![0.0; n],
            chi_square: 1e4,
            redundancy: 1e4,
        };
        Groups { beside, first: 0 }
    }

    fn change(group: usize, next: f64) -> Change {
        Change { columns: (group * EACH..(group + 1) * EACH).collect(), stride: 1.0, now: 1.0, next }
    }

    #[test]
    fn one_group_gains_its_likelihood_ratio() {
        let groups = two(0.0, 2.0);
        let columns: Vec<usize> = (0..EACH).collect();
        let alone = random::values(&groups.beside, &columns).expect("an eigenbasis").likelihood_ratio(1.0, 3.0);
        assert!((groups.gain(&[change(0, 2.0)]) - (alone - price_of_group())).abs() < 1e-9);
        // Back again from there: the price is returned.
        let back = Change { now: 2.0, next: 2.0, ..change(0, 2.0) };
        assert_eq!(groups.gain(&[back]), 0.0);
    }

    #[test]
    fn a_sample_counts_as_its_group() {
        let groups = two(0.0, 2.0);
        let of = |stride: f64| groups.gain(&[Change { stride, ..change(0, 2.0) }]) + price_of_group();
        assert!((of(3.0) - 3.0 * of(1.0)).abs() < 1e-9, "each third coordinate is a column");
        let mixed = groups.gain(&[Change { stride: 3.0, ..change(0, 2.0) }, change(1, 2.0)]) + 2.0 * price_of_group();
        assert!((mixed - 4.0 * of(1.0)).abs() < 1e-9, "beside a group that is a column each");
    }

    #[test]
    fn what_two_groups_explain_alike_counts_once() {
        let gains = |common: f64| {
            let groups = two(common, 2.0);
            let of = |changes: &[Change]| groups.gain(changes);
            (of(&[change(0, 2.0)]) + of(&[change(1, 2.0)]), of(&[change(0, 2.0), change(1, 2.0)]))
        };
        let (sum, together) = gains(0.0);
        assert!((sum - together).abs() < 1e-9, "nothing in common: {sum} {together}");
        let (sum, together) = gains(0.49);
        assert!(together < 0.7 * sum, "nearly the same: {sum} {together}");
    }
}
