//! Score and information of columns: the sums over all rows, less what the base takes of them.

use super::families::Families;
use super::sums::Sums;
use super::{ColumnPlace, Columns, NullModel};
use crate::adjust::AdjustError;
use crate::math::pieces::{each, pieces};
use crate::math::symmetric::mirror_lower;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par, Scale};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Columns of a product that one task computes.
const TASK_COLUMNS: usize = 64;
/// Columns that are solved for at a time: what is kept beside the matrix of all columns.
const BLOCK_COLUMNS: usize = 8 * TASK_COLUMNS;

/// Score and information of columns for unit weight; columns of effects in scaled units.
#[derive(Debug, Clone)]
pub struct ScoreSystem {
    /// `s`.
    pub score: DVector<f64>,
    /// `M`; its diagonal alone as a column vector where that was asked for; not a number for columns of two families.
    /// Shared: of thousands of columns it is the largest that there is.
    pub information: Arc<DMatrix<f64>>,
    /// Squared length of each column before anything is taken out.
    pub length: Vec<f64>,
    /// Sum over the points of the squared part that each has of a score.
    pub squares: Vec<f64>,
    /// Information of each column while cameras and poses are held: what `squares` has in the mean where points are
    /// independent.
    pub held: Vec<f64>,
    /// How the base's unknowns follow one unit of each column of an effect: images by rank, then border (scaled units),
    /// column by column.
    pub(super) moves: Mat<f64>,
}

impl NullModel {
    /// Score and information of the columns of effects and of `extra`, on the threads of the current pool; `families`
    /// of those of effects beside the own ones of `extra`. `each_alone`: of the information its diagonal.
    pub(super) fn score_system(
        &self,
        extra: &dyn Columns,
        families: &[Range<usize>],
        each_alone: bool,
    ) -> Result<ScoreSystem, AdjustError> {
        let source = self.source(extra);
        let [effects_dense, effects_local] = self.effect_columns;
        let dense = (0..extra.dense()).map(|k| ColumnPlace::Dense(effects_dense + k));
        let local = (0..extra.local()).map(|k| ColumnPlace::Local(effects_local + k));
        let places = self.places.iter().copied().chain(dense).chain(local);
        // Columns of the sums that the caller's are: behind the base's border.
        let border = self.structure.border.len();
        let places: Vec<ColumnPlace> = places
            .map(|place| match place {
                ColumnPlace::Dense(k) => ColumnPlace::Dense(border + k),
                local => local,
            })
            .collect();
        let behind = self.columns.len();
        let further = extra.families().into_iter().map(|columns| behind + columns.start..behind + columns.end);
        let families: Vec<Range<usize>> = families.iter().cloned().chain(further).collect();
        let families = Families::new(&families, &places, (border, source.dense()), source.local());
        let mut sums = Sums::of(&source, &families, each_alone)?;
        let with_base = self.with_base(&sums, &places);
        // Of hundreds of images and thousands of columns these are the largest of all.
        sums.forget_images();
        let of_each = |dense: &[f64], local: &[f64]| -> Vec<f64> {
            let of = |place: &ColumnPlace| match *place {
                ColumnPlace::Dense(k) => dense[k],
                ColumnPlace::Local(k) => local[k],
            };
            places.iter().map(of).collect()
        };
        let length = of_each(&sums.length_dense, &sums.length_local);
        let squares = of_each(&sums.squares_dense, &sums.squares_local);
        let mut score = of_each(&sums.score_dense, &sums.score_local);
        let held: Vec<f64> = places.iter().map(|place| sums.product(*place, *place)).collect();
        let q = places.len();
        let mut information = if each_alone {
            DMatrix::from_column_slice(q, 1, &held)
        } else {
            // Zeros as the operating system gives them: the first to write a page is the thread that fills it.
            let mut lower = DMatrix::from_vec(q, q, vec![0.0; q * q]);
            lower.as_mut_slice().par_chunks_mut(q.max(1)).enumerate().for_each(|(j, column)| {
                for (i, entry) in column.iter_mut().enumerate().skip(j) {
                    *entry = if families.apart(i, j) { f64::NAN } else { sums.product(places[i], places[j]) };
                }
            });
            lower
        };
        drop(sums);
        let moves = self.take_base(with_base, &mut score, &mut information);
        if !each_alone {
            mirror_lower(&mut information);
        }
        // A copy of some columns, since what is cut off would stay in memory.
        let own = self.columns.len();
        let moves = if own < q { moves.subcols(0, own).to_owned() } else { moves };
        let (score, information) = (DVector::from_vec(score), Arc::new(information));
        Ok(ScoreSystem { score, information, length, squares, held, moves })
    }

