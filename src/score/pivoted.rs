//! A set of columns factorised, and what it says: drop, estimates, variances.

use super::System;
use crate::math::vectors::dispatch;
use nalgebra::{DMatrix, DVector};
use pulp::{Simd, WithSimd};
use std::array::from_fn;

/// A direction of a set of which the base and the other directions leave less than this share of its squared length is
/// absorbed: values of the set that differ by hundreds of times what they do to the residuals would make a refit follow
/// a curved valley.
pub const KEPT_SHARE: f64 = 1e-5;
/// The same for what a set has above all, its best direction: rounding alone. Most of a flat port or of a high radial
/// term is a focal length and a k1, whose freedom says nothing of the rest; whether that is known well enough says the
/// plausible range.
const ROUNDING_SHARE: f64 = 1e-9;

/// A Cholesky factorisation with pivoting over the columns of a set: those that are left something of, in the order
/// in which they were taken.
#[derive(Debug, Clone)]
pub struct Pivoted {
    /// Columns kept.
    pub kept: Vec<usize>,
    /// Lower factor of `M` over the kept columns, scaled: `M = S^-1 L L' S^-1` with `S` the diagonal of `scale`.
    pub factor: DMatrix<f64>,
    /// One over the length of each kept column.
    pub scale: Vec<f64>,
    /// `L^-1 S s`: independent, of the variance of unit weight, mean zero without an effect.
    pub white: DVector<f64>,
}

impl System {
    /// Factorises `M` over a set of columns, most independent first, and leaves out those that the others and the
    /// base absorb.
    pub fn pivoted(&self, set: &[usize]) -> Pivoted {
        self.pivoted_in_turn(&[set])
    }

    /// The same over several sets, one beside those before it: what counts as absorbed of a set does not depend on
    /// whether it is factorised alone beside the others or together with them.
    pub fn pivoted_in_turn<S: AsRef<[usize]>>(&self, sets: &[S]) -> Pivoted {
        let of_set = |s: usize| sets[s].as_ref().iter().map(move |column| (*column, s));
        let all = (0..sets.len()).flat_map(of_set).filter(|(column, _)| self.length[*column] > 0.0);
        let (mut columns, mut set_of): (Vec<usize>, Vec<usize>) = all.unzip();
        let n = columns.len();
        let scale_of = |c: usize| self.length[c].sqrt().recip();
        let mut factor = DMatrix::<f64>::zeros(n, n);
        let mut diagonal: Vec<f64> = columns.iter().map(|c| self.information[(*c, *c)] / self.length[*c]).collect();
        let mut white: Vec<f64> = columns.iter().map(|c| self.score[*c] * scale_of(*c)).collect();
        let mut asked: Vec<f64> = columns.iter().map(|c| self.least[*c] / self.length[*c]).collect();
        let (mut kept, mut set, mut floor) = (0, 0, ROUNDING_SHARE);
        while set < sets.len() {
            let step = kept;
            let ratio = |k: usize| diagonal[k] / asked[k].max(KEPT_SHARE);
            let own = (step..n).filter(|k| set_of[*k] == set);
            let best = own.max_by(|i, k| ratio(*i).total_cmp(&ratio(*k)).then(k.cmp(i)));
            let Some(best) = best.filter(|best| diagonal[*best] > asked[*best].max(floor)) else {
                (set, floor) = (set + 1, ROUNDING_SHARE);
                continue;
            };
            floor = KEPT_SHARE;
            columns.swap(step, best);
            set_of.swap(step, best);
            diagonal.swap(step, best);
            asked.swap(step, best);
            white.swap(step, best);
            (0..step).for_each(|done| factor.swap((step, done), (best, done)));
            let pivot = diagonal[step].sqrt();
            factor[(step, step)] = pivot;
            let own = scale_of(columns[step]);
            // Column by column, which is how they are stored.
            let mut next: Vec<f64> = (step + 1..n)
                .map(|i| self.information[(columns[i], columns[step])] * scale_of(columns[i]) * own)
                .collect();
            dispatch(TakeColumns { next: &mut next, factor: factor.as_slice(), step });
            white[step] /= pivot;
            for (i, value) in (step + 1..n).zip(next) {
                let value = value / pivot;
                factor[(i, step)] = value;
                diagonal[i] -= value * value;
                white[i] -= value * white[step];
            }
            kept = step + 1;
        }
        columns.truncate(kept);
        Pivoted {
            scale: columns.iter().map(|c| scale_of(*c)).collect(),
            factor: factor.view((0, 0), (kept, kept)).into_owned(),
            white: DVector::from_vec(white).rows(0, kept).into_owned(),
            kept: columns,
        }
    }
}

