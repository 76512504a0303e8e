//! Cholesky factorisation of the reduced system: the image blocks dense within their envelope, or sparse where that is
//! wide, then the border by its Schur complement.

use super::dense::Dense;
use super::pattern::Pattern;
use super::structure::Structure;
use super::system::System;
use crate::math::pieces::{each, pieces};
use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Solve;
use faer::sparse::SparseColMatRef;
use faer::sparse::linalg::solvers::Llt as SparseLlt;
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Smallest diagonal entry of an unknown (in scaled units) that the damping and the scaling see: a column that vanishes
/// at the current state is damped as if it moved measurements by a thousandth of sigma per unit.
const SMALLEST_DIAGONAL: f64 = 1e-6;

/// Squared pivots below this share of the diagonal are rounding: a few thousand operations of 1e-16 each.
const SMALLEST_PIVOT: f64 = 1e-13;

enum Images {
    Dense(Dense),
    Sparse(SparseLlt<usize, f64>),
}

impl Images {
    /// Replaces `right` by `A^-1 right`.
    fn solve(&self, right: MatMut<'_, f64>) {
        match self {
            Images::Dense(factor) => factor.solve(right),
            Images::Sparse(factor) => factor.solve_in_place(right),
        }
    }

    /// The same on one thread.
    fn solve_together(&self, right: MatMut<'_, f64>) {
        match self {
            Images::Dense(factor) => factor.solve_together(right),
            Images::Sparse(factor) => factor.solve_in_place(right),
        }
    }
}

/// Columns that are solved for together: the factor is read once for all of them.
const TOGETHER: usize = 32;

/// Where a factorisation broke down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Breakdown {
    /// Unknown of the image blocks (rank order); `usize::MAX` when the factorisation does not tell.
    Images(usize),
    /// The border, given the images.
    Border,
}

fn scaling(diagonal: &[f64]) -> Vec<f64> {
    diagonal.iter().map(|d| d.max(SMALLEST_DIAGONAL).sqrt().recip()).collect()
}

/// Image part, factorised, with its scaling.
struct ImageFactor {
    images: Images,
    scale: Vec<f64>,
}

fn factorise_images(
    structure: &Structure,
    system: &System,
    pattern: Option<&Pattern>,
    damping: f64,
) -> Result<ImageFactor, Breakdown> {
    let (dim, n) = (structure.dim, structure.images * structure.dim);
    let scale = scaling(&system.diagonal_images);
    let entry = |slot: usize, k: usize, l: usize, row: usize, column: usize| {
        if row == column && structure.image_unknowns[row] == usize::MAX {
            return 1.0;
        }
        let value = system.block(slot, dim, k, l) * scale[row] * scale[column];
        if row == column { value + damping } else { value }
    };
    let images = match pattern {
        None => {
            let last = |a: usize| structure.slot_column[structure.row_start[a + 1] - 1] as usize;
            let ends: Vec<usize> = (0..n).map(|column| (last(column / dim) + 1) * dim).collect();
            let fill = |first: usize, mut columns: MatMut<'_, f64>| {
                for number in 0..columns.ncols() {
                    let (a, k) = ((first + number) / dim, (first + number) % dim);
                    for slot in structure.row_start[a]..structure.row_start[a + 1] {
                        let b = structure.slot_column[slot] as usize;
                        for l in if a == b { k } else { 0 }..dim {
                            let row = b * dim + l;
                            columns[(row - first, number)] = entry(slot, k, l, first + number, row);
                        }
                    }
                }
            };
            let factor = Dense::new(&ends, fill).map_err(Breakdown::Images)?;
            if let Some(pivot) = factor.diagonal().position(|diagonal| diagonal.powi(2) < SMALLEST_PIVOT) {
                return Err(Breakdown::Images(pivot));
            }
            Images::Dense(factor)
        }
        Some(pattern) => {
            let mut values = Vec::with_capacity(pattern.symbolic.compute_nnz());
            for a in 0..structure.images {
                for k in 0..dim {
                    for slot in structure.row_start[a]..structure.row_start[a + 1] {
                        let b = structure.slot_column[slot] as usize;
                        for l in if a == b { k } else { 0 }..dim {
                            values.push(entry(slot, k, l, a * dim + k, b * dim + l));
                        }
                    }
                }
            }
            let matrix = SparseColMatRef::new(pattern.symbolic.as_ref(), &values);
            let factor = SparseLlt::try_new_with_symbolic(pattern.factorisation.clone(), matrix, Side::Lower)
                .map_err(|_| Breakdown::Images(usize::MAX))?;
            Images::Sparse(factor)
        }
    };
    Ok(ImageFactor { images, scale })
}

