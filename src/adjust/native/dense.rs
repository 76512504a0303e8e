//! Cholesky factorisation of a dense matrix in panels: what is right of a panel is split among the threads of the
//! current pool, in pieces that do not depend on their number, so that neither does the result. Outside of any pool one
//! thread does it all.
//!
//! Images see what their neighbours along the block see, and nothing far away: a column is zero from some row on. So is
//! its column of `L`, where no column before it goes farther, and those rows are not even kept (the envelope of George
//! and Liu 1981, by panels).

use crate::math::pieces::{both, each, pieces};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Columns of a panel: products of this depth run at the speed of large ones, and what a panel itself takes, on one
/// thread, is little.
const PANEL: usize = 64;
/// Right-hand sides that are solved for at a time: a vector register.
const SOLVED: usize = 8;

/// `L` of `A = L L'`.
pub struct Dense {
    panels: Vec<Panel>,
}

/// Columns that are factorised at a time.
struct Panel {
    /// The first of them.
    first: usize,
    /// Row after the last one that is not zero.
    end: usize,
    /// `first..end` by the columns: their square, and what is below.
    columns: Mat<f64>,
}

impl Panel {
    /// Those of a matrix whose column `j` is zero from row `ends[j]` on, each for [`Self::columns`] of zeros.
    fn all(ends: &[usize]) -> Vec<Self> {
        let mut end = 0;
        let panel = |(number, ends): (usize, &[usize])| {
            let first = number * PANEL;
            // What a column has, those to the right of it get.
            end = ends.iter().fold(end.max(first + ends.len()), |end, of_column| end.max(*of_column));
            Self { first, end, columns: Mat::new() }
        };
        ends.chunks(PANEL).enumerate().map(panel).collect()
    }

    /// How many columns.
    fn size(&self) -> usize {
        self.columns.ncols()
    }

    /// The square, and what is below.
    fn split(&self) -> (MatRef<'_, f64>, MatRef<'_, f64>) {
        self.columns.as_ref().split_at_row(self.size())
    }

    /// Of a right-hand side: the rows of its own columns, and those below.
    fn rows<'a>(&self, right: MatMut<'a, f64>) -> (MatMut<'a, f64>, MatMut<'a, f64>) {
        right.subrows_mut(self.first, self.end - self.first).split_at_row_mut(self.size())
    }

    /// Its columns of `L`, once all panels before it are taken from it.
    ///
    /// # Errors
    /// The row of the first pivot that is not positive.
    fn factorise(&mut self) -> Result<(), usize> {
        let size = self.size();
        let (mut square, below) = self.columns.as_mut().split_at_row_mut(size);
        let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(size, Par::Seq, Default::default()));
        let (stack, regularisation) = (MemStack::new(&mut memory), LltRegularization::default());
        cholesky_in_place(square.as_mut(), regularisation, Par::Seq, stack, Default::default())
            .map_err(|LltError::NonPositivePivot { index }| self.first + index)?;
        let square = square.as_ref();
        each(pieces(below, PANEL, MatMut::split_at_row_mut, |rows| rows.nrows()), |_, rows| {
            solve_lower_triangular_in_place(square, rows.transpose_mut(), Par::Seq);
        });
        Ok(())
    }

    /// Takes the products of a finished panel before it, from the diagonal on.
    fn take(&mut self, before: &Panel) {
        let (_, below) = before.split();
        let left = below.get(self.first - before.first - before.size().., ..);
        let (rows, count) = (left.nrows(), self.size().min(left.nrows()));
        let columns = self.columns.submatrix_mut(0, 0, rows, count);
        matmul(columns, Accum::Add, left, left.subrows(0, count).transpose(), -1.0, Par::Seq);
    }
}

