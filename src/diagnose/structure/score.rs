//! A score with its covariance, and the test that all its columns are zero.

use crate::math::statistics::f_ln_sf;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// A column of which the base model leaves less than this share of the squared length is taken to be absorbed: its remainder is of the
/// size of the base's own linearisation errors.
const SMALLEST_SHARE: f64 = 1e-5;

/// A score, its covariance for unit weight, and what is known of its columns.
#[derive(Debug, Clone)]
pub struct Score {
    /// `C'Pv`.
    pub vector: Vec<f64>,
    /// `M`, lower triangle.
    pub matrix: DMatrix<f64>,
    /// Squared length of each column.
    pub size: Vec<f64>,
    /// Sum over the points of the squared part of each score.
    pub squares: Vec<f64>,
    /// Diagonal of `M` before the cameras were taken out.
    pub cameras_held: Vec<f64>,
}

/// Result of a test that columns are zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tested {
    /// F.
    pub statistic: f64,
    /// Degrees of freedom of the numerator: columns that the base model leaves.
    pub dof: usize,
    /// p-value.
    pub p_value: f64,
    /// Its natural logarithm, which does not underflow.
    pub ln_p_value: f64,
}

impl Tested {
    /// The largest of `count` such tests: Bonferroni.
    pub fn of_many(self, count: usize) -> Self {
        let ln_p_value = (self.ln_p_value + (count.max(1) as f64).ln()).min(0.0);
        Self { ln_p_value, p_value: ln_p_value.exp(), ..self }
    }
}

/// What the residuals have without the columns that are tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Sum of squares.
    pub sum_of_squares: f64,
    /// Redundancy.
    pub degrees: f64,
}

impl Score {
    /// No columns yet.
    pub fn new(count: usize) -> Self {
        Self {
            vector: vec![0.0; count],
            matrix: DMatrix::zeros(count, count),
            size: vec![0.0; count],
            squares: vec![0.0; count],
            cameras_held: vec![0.0; count],
        }
    }

    /// Adds to the lower triangle.
    pub(super) fn add(&mut self, a: usize, b: usize, value: f64) {
        self.matrix[(a.max(b), a.min(b))] += value;
    }

    /// How much more the score varies from point to point than the a-priori weights say, at least 1: the first-order correction of
    /// Rao and Scott (1984), by columns.
    pub fn design_effect(&self, columns: &[usize], variance: f64) -> f64 {
        let before = &self.cameras_held;
        let ratios = columns.iter().filter(|a| before[**a] > SMALLEST_SHARE * self.size[**a]);
        let (sum, n) =
            ratios.fold((0.0, 0usize), |(sum, n), a| (sum + self.squares[*a] / (variance * before[*a]), n + 1));
        if n == 0 { 1.0 } else { (sum / n as f64).max(1.0) }
    }

    /// Are the given columns zero? `None` when the base model leaves none of them. `inflation` multiplies their variance.
    pub fn test(&self, columns: &[usize], noise: Noise, inflation: f64) -> Option<Tested> {
        let (drop, dof) = self.drop(columns);
        let left = noise.degrees - dof as f64;
        if dof == 0 || left <= 0.0 {
            return None;
        }
        let remaining = (noise.sum_of_squares - drop).max(f64::MIN_POSITIVE) / left;
        let statistic = drop / (dof as f64 * remaining * inflation);
        let ln_p_value = f_ln_sf(statistic, dof as f64, left).min(0.0);
        Some(Tested { statistic, dof, p_value: ln_p_value.exp(), ln_p_value })
    }

    /// `s'M^-1 s` over the columns that the base model leaves, and their number, by a Cholesky factorisation with pivoting on the
    /// share that is left.
    pub fn drop(&self, columns: &[usize]) -> (f64, usize) {
        let mut columns: Vec<usize> = columns.iter().copied().filter(|a| self.size[*a] > 0.0).collect();
        let n = columns.len();
        let scale = |a: usize| self.size[a].sqrt().recip();
        let mut factor = DMatrix::<f64>::zeros(n, n); // row of a column, step
        let mut diagonal: Vec<f64> = columns.iter().map(|a| self.matrix[(*a, *a)] * scale(*a).powi(2)).collect();
        let mut s: Vec<f64> = columns.iter().map(|a| self.vector[*a] * scale(*a)).collect();
        let mut drop = 0.0;
        for step in 0..n {
            let Some(best) = (step..n).max_by(|i, k| diagonal[*i].total_cmp(&diagonal[*k]).then(k.cmp(i))) else {
                break;
            };
            if diagonal[best] < SMALLEST_SHARE {
                return (drop, step);
            }
            columns.swap(step, best);
            diagonal.swap(step, best);
            s.swap(step, best);
            factor.swap_rows(step, best);
            let pivot = diagonal[step].sqrt();
            factor[(step, step)] = pivot;
            // Row `step` of the factor times all rows below: column by column, which is how they are stored.
            let mut next: Vec<f64> = (step + 1..n)
                .map(|i| {
                    let (a, b) = (columns[i].max(columns[step]), columns[i].min(columns[step]));
                    self.matrix[(a, b)] * scale(columns[i]) * scale(columns[step])
                })
                .collect();
            for done in 0..step {
                let row = factor[(step, done)];
                let column = &factor.column(done);
                for (value, other) in next.iter_mut().zip(column.rows(step + 1, n - step - 1).iter()) {
                    *value -= row * other;
                }
            }
            let y = s[step] / pivot;
            drop += y * y;
            for (i, value) in (step + 1..n).zip(next) {
                let value = value / pivot;
                factor[(i, step)] = value;
                diagonal[i] -= value * value;
                s[i] -= value * y;
            }
        }
        (drop, n)
    }

    /// Estimate `M_aa^-1 s_a` of a column alone and its standard deviation for unit weight; `None` where it is absorbed.
    pub fn alone(&self, a: usize) -> Option<(f64, f64)> {
        let m = self.matrix[(a, a)];
        (m > SMALLEST_SHARE * self.size[a] && m > 0.0).then(|| (self.vector[a] / m, m.sqrt().recip()))
    }

    /// Estimates of two columns together and their chi-square for unit weight.
    pub fn pair(&self, a: usize, b: usize) -> Option<([f64; 2], f64)> {
        let (hi, lo) = (a.max(b), a.min(b));
        let m = Matrix2::new(self.matrix[(a, a)], self.matrix[(hi, lo)], self.matrix[(hi, lo)], self.matrix[(b, b)]);
        if m.determinant() <= SMALLEST_SHARE.powi(2) * self.size[a] * self.size[b] {
            return None;
        }
        let s = Vector2::new(self.vector[a], self.vector[b]);
        let x = m.try_inverse()? * s;
        Some(([x.x, x.y], s.dot(&x)))
    }

    /// Joint estimates of columns, `None` where the base model leaves too little of one.
    pub fn estimates(&self, columns: &[usize]) -> Option<DVector<f64>> {
        let n = columns.len();
        let m = DMatrix::from_fn(n, n, |i, k| self.matrix[(columns[i].max(columns[k]), columns[i].min(columns[k]))]);
        let s = DVector::from_fn(n, |i, _| self.vector[columns[i]]);
        let absorbed = columns.iter().any(|a| self.matrix[(*a, *a)] <= SMALLEST_SHARE * self.size[*a]);
        if absorbed { None } else { m.cholesky().map(|factor| factor.solve(&s)) }
    }
}
