//! Score and information of columns, and what remains of both when some of them are taken for granted.

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};
use nalgebra::{Cholesky, DMatrix, DVector};
use std::sync::Arc;

/// A direction of a set of which the base and the other directions leave less than this share of its squared length is absorbed: values of the
/// set that differ by hundreds of times what they do to the residuals would make a refit follow a curved valley.
pub const KEPT_SHARE: f64 = 1e-5;
/// The same for what a set has above all, its best direction: rounding alone. Most of a flat port or of a high radial term is a focal length and
/// a k1, whose freedom says nothing of the rest; whether that is known well enough says the plausible range.
const ROUNDING_SHARE: f64 = 1e-9;

/// Standard deviations at which a value shows for certain among some dozens of candidates: 4.1 for one in 25000, 0.84 for a power of 80 %.
const SHOWS: f64 = 4.94;

/// Score `s = C'Qv` and information `M = C'QC` of columns `C` at zero, for unit weight.
#[derive(Debug, Clone)]
pub struct System {
    /// `s`.
    pub score: DVector<f64>,
    /// `M`, shared until it changes.
    pub information: Arc<DMatrix<f64>>,
    /// Squared length of each column before anything was taken out of it.
    pub length: Vec<f64>,
    /// Least information of a column for its value to be known to its plausible range, at unit weight; zero where there is none.
    pub least: Vec<f64>,
    /// `v'Pv` without any of the columns.
    pub chi_square: f64,
    /// Redundancy without any of the columns.
    pub redundancy: f64,
}

/// Random values: columns, and the variance of each value, in units of the variance of unit weight.
#[derive(Debug, Clone, PartialEq)]
pub struct Penalised {
    /// Columns.
    pub columns: Vec<usize>,
    /// Variance of each value, in the units of the columns squared.
    pub variance: f64,
}

