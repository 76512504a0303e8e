//! Normal equations in double-double: all unknowns at once, points not eliminated, sparse. Their factor is one of
//! doubles, whose solutions are refined until extended precision has nothing to add.

use crate::math::DoubleDouble;
use faer::prelude::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use faer::{Mat, Side};
use rayon::prelude::*;

/// Most parameters of effects that act on one image.
pub(super) const MOST_LOCAL: usize = 14;

/// Why a certificate cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CertifyError {
    /// An effect without a formula.
    #[error(transparent)]
    Law(#[from] super::forward::UnknownLaw),
    /// More effect parameters in an image than there is room for.
    #[error("{0} effect parameters act on one image, certificates have room for {MOST_LOCAL}")]
    TooMany(usize),
    /// A measurement that the model cannot predict.
    #[error("{0} cannot be predicted: behind the camera, or outside an effect's domain")]
    Outside(String),
    /// Normal equations without a Cholesky factor.
    #[error("the normal equations are singular at {0}")]
    Singular(String),
    /// A rank of more unknowns than are factorised whole.
    #[error("a rank of {unknowns} unknowns is asked for, at most {most} are factorised whole")]
    RankTooLarge {
        /// Asked for.
        unknowns: usize,
        /// At most.
        most: usize,
    },
    /// Steps that do not get smaller.
    #[error("after {steps} steps of refinement the last was still {sigma:.1e} sigma")]
    NotConverged {
        /// Steps made.
        steps: usize,
        /// The last one, in sigma.
        sigma: f64,
    },
}

/// `J'WJ` (lower triangle, by columns), `J'Wv` and the cost, of the free unknowns.
pub struct Normal {
    /// Unknowns of the layout, by column.
    pub unknowns: Vec<usize>,
    column_start: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<DoubleDouble>,
    /// The way down: `-d cost / d unknown`.
    pub descent: Vec<DoubleDouble>,
    /// Half the sum of `rho`.
    pub cost: DoubleDouble,
}

/// The part of a group of rows: dense over its columns, which ascend.
pub(super) struct Part {
    columns: Vec<usize>,
    matrix: Vec<DoubleDouble>,
    descent: Vec<DoubleDouble>,
    /// Half the sum of `rho` of the rows.
    pub cost: DoubleDouble,
}

impl Part {
    /// Zeros over some columns, in any order.
    pub fn new(mut columns: Vec<usize>) -> Self {
        columns.sort_unstable();
        columns.dedup();
        let n = columns.len();
        let zero = DoubleDouble::ZERO;
        Self { columns, matrix: vec![zero; n * n], descent: vec![zero; n], cost: zero }
    }

    /// Adds a row of derivatives with its misclosure.
    pub fn add(&mut self, row: &[(usize, DoubleDouble)], v: DoubleDouble, weight: DoubleDouble, descends: bool) {
        let n = self.columns.len();
        let place: Vec<usize> =
            row.iter().map(|(column, _)| self.columns.partition_point(|other| other < column)).collect();
        for (i, (_, a)) in row.iter().enumerate() {
            let weighted = *a * weight;
            if descends {
                self.descent[place[i]] += weighted * v;
            }
            for (j, (_, b)) in row.iter().enumerate() {
                if place[i] >= place[j] {
                    self.matrix[place[j] * n + place[i]] += weighted * *b;
                }
            }
        }
    }
}

impl Normal {
    /// The sum of some parts.
    pub(super) fn sum(unknowns: Vec<usize>, parts: &[Part]) -> Self {
        let n = unknowns.len();
        let mut entries: Vec<(u64, DoubleDouble)> = Vec::new();
        let mut descent = vec![DoubleDouble::ZERO; n];
        let mut cost = DoubleDouble::ZERO;
        for part in parts {
            let m = part.columns.len();
            cost += part.cost;
            for (a, column) in part.columns.iter().enumerate() {
                descent[*column] += part.descent[a];
                for b in a..m {
                    entries.push(((column * n + part.columns[b]) as u64, part.matrix[a * m + b]));
                }
            }
        }
        // What no measurement touches has a diagonal all the same.
        entries.extend((0..n).map(|k| ((k * n + k) as u64, DoubleDouble::ZERO)));
        entries.par_sort_by_key(|entry| entry.0);
        let mut normal = Normal { unknowns, column_start: vec![0; n + 1], rows: vec![], values: vec![], descent, cost };
        let mut last = u64::MAX;
        for (key, value) in entries {
            if key == last {
                if let Some(sum) = normal.values.last_mut() {
                    *sum += value;
                }
                continue;
            }
            last = key;
            normal.column_start[key as usize / n + 1] += 1;
            normal.rows.push(key as usize % n);
            normal.values.push(value);
        }
        for k in 0..n {
            normal.column_start[k + 1] += normal.column_start[k];
        }
        normal
    }

    /// The diagonal.
    pub fn diagonal(&self, column: usize) -> DoubleDouble {
        self.values[self.column_start[column]]
    }