impl Dense {
    /// Factorises a matrix (n x n) whose column `j` is zero from row `ends[j]` on. `fill` is given the number of a
    /// column and zeros for so many columns from there on, whose first row is that of the diagonal; it puts the lower
    /// triangle there.
    ///
    /// # Errors
    /// The row of the first pivot that is not positive.
    pub fn new(ends: &[usize], fill: impl Fn(usize, MatMut<'_, f64>) + Sync) -> Result<Self, usize> {
        let mut panels = Panel::all(ends);
        each(panels.iter_mut().collect(), |_, panel: &mut Panel| {
            panel.columns = Mat::zeros(panel.end - panel.first, PANEL.min(ends.len() - panel.first));
            fill(panel.first, panel.columns.as_mut());
        });
        let mut open = &mut panels[..];
        if let Some(first) = open.first_mut() {
            first.factorise()?;
        }
        while let Some((panel, behind)) = open.split_first_mut() {
            if let Some((next, others)) = behind.split_first_mut() {
                let reached = others.iter_mut().take_while(|other| other.first < panel.end).collect();
                // The next one is finished while the others still wait for it: nobody is idle while a square is
                // factorised.
                let finish = || {
                    next.take(panel);
                    next.factorise()
                };
                both(finish, || each(reached, |_, other: &mut Panel| other.take(panel))).0?;
            }
            open = behind;
        }
        Ok(Self { panels })
    }

    /// Diagonal of `L`.
    pub fn diagonal(&self) -> impl Iterator<Item = f64> {
        self.panels.iter().flat_map(|panel| (0..panel.size()).map(|k| panel.columns[(k, k)]))
    }

    /// Replaces `right` (n x any) by `A^-1 right`.
    pub fn solve(&self, right: MatMut<'_, f64>) {
        let pieces = pieces(right, SOLVED, MatMut::split_at_col_mut, |right| right.ncols());
        each(pieces, |_, right| self.solve_together(right));
    }

    /// The same on one thread, which reads the factor once.
    pub fn solve_together(&self, mut right: MatMut<'_, f64>) {
        for panel in &self.panels {
            let (square, below) = panel.split();
            let (mut own, rest) = panel.rows(right.as_mut());
            solve_lower_triangular_in_place(square, own.as_mut(), Par::Seq);
            matmul(rest, Accum::Add, below, own.as_ref(), -1.0, Par::Seq);
        }
        for panel in self.panels.iter().rev() {
            let (square, below) = panel.split();
            let (mut own, rest) = panel.rows(right.as_mut());
            matmul(own.as_mut(), Accum::Add, below.transpose(), rest.as_ref(), -1.0, Par::Seq);
            solve_upper_triangular_in_place(square.transpose(), own, Par::Seq);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Side;

    /// A positive definite matrix of moderate condition.
    fn matrix(n: usize) -> Mat<f64> {
        let wave = |i: usize, j: usize| ((1 + i * 7 + j * 13) as f64).sin();
        let root = Mat::<f64>::from_fn(n, n, wave);
        &root * root.transpose() + Mat::<f64>::identity(n, n)
    }

    /// Nothing is known of its zeros.
    fn factor(matrix: Mat<f64>) -> Result<Dense, usize> {
        let n = matrix.nrows();
        Dense::new(&vec![n; n], |first, columns| fill(&matrix, first, columns))
    }

    fn fill(matrix: &Mat<f64>, first: usize, mut columns: MatMut<'_, f64>) {
        let (rows, count) = (columns.nrows(), columns.ncols());
        columns.copy_from(matrix.as_ref().submatrix(first, first, rows, count));
    }

    fn solved(n: usize, threads: usize) -> Mat<f64> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let mut right = Mat::<f64>::from_fn(n, 2 * SOLVED + 1, |i, j| (i + j) as f64);
        pool.install(|| factor(matrix(n)).expect("positive definite").solve(right.as_mut()));
        right
    }

    #[test]
    fn rows_that_a_column_does_not_reach_are_not_read() {
        let n = 3 * PANEL + 7;
        for reach in [1, 30, PANEL, 2 * PANEL + 3] {
            // Columns that go less far than some before them, too.
            let ends: Vec<usize> = (0..n).map(|j| (j + 1 + reach * ((1 + j * 7) % 5) / 4).min(n)).collect();
            let inside = |i: usize, j: usize| i.max(j) < ends[i.min(j)];
            let mut banded = matrix(n);
            // Larger on the diagonal than all others of the row together: positive definite with any of them zero.
            let sum: f64 = (0..n).map(|i| (0..n).map(|j| banded[(i, j)].abs()).sum::<f64>()).fold(0.0, f64::max);
            banded = Mat::from_fn(n, n, |i, j| match inside(i, j) {
                true => banded[(i, j)] + if i == j { sum } else { 0.0 },
                false => 0.0,
            });
            // Above the diagonal, and below what the columns up to the end of its panel reach, no number at all: read,
            // it would be in the solution.
            let reached = |j: usize| ends[..n.min((j / PANEL + 1) * PANEL)].iter().max().copied();
            let unread = |i: usize, j: usize| if i < j || Some(i) >= reached(j) { f64::NAN } else { banded[(i, j)] };
            let given = Mat::<f64>::from_fn(n, 3, |i, j| (i + j) as f64);
            let (mut found, mut wanted) = (given.clone(), given.clone());
            factor(banded.clone()).expect("positive definite").solve(wanted.as_mut());
            let with_nothing = Mat::from_fn(n, n, unread);
            let of_envelope = Dense::new(&ends, |first, columns| fill(&with_nothing, first, columns));
            of_envelope.expect("positive definite").solve(found.as_mut());
            // A condition of a few units, and sums of n numbers.
            assert!((&found - &wanted).norm_max() < 1e-13 * wanted.norm_max(), "{reach}");
            assert!((&banded * &found - &given).norm_max() < 1e-13 * n as f64 * given.norm_max(), "{reach}");
        }
    }

    #[test]
    fn products_of_the_solution_are_the_right_hand_side() {
        for n in [1, 5, PANEL - 1, PANEL, PANEL + 1, 3 * PANEL + 7] {
            let right = matrix(n) * solved(n, 1);
            let wanted = Mat::<f64>::from_fn(n, 2 * SOLVED + 1, |i, j| (i + j) as f64);
            // A condition of some n^2 and sums of n numbers.
            assert!((&right - &wanted).norm_max() < 1e-8 * (1 + n) as f64, "{n}: {:e}", (&right - &wanted).norm_max());
        }
    }

    #[test]
    fn the_same_bytes_on_any_number_of_threads() {
        let [one, two, four] = [1, 2, 4].map(|threads| solved(3 * PANEL + 7, threads));
        assert!(one == two && one == four);
        let mut alone = Mat::<f64>::from_fn(one.nrows(), one.ncols(), |i, j| (i + j) as f64);
        factor(matrix(one.nrows())).expect("positive definite").solve(alone.as_mut());
        assert!(one == alone, "outside of a pool");
    }

    #[test]
    fn the_first_pivot_that_is_not_positive_is_named() {
        for row in [0, 3, PANEL, PANEL + 5, 2 * PANEL + 1] {
            let mut broken = matrix(3 * PANEL);
            broken[(row, row)] -= 1e6;
            assert_eq!(factor(broken.clone()).err(), Some(row));
            assert!(broken.llt(Side::Lower).is_err());
        }
    }
}