/// The border after elimination of the images, everything Jacobi-scaled: `scaled unknown = unknown / scale`.
pub struct ReducedBorder {
    images: Images,
    scale_images: Vec<f64>,
    /// Scaling of the border.
    pub scale: Vec<f64>,
    /// `A^-1 B`, image unknowns x border.
    solved_strip: Mat<f64>,
    /// Schur complement `C - B' A^-1 B`. The diagonal of the border before any elimination is one.
    pub matrix: DMatrix<f64>,
    /// Right-hand side after elimination.
    pub rhs: DVector<f64>,
    /// `A^-1` times the images' right-hand side.
    solved_rhs: Vec<f64>,
}

impl ReducedBorder {
    /// Eliminates the images from `S + damping diag(N)`, `N` the system before elimination of the points.
    pub fn new(
        structure: &Structure,
        system: &System,
        pattern: Option<&Pattern>,
        damping: f64,
    ) -> Result<Self, Breakdown> {
        let (n, m) = (structure.images * structure.dim, structure.border.len());
        let ImageFactor { images, scale: scale_images } = factorise_images(structure, system, pattern, damping)?;
        let scale = scaling(&system.diagonal_border);
        let strip = Mat::<f64>::from_fn(n, m, |i, j| system.strip(i, j) * scale_images[i] * scale[j]);
        let scaled: Vec<f64> = system.rhs_images.iter().zip(&scale_images).map(|(r, s)| r * s).collect();
        // The right-hand side is one column more.
        let mut solved_strip = Mat::<f64>::from_fn(n, m + 1, |i, j| if j < m { strip[(i, j)] } else { scaled[i] });
        images.solve(solved_strip.as_mut());
        let solved_rhs = (0..n).map(|i| solved_strip[(i, m)]).collect();
        solved_strip.truncate(n, m);
        let product = strip.transpose() * &solved_strip;
        let matrix = DMatrix::from_fn(m, m, |i, j| {
            let (a, b) = (i.min(j), i.max(j));
            let damped = if i == j { damping } else { 0.0 };
            system.border(a, b) * scale[i] * scale[j] + damped - 0.5 * (product[(i, j)] + product[(j, i)])
        });
        let rhs = DVector::from_fn(m, |j, _| {
            let carried: f64 = (0..n).map(|i| solved_strip[(i, j)] * scaled[i]).sum();
            system.rhs_border[j] * scale[j] - carried
        });
        Ok(Self { images, scale_images, scale, solved_strip, matrix, rhs, solved_rhs })
    }

    /// Image unknowns that go with a border (Jacobi-scaled): `A^-1 (r - B border)` with `with_rhs`, else `-A^-1 B
    /// border`. Unscaled.
    pub fn images_of(&self, border: &DVector<f64>, with_rhs: bool) -> Vec<f64> {
        (0..self.scale_images.len())
            .map(|i| {
                let carried: f64 = (0..border.len()).map(|j| self.solved_strip[(i, j)] * border[j]).sum();
                let own = if with_rhs { self.solved_rhs[i] } else { 0.0 };
                (own - carried) * self.scale_images[i]
            })
            .collect()
    }
}

/// A factorised reduced system.
pub struct Factor {
    /// The border without the images.
    pub reduced: ReducedBorder,
    border_factor: Cholesky<f64, Dyn>,
}