    /// The whole matrix of some columns, by rows.
    pub fn dense(&self, columns: &[usize]) -> Vec<DoubleDouble> {
        let n = columns.len();
        let mut place = vec![usize::MAX; self.unknowns.len()];
        columns.iter().enumerate().for_each(|(k, column)| place[*column] = k);
        let mut matrix = vec![DoubleDouble::ZERO; n * n];
        for (j, column) in columns.iter().enumerate() {
            for k in self.column_start[*column]..self.column_start[column + 1] {
                let i = place[self.rows[k]];
                if i != usize::MAX {
                    (matrix[i * n + j], matrix[j * n + i]) = (self.values[k], self.values[k]);
                }
            }
        }
        matrix
    }

    /// The whole product with a vector.
    fn times(&self, x: &[DoubleDouble]) -> Vec<DoubleDouble> {
        let mut product = vec![DoubleDouble::ZERO; x.len()];
        for column in 0..x.len() {
            for k in self.column_start[column]..self.column_start[column + 1] {
                let (row, value) = (self.rows[k], self.values[k]);
                product[row] += value * x[column];
                if row != column {
                    product[column] += value * x[row];
                }
            }
        }
        product
    }

    /// A factor of doubles. Errors: no factor.
    pub fn factor(&self, name: &dyn Fn(usize) -> String) -> Result<Factored<'_>, CertifyError> {
        let n = self.unknowns.len();
        let scale: Vec<f64> = (0..n).map(|k| self.diagonal(k).hi.sqrt().recip()).collect();
        if let Some(k) = scale.iter().position(|scale| !scale.is_finite()) {
            return Err(CertifyError::Singular(name(self.unknowns[k])));
        }
        let mut values = Vec::with_capacity(self.values.len());
        for column in 0..n {
            for k in self.column_start[column]..self.column_start[column + 1] {
                values.push(self.values[k].hi * scale[column] * scale[self.rows[k]]);
            }
        }
        let somewhere = |_| CertifyError::Singular("some direction".into());
        let pattern = SymbolicSparseColMat::new_checked(n, n, self.column_start.clone(), None, self.rows.clone());
        let symbolic = SymbolicLlt::try_new(pattern.as_ref(), Side::Lower).map_err(|_| somewhere(()))?;
        let matrix = SparseColMat::new(pattern, values);
        let llt = Llt::try_new_with_symbolic(symbolic, matrix.as_ref(), Side::Lower).map_err(|_| somewhere(()))?;
        Ok(Factored { normal: self, llt, scale })
    }
}

/// Refinement ends where a correction is this part of the solution.
const REFINED: f64 = 1e-20;
/// Corrections at most: each takes the digits of the factor, which a scaled condition number of 1e12 leaves four.
const CORRECTIONS: usize = 30;

/// Normal equations with their factor.
pub struct Factored<'a> {
    normal: &'a Normal,
    llt: Llt<usize, f64>,
    scale: Vec<f64>,
}

impl Factored<'_> {
    fn roughly(&self, b: &[DoubleDouble]) -> Vec<f64> {
        let mut x = Mat::from_fn(b.len(), 1, |i, _| b[i].hi * self.scale[i]);
        x = self.llt.solve(&x);
        (0..b.len()).map(|i| x[(i, 0)] * self.scale[i]).collect()
    }

    /// The solution for a right-hand side, refined by residuals in extended precision.
    pub fn solve(&self, b: &[DoubleDouble]) -> Vec<DoubleDouble> {
        let mut x: Vec<DoubleDouble> = self.roughly(b).into_iter().map(DoubleDouble::from).collect();
        let size = |x: &[f64]| x.iter().zip(&self.scale).map(|(x, scale)| (x / scale).abs()).fold(0.0, f64::max);
        let mut last = f64::INFINITY;
        for _ in 0..CORRECTIONS {
            let product = self.normal.times(&x);
            let rest: Vec<DoubleDouble> = b.iter().zip(&product).map(|(b, p)| *b - *p).collect();
            let correction = self.roughly(&rest);
            let now = size(&correction);
            if !now.is_finite() || now >= last {
                break;
            }
            x.iter_mut().zip(&correction).for_each(|(x, c)| *x += DoubleDouble::from(*c));
            last = now;
            let whole: Vec<f64> = x.iter().map(|x| x.hi).collect();
            if now <= REFINED * size(&whole) {
                break;
            }
        }
        x
    }

    /// A column of the inverse: the covariance of an unknown with all others, for unit weight.
    pub fn column(&self, column: usize) -> Vec<DoubleDouble> {
        let mut unit = vec![DoubleDouble::ZERO; self.scale.len()];
        unit[column] = DoubleDouble::ONE;
        self.solve(&unit)
    }

    /// The standard deviation of an unknown for unit weight, by its column.
    pub fn sigma(&self, column: usize) -> f64 {
        self.column(column)[column].sqrt().hi
    }
}