/// A Cholesky factorisation with pivoting over the columns of a set: those that are left something of, in the order in which they were taken.
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
    /// Number of columns.
    pub fn len(&self) -> usize {
        self.score.len()
    }

    /// No columns?
    pub fn is_empty(&self) -> bool {
        self.score.is_empty()
    }

    /// Factorises `M` over a set of columns, most independent first, and leaves out those that the others and the base absorb.
    pub fn pivoted(&self, set: &[usize]) -> Pivoted {
        self.pivoted_in_turn(&[set])
    }

    /// The same over several sets, one beside those before it: what counts as absorbed of a set does not depend on whether it is factorised
    /// alone beside the others or together with them.
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
            factor.swap_rows(step, best);
            let pivot = diagonal[step].sqrt();
            factor[(step, step)] = pivot;
            let own = scale_of(columns[step]);
            // Column by column, which is how they are stored.
            let mut next: Vec<f64> = (step + 1..n)
                .map(|i| self.information[(columns[i], columns[step])] * scale_of(columns[i]) * own)
                .collect();
            for done in 0..step {
                let row = factor[(step, done)];
                let column = factor.column(done);
                for (value, other) in next.iter_mut().zip(column.rows(step + 1, n - step - 1).iter()) {
                    *value -= row * other;
                }
            }
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

    /// The columns of a set that are worth an estimate of their own: of each the largest plausible value (half of its range) would show beside the
    /// others. What is known worse is left out, the worst first: values in such a direction are noise for which the others have to make up, and
    /// a refit follows them along a curved valley.
    pub fn determined(&self, set: &[usize]) -> Vec<usize> {
        let mut kept = self.pivoted(set).kept;
        loop {
            let pivoted = self.pivoted(&kept);
            // Variance over that of the worst that would do.
            let excess = |(column, variance): (&usize, f64)| 4.0 * SHOWS * SHOWS * self.least[*column] * variance;
            let excess = pivoted.kept.iter().zip(pivoted.variances()).map(excess);
            let worst = excess.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, excess)| *excess > 1.0);
            kept = pivoted.kept;
            match worst {
                Some((worst, _)) if kept.len() > 1 => kept.remove(worst),
                _ => return kept,
            };
        }
    }

    /// `s'(M + I / variance)^-1 s` over the kept columns of a set: the drop of `v'Pv` that it brings where each value has a prior of that
    /// variance, in the units of the columns squared.
    pub fn drop_with_prior(&self, set: &[usize], variance: f64) -> f64 {
        let kept = self.pivoted(set).kept;
        let prior = |i: usize, j: usize| if i == j { 1.0 / variance } else { 0.0 };
        let own = |i: usize, j: usize| self.information[(kept[i], kept[j])] + prior(i, j);
        let score = DVector::from_fn(kept.len(), |i, _| self.score[kept[i]]);
        let factor = Cholesky::new(DMatrix::from_fn(kept.len(), kept.len(), own));
        factor.map_or(0.0, |factor| score.dot(&factor.solve(&score)))
    }

    /// The system beside what is taken in: random values first, then fixed sets in turn. Columns that are taken in keep no information.
    pub fn beside<S: AsRef<[usize]>>(&self, fixed: &[S], random: &[Penalised]) -> System {
        let mut system = self.clone();
        for values in random {
            system = system.beside_random(values);
        }
        if !fixed.is_empty() {
            system = system.beside_fixed(fixed);
        }
        system
    }

    fn beside_fixed<S: AsRef<[usize]>>(&self, sets: &[S]) -> System {
        let pivoted = self.pivoted_in_turn(sets);
        let n = pivoted.kept.len();
        let mut cross =
            DMatrix::from_fn(n, self.len(), |i, c| self.information[(pivoted.kept[i], c)] * pivoted.scale[i]);
        solve_lower(as_faer(&pivoted.factor), &mut cross);
        let mut system = self.less(&cross, &pivoted.white);
        system.chi_square -= pivoted.white.norm_squared();
        system.redundancy -= n as f64;
        sets.iter().for_each(|set| system.forget(set.as_ref()));
        system
    }

    fn beside_random(&self, values: &Penalised) -> System {
        let Some((lower, white)) = self.penalised(values) else { return self.clone() };
        let mut cross = DMatrix::from_fn(white.len(), self.len(), |i, c| self.information[(values.columns[i], c)]);
        solve_lower(lower.as_ref(), &mut cross);
        let mut system = self.less(&cross, &white);
        system.chi_square -= white.norm_squared();
        system
    }

    /// The drop of `v'Pv` that random values bring.
    pub fn drop_of_random(&self, values: &Penalised) -> f64 {
        self.penalised(values).map_or(0.0, |(_, white)| white.norm_squared())
    }

    /// Lower factor `L` of `M + I / variance` over random values, and `L^-1 s`. `None` where they have no variance: positive definite by their
    /// penalty, all others have it.
    fn penalised(&self, values: &Penalised) -> Option<(Mat<f64>, DVector<f64>)> {
        let set = &values.columns;
        if values.variance <= 0.0 {
            return None;
        }
        let penalty = |i: usize, j: usize| if i == j { 1.0 / values.variance } else { 0.0 };
        let own = Mat::from_fn(set.len(), set.len(), |i, j| self.information[(set[i], set[j])] + penalty(i, j));
        let lower = own.llt(Side::Lower).ok()?.L().to_owned();
        let mut white = DMatrix::from_fn(set.len(), 1, |i, _| self.score[set[i]]);
        solve_lower(lower.as_ref(), &mut white);
        Some((lower, white.column(0).into_owned()))
    }

    fn less(&self, cross: &DMatrix<f64>, white: &DVector<f64>) -> System {
        let mut system = self.clone();
        let n = self.len();
        let own = Arc::make_mut(&mut system.information);
        let information = MatMut::from_column_major_slice_mut(own.as_mut_slice(), n, n);
        let cross_ref = MatRef::from_column_major_slice(cross.as_slice(), cross.nrows(), n);
        let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
        matmul(information, lower, Accum::Add, cross_ref.transpose(), whole, cross_ref, whole, -1.0, Par::Seq);
        own.fill_upper_triangle_with_lower_triangle();
        system.score -= cross.tr_mul(white);
        system
    }

    fn forget(&mut self, set: &[usize]) {
        let information = Arc::make_mut(&mut self.information);
        for c in set {
            self.score[*c] = 0.0;
            information.row_mut(*c).fill(0.0);
            information.column_mut(*c).fill(0.0);
        }
    }
}

/// Replaces `right` by `L^-1 right`.
fn solve_lower(lower: MatRef<'_, f64>, right: &mut DMatrix<f64>) {
    let (n, columns) = (right.nrows(), right.ncols());
    let right = MatMut::from_column_major_slice_mut(right.as_mut_slice(), n, columns);
    solve_lower_triangular_in_place(lower, right, Par::Seq);
}