impl Factor {
    /// Factorises `S + damping diag(N)`, `N` the system before elimination of the points.
    pub fn new(
        structure: &Structure,
        system: &System,
        pattern: Option<&Pattern>,
        damping: f64,
    ) -> Result<Self, Breakdown> {
        Self::of(ReducedBorder::new(structure, system, pattern, damping)?).ok_or(Breakdown::Border)
    }

    /// Factorises a reduced border; `None` where it is not positive definite.
    pub fn of(reduced: ReducedBorder) -> Option<Self> {
        let border_factor = Cholesky::new(reduced.matrix.clone())?;
        Some(Self { reduced, border_factor })
    }

    /// Solves for the unknowns of the images (rank order) and of the border.
    pub fn solve(&self) -> (Vec<f64>, Vec<f64>) {
        let border = self.border_factor.solve(&self.reduced.rhs);
        let images = self.reduced.images_of(&border, true);
        (images, border.iter().zip(&self.reduced.scale).map(|(x, s)| x * s).collect())
    }

    /// Replaces columns over all reduced unknowns (images by rank, then border; scaled units) by `S^-1` times them.
    /// Columns may be thousands: beside them nothing of that size is made.
    pub fn solve_columns(&self, columns: MatMut<'_, f64>) {
        let ReducedBorder { images, scale_images, scale: scale_border, solved_strip, .. } = &self.reduced;
        let (n, m) = (scale_images.len(), scale_border.len());
        let scale = [&scale_images[..], scale_border].concat();
        let scaled = |columns: &mut MatMut<'_, f64>| {
            for mut column in columns.as_mut().col_iter_mut() {
                (0..n + m).for_each(|i| column[i] *= scale[i]);
            }
        };
        each(pieces(columns, TOGETHER, MatMut::split_at_col_mut, |columns| columns.ncols()), |_, mut columns| {
            scaled(&mut columns);
            let count = columns.ncols();
            let (mut top, mut bottom) = columns.as_mut().split_at_row_mut(n);
            let carried = solved_strip.transpose() * top.as_ref();
            let border = self.border_factor.solve(&DMatrix::from_fn(m, count, |l, c| bottom[(l, c)] - carried[(l, c)]));
            bottom.copy_from(MatRef::from_column_major_slice(border.as_slice(), m, count));
            images.solve_together(top.as_mut());
            matmul(top, Accum::Add, solved_strip, bottom.as_ref(), -1.0, Par::Seq);
            scaled(&mut columns);
        });
    }

    /// Covariance of the border's unknowns (scaled units).
    pub fn border_covariance(&self) -> DMatrix<f64> {
        let inverse = self.border_factor.inverse();
        DMatrix::from_fn(inverse.nrows(), inverse.ncols(), |i, j| {
            inverse[(i, j)] * self.reduced.scale[i] * self.reduced.scale[j]
        })
    }

    /// Covariance of the image unknowns (rank order) and, below, its block with the border (both scaled units): the
    /// whole inverse, `(n + m) x (n + m)`. Memory: `8 (n + m)^2` bytes.
    pub fn inverse(&self) -> Mat<f64> {
        let ReducedBorder { images, scale_images, scale: scale_border, solved_strip, .. } = &self.reduced;
        let (n, m) = (scale_images.len(), scale_border.len());
        let mut inverse_images = Mat::<f64>::identity(n, n);
        images.solve(inverse_images.as_mut());
        let border = self.border_factor.inverse();
        let border = Mat::<f64>::from_fn(m, m, |i, j| border[(i, j)]);
        let carried = solved_strip * &border;
        let correction = &carried * solved_strip.transpose();
        let scale = |i: usize| if i < n { scale_images[i] } else { scale_border[i - n] };
        Mat::from_fn(n + m, n + m, |i, j| {
            let value = match (i < n, j < n) {
                (true, true) => inverse_images[(i, j)] + correction[(i, j)],
                (true, false) => -carried[(i, j - n)],
                (false, true) => -carried[(j, i - n)],
                (false, false) => border[(i - n, j - n)],
            };
            value * scale(i) * scale(j)
        })
    }
}