/// Takes the finished columns of a factor, as many as `step`, out of the next one below its diagonal.
struct TakeColumns<'a> {
    next: &'a mut [f64],
    /// Square, column by column.
    factor: &'a [f64],
    step: usize,
}

/// Finished columns that are taken out while an entry of the next one is at hand.
const TAKEN_TOGETHER: usize = 4;

impl WithSimd for TakeColumns<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { next, factor, step } = self;
        let n = step + 1 + next.len();
        let (row, below) =
            (|done: usize| factor[done * n + step], |done: usize| &factor[done * n + step + 1..][..n - step - 1]);
        let together = step - step % TAKEN_TOGETHER;
        for done in (0..together).step_by(TAKEN_TOGETHER) {
            let rows: [f64; TAKEN_TOGETHER] = from_fn(|k| row(done + k));
            let [a, b, c, d] = from_fn(|k| below(done + k));
            for ((((value, a), b), c), d) in next.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                *value = *value - rows[0] * a - rows[1] * b - rows[2] * c - rows[3] * d;
            }
        }
        for done in together..step {
            let row = row(done);
            next.iter_mut().zip(below(done)).for_each(|(value, other)| *value -= row * other);
        }
    }
}

impl Pivoted {
    /// `s'M^-1 s` over the kept columns.
    pub fn drop(&self) -> f64 {
        self.white.norm_squared()
    }

    /// `M^-1 s`: estimates of the kept columns.
    pub fn estimate(&self) -> DVector<f64> {
        let mut values = self.white.clone();
        self.factor.tr_solve_lower_triangular_mut(&mut values);
        DVector::from_fn(values.len(), |i, _| values[i] * self.scale[i])
    }

    /// `T` with `T'MT = I`, over the kept columns: its columns are directions of unit information.
    pub fn whitening(&self) -> DMatrix<f64> {
        let n = self.kept.len();
        let mut whitening = DMatrix::identity(n, n);
        self.factor.tr_solve_lower_triangular_mut(&mut whitening);
        DMatrix::from_fn(n, n, |i, k| whitening[(i, k)] * self.scale[i])
    }

    /// Variances of the estimates for unit weight.
    pub fn variances(&self) -> Vec<f64> {
        let whitening = self.whitening();
        (0..self.kept.len()).map(|i| whitening.row(i).norm_squared()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// More columns than are taken out together, and a rest.
    #[test]
    fn many_columns_are_solved_as_by_an_ordinary_factorisation() {
        let n = 2 * TAKEN_TOGETHER + 3;
        let design =
            DMatrix::from_fn(3 * n, n, |i, j| ((7 * i + 3 * j * j) as f64).sin() + if i == j { 3.0 } else { 0.0 });
        let v = DVector::from_fn(3 * n, |i, _| (i as f64).cos());
        let (information, score) = (design.tr_mul(&design), design.tr_mul(&v));
        let expected = information.clone().cholesky().expect("of full rank").solve(&score);
        let system = System {
            length: information.diagonal().iter().copied().collect(),
            information: information.clone().into(),
            score: score.clone(),
            least: vec![0.0; n],
            chi_square: v.norm_squared(),
            redundancy: 2.0 * n as f64,
        };
        let pivoted = system.pivoted(&(0..n).collect::<Vec<_>>());
        assert_eq!(pivoted.kept.len(), n);
        let variances = information.try_inverse().expect("of full rank");
        for ((column, estimate), variance) in pivoted.kept.iter().zip(&pivoted.estimate()).zip(pivoted.variances()) {
            assert_relative_eq!(*estimate, expected[*column], epsilon = 1e-12);
            assert_relative_eq!(variance, variances[(*column, *column)], max_relative = 1e-10);
        }
        assert_relative_eq!(pivoted.drop(), score.dot(&expected), max_relative = 1e-12);
    }
}