fn as_faer(matrix: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols())
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

    /// Columns of a small regression: `M = C'C`, `s = C'v`.
    pub fn regression(columns: &[&[f64]], v: &[f64]) -> System {
        let c = DMatrix::from_fn(v.len(), columns.len(), |i, j| columns[j][i]);
        let v = DVector::from_column_slice(v);
        System {
            score: c.transpose() * &v,
            information: (c.transpose() * &c).into(),
            length: (0..columns.len()).map(|j| c.column(j).norm_squared()).collect(),
            least: vec![0.0; columns.len()],
            chi_square: v.norm_squared(),
            redundancy: v.len() as f64,
        }
    }

    const A: [f64; 5] = [1.0, 1.0, 1.0, 1.0, 1.0];
    const B: [f64; 5] = [0.0, 1.0, 2.0, 3.0, 4.0];
    const V: [f64; 5] = [1.0, 3.0, 5.0, 7.0, 9.5];

    #[test]
    fn a_set_is_a_regression() {
        let system = regression(&[&A, &B], &V);
        let pivoted = system.pivoted(&[0, 1]);
        let estimate = pivoted.estimate();
        let of = |c: usize| estimate[pivoted.kept.iter().position(|k| *k == c).unwrap()];
        // The line through the points by hand: slope 2.1, value 0.9 at zero.
        assert_relative_eq!(of(0), 0.9, epsilon = 1e-12);
        assert_relative_eq!(of(1), 2.1, epsilon = 1e-12);
        assert_relative_eq!(pivoted.drop(), V.iter().map(|v| v * v).sum::<f64>() - 0.1, epsilon = 1e-10);
    }

    #[test]
    fn a_set_keeps_its_best_direction_however_much_the_base_takes_of_it() {
        let mut system = regression(&[&A, &B], &V);
        system.length.iter_mut().for_each(|length| *length *= 1e6);
        assert_eq!(system.pivoted(&[0, 1]).kept.len(), 1, "beside it the other is told by a millionth");
        system.length.iter_mut().for_each(|length| *length *= 1e6);
        assert!(system.pivoted(&[0]).kept.is_empty(), "rounding");
    }

    #[test]
    fn a_set_that_is_left_something_beside_another_is_in_their_factorisation_too() {
        let mut system = regression(&[&A, &B], &V);
        system.length[1] *= 1e6;
        let beside = system.beside(&[[0]], &[]);
        let together = system.pivoted_in_turn(&[[0], [1]]);
        assert_eq!(beside.pivoted(&[1]).kept, [1]);
        assert_eq!(together.kept, [0, 1]);
        assert_relative_eq!(together.estimate()[1], beside.pivoted(&[1]).estimate()[0], epsilon = 1e-12);
        let both = system.beside(&[[0], [1]], &[]);
        assert_eq!(both.redundancy, 3.0, "it counts when something else is judged beside both");
        assert_relative_eq!(both.chi_square, 0.1, epsilon = 1e-10);
        // The columns of one set that differ by as little are one.
        assert_eq!(system.pivoted(&[0, 1]).kept.len(), 1);
    }

    #[test]
    fn of_a_weak_direction_the_value_that_is_known_worst_is_left_out() {
        // Two columns that differ in one row of five: along the second minus ten times the first little is known.
        let steep: Vec<f64> = A.iter().zip([0.0, 0.0, 0.0, 0.0, 0.05]).map(|(a, b)| 0.1 * (a + b)).collect();
        let mut system = regression(&[&A, &steep, &B], &V);
        system.least = vec![1e-4; 3];
        let mut kept = system.determined(&[0, 1, 2]);
        kept.sort_unstable();
        assert_eq!(kept, [0, 2], "the second would be known to hundreds, ten times worse than the first");
        system.least = vec![0.0; 3];
        assert_eq!(system.determined(&[0, 1, 2]).len(), 3, "where nothing is said of its range");
    }

    #[test]
    fn beside_is_what_remains_of_a_regression() {
        let system = regression(&[&A, &B], &V);
        let beside = system.beside(&[[0]], &[]);
        let alone = beside.pivoted(&[1]);
        assert_relative_eq!(alone.estimate()[0], 2.1, epsilon = 1e-12);
        assert_relative_eq!(beside.chi_square - alone.drop(), 0.1, epsilon = 1e-10);
        assert_eq!(beside.redundancy, 4.0);
        assert!(beside.pivoted(&[0]).kept.is_empty(), "nothing is left of what is in");
    }

    #[test]
    fn absorbed_columns_are_left_out() {
        let twice: Vec<f64> = B.iter().map(|b| 2.0 * b).collect();
        let system = regression(&[&A, &B, &twice], &V);
        assert_eq!(system.pivoted(&[0, 1, 2]).kept.len(), 2);
        assert_relative_eq!(system.pivoted(&[1, 2]).drop(), system.pivoted(&[1]).drop(), epsilon = 1e-10);
    }

    #[test]
    fn random_values_shrink() {
        // One value of variance 1 under unit weight: M = 1, so half of the score is believed.
        let one = regression(&[&[1.0, 0.0], &[1.0, 1.0]], &[2.0, 0.0]);
        let beside = one.beside::<[usize; 0]>(&[], &[Penalised { columns: vec![0], variance: 1.0 }]);
        assert_relative_eq!(beside.score[1], 1.0, epsilon = 1e-12);
        assert_relative_eq!(beside.information[(1, 1)], 1.5, epsilon = 1e-12);
    }
}