    /// Takes what the base absorbs from `C'v` and `C'C` (its lower triangle, or its diagonal as a column vector), which
    /// leaves `s` and `M`. Gives `-S^-1 B` of `B`, the products of the base's unknowns with the columns, in its place:
    /// block by block, for of many images `B` is the largest matrix.
    fn take_base(&self, mut with_base: Mat<f64>, score: &mut [f64], information: &mut DMatrix<f64>) -> Mat<f64> {
        let q = with_base.ncols();
        let rhs = self.base.normal.rhs();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        for first in (0..q).step_by(BLOCK_COLUMNS) {
            let count = BLOCK_COLUMNS.min(q - first);
            let mut solved = with_base.subcols(first, count).to_owned();
            self.base.normal.solve_columns(solved.as_mut());
            let scores = score[first..][..count].par_iter_mut().enumerate();
            scores.for_each(|(c, score)| *score -= dot(solved.col_as_slice(c), &rhs));
            if information.ncols() == 1 {
                let diagonal = information.as_mut_slice()[first..][..count].par_iter_mut().enumerate();
                diagonal.for_each(|(c, own)| *own -= dot(with_base.col_as_slice(first + c), solved.col_as_slice(c)));
            } else {
                take_product(information, first, with_base.subcols(first, q - first), solved.as_ref());
            }
            // Further blocks are multiplied with the columns behind them.
            with_base.subcols_mut(first, count).copy_from(Scale(-1.0) * &solved);
        }
        with_base
    }

    /// Products of the base's reduced unknowns (images by rank, then border) with columns.
    fn with_base(&self, sums: &Sums, places: &[ColumnPlace]) -> Mat<f64> {
        let (dim, border) = (self.structure.dim, self.structure.border.len());
        let n = self.structure.images * dim;
        let mut with_base = Mat::zeros(n + border, places.len());
        let columns = pieces(with_base.as_mut(), TASK_COLUMNS, MatMut::split_at_col_mut, |columns| columns.ncols());
        each(columns, |number, mut columns| {
            for (c, place) in places[number * TASK_COLUMNS..][..columns.ncols()].iter().enumerate() {
                let mut column = columns.as_mut().col_mut(c);
                match *place {
                    ColumnPlace::Dense(k) => {
                        (0..n).for_each(|i| column[i] = sums.image_dense[i * sums.dense + k]);
                        (0..border).for_each(|l| column[n + l] = sums.dense_dense[l * sums.dense + k]);
                    }
                    ColumnPlace::Local(k) => {
                        (0..n).for_each(|i| column[i] = sums.image_local(i, dim, k));
                        (0..border).for_each(|l| column[n + l] = sums.local_dense[k * sums.dense + l]);
                    }
                }
            }
        });
        with_base
    }
}

/// Takes `a'b` from the columns of `matrix` that begin at `first`, below its diagonal; the same sums for every number
/// of threads.
fn take_product(matrix: &mut DMatrix<f64>, first: usize, a: MatRef<'_, f64>, b: MatRef<'_, f64>) {
    let q = matrix.ncols();
    let columns = &mut matrix.as_mut_slice()[first * q..][..b.ncols() * q];
    columns.par_chunks_mut((TASK_COLUMNS * q).max(1)).enumerate().for_each(|(task, columns)| {
        let (own, count) = (task * TASK_COLUMNS, columns.len() / q.max(1));
        let below = q - first - own;
        let columns = MatMut::from_column_major_slice_mut(columns, q, count).subrows_mut(first + own, below);
        let (left, right) = (a.subcols(own, below), b.subcols(own, count));
        matmul(columns, Accum::Add, left.transpose(), right, -1.0, Par::Seq);
    });
}
