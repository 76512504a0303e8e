//! Score and information of columns, and what remains of both when some of them are taken for granted.

use super::pivoted::Pivoted;
use crate::math::pieces::{each, pieces};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Standard deviations at which a value shows for certain among some dozens of candidates: 4.1 for one in 25000, 0.84
/// for a power of 80 %.
const SHOWS: f64 = 4.94;

/// Columns of the information that are computed together.
const TOGETHER: usize = 64;

/// Score `s = C'Qv` and information `M = C'QC` of columns `C` at zero, for unit weight.
#[derive(Debug, Clone)]
pub struct System {
    /// `s`.
    pub score: DVector<f64>,
    /// `M`, shared until it changes.
    pub information: Arc<DMatrix<f64>>,
    /// Squared length of each column before anything was taken out of it.
    pub length: Vec<f64>,
    /// Least information of a column for its value to be known to its plausible range, at unit weight; zero where
    /// there is none.
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

impl System {
    /// Number of columns.
    pub fn len(&self) -> usize {
        self.score.len()
    }

    /// No columns?
    pub fn is_empty(&self) -> bool {
        self.score.is_empty()
    }

    /// The system of these columns alone.
    pub fn excerpt(&self, columns: &[usize]) -> System {
        let of = |values: &[f64]| columns.iter().map(|column| values[*column]).collect();
        let n = columns.len();
        System {
            score: DVector::from_fn(n, |i, _| self.score[columns[i]]),
            information: Arc::new(DMatrix::from_fn(n, n, |i, j| self.information[(columns[i], columns[j])])),
            length: of(&self.length),
            least: of(&self.least),
            ..*self
        }
    }

    /// The columns of a set that are worth an estimate of their own: of each the largest plausible value (half of its
    /// range) would show beside the others. What is known worse is left out, the worst first: values in such a
    /// direction are noise for which the others have to make up, and a refit follows them along a curved valley.
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

    /// The system beside what is taken in: random values first, then fixed sets in turn. Columns that are taken in
    /// keep no information.
    pub fn beside<S: AsRef<[usize]>>(&self, fixed: &[S], random: &[Penalised]) -> System {
        let mut system = self.clone();
        for values in random {
            system = system.beside_random(values);
        }
        let laws = system.pivoted_in_turn(fixed);
        system.beside_laws(fixed, &laws)
    }

    /// The system beside fixed sets, which are factorised already.
    pub fn beside_laws<S: AsRef<[usize]>>(self, sets: &[S], pivoted: &Pivoted) -> System {
        if sets.is_empty() {
            return self;
        }
        let n = pivoted.kept.len();
        let mut cross =
            DMatrix::from_fn(n, self.len(), |i, c| self.information[(pivoted.kept[i], c)] * pivoted.scale[i]);
        solve_lower(as_faer(&pivoted.factor), &mut cross);
        let mut system = self.less(&cross, &pivoted.white);
        system.redundancy -= n as f64;
        sets.iter().for_each(|set| system.forget(set.as_ref()));
        system
    }

    fn beside_random(self, values: &Penalised) -> System {
        let Some((lower, white)) = self.penalised(values) else { return self };
        let mut cross = DMatrix::from_fn(white.len(), self.len(), |i, c| self.information[(values.columns[i], c)]);
        solve_lower(lower.as_ref(), &mut cross);
        self.less(&cross, &white)
    }

    /// The drop of `v'Pv` that random values bring.
    pub fn drop_of_random(&self, values: &Penalised) -> f64 {
        self.penalised(values).map_or(0.0, |(_, white)| white.norm_squared())
    }

    /// `ln|I + variance M|` over random values: what the likelihood pays for their freedom.
    pub fn log_determinant(&self, values: &Penalised) -> f64 {
        let n = values.columns.len() as f64;
        self.penalised(values).map_or(0.0, |(lower, _)| {
            n * values.variance.ln() + 2.0 * (0..lower.nrows()).map(|k| lower[(k, k)].ln()).sum::<f64>()
        })
    }

    /// Lower factor `L` of `M + I / variance` over random values, and `L^-1 s`. `None` where they have no variance:
    /// positive definite by their penalty, all others have it.
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

    /// Beside columns of which `cross = L^-1 M` and `white = L^-1 s`, `L` their factor.
    fn less(self, cross: &DMatrix<f64>, white: &DVector<f64>) -> System {
        let n = self.len();
        // Zeros as the operating system gives them: the first to write a page is the thread that fills it.
        let mut information = DMatrix::from_vec(n, n, vec![0.0; n * n]);
        let rest = MatMut::from_column_major_slice_mut(information.as_mut_slice(), n, n);
        let (own, cross_ref) = (as_faer(&self.information), as_faer(cross));
        each(pieces(rest, TOGETHER, MatMut::split_at_col_mut, |rest| rest.ncols()), |number, mut rest| {
            let (first, count) = (number * TOGETHER, rest.ncols());
            rest.copy_from(own.subcols(first, count));
            matmul(rest, Accum::Add, cross_ref.transpose(), cross_ref.subcols(first, count), -1.0, Par::Seq);
        });
        System {
            score: &self.score - cross.tr_mul(white),
            information: Arc::new(information),
            chi_square: self.chi_square - white.norm_squared(),
            ..self
        }
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
    each(pieces(right, TOGETHER, MatMut::split_at_col_mut, |right| right.ncols()), |_, right| {
        solve_lower_triangular_in_place(lower, right, Par::Seq);
    });
}

fn as_faer(matrix: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols())
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

    #[test]
    fn of_many_columns_the_same_remains_on_any_number_of_threads() {
        let (rows, count) = (3 * TOGETHER, 2 * TOGETHER + 5);
        let wave = |i: usize, j: usize| ((1 + i * 7 + j * 13) as f64).sin();
        let columns: Vec<Vec<f64>> = (0..count).map(|j| (0..rows).map(|i| wave(i, j * j)).collect()).collect();
        let v: Vec<f64> = (0..rows).map(|i| wave(i, 3)).collect();
        let system = regression(&columns.iter().map(Vec::as_slice).collect::<Vec<_>>(), &v);
        let taken = [2, TOGETHER + 1];
        let alone = system.beside(&[taken], &[]);
        for threads in [1, 2, 4] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let beside = pool.install(|| system.beside(&[taken], &[]));
            assert!(beside.information == alone.information && beside.score == alone.score, "{threads} threads");
        }
        // By hand, of columns in every piece: M_ab - M_ak (M_kk)^-1 M_kb.
        let own = system.information.select_rows(&taken).select_columns(&taken).try_inverse().expect("independent");
        for (a, b) in [(0, 1), (5, TOGETHER), (TOGETHER + 3, count - 1), (count - 1, count - 2)] {
            let cross = |c: usize| DVector::from_fn(taken.len(), |i, _| system.information[(taken[i], c)]);
            let by_hand = system.information[(a, b)] - cross(a).dot(&(&own * cross(b)));
            // Sums of some hundred products of one.
            assert_relative_eq!(alone.information[(a, b)], by_hand, epsilon = 1e-10);
            assert_relative_eq!(alone.information[(b, a)], by_hand, epsilon = 1e-10);
        }
    }
}
