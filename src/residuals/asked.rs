//! The columns of one test, asked whether they are zero.

use super::context::Noise;
use crate::math::statistics::f_ln_sf;
use crate::null_model::ScoreSystem;
use crate::score::pivoted::KEPT_SHARE;
use crate::score::{System, variance_factor};
use nalgebra::{DVector, Matrix2, Vector2};
use std::ops::Range;

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
    pub(super) fn of_many(self, count: usize) -> Self {
        let ln_p_value = (self.ln_p_value + (count.max(1) as f64).ln()).min(0.0);
        Self { ln_p_value, p_value: ln_p_value.exp(), ..self }
    }
}

/// What tells how much scores vary from point to point.
pub struct Spread {
    pub(super) length: Vec<f64>,
    pub(super) squares: Vec<f64>,
    pub(super) held: Vec<f64>,
}

impl Spread {
    /// Of the scores of a null model.
    pub fn of(scores: &ScoreSystem) -> Self {
        Self { length: scores.length.clone(), squares: scores.squares.clone(), held: scores.held.clone() }
    }
}

/// The columns of one test in a system.
pub(super) struct Asked<'a> {
    pub(super) system: &'a System,
    pub(super) spread: &'a Spread,
    pub(super) range: Range<usize>,
    pub(super) noise: Noise,
}

impl Asked<'_> {
    /// Columns of the system.
    pub(super) fn columns(&self, own: &[usize]) -> Vec<usize> {
        own.iter().map(|column| self.range.start + column).collect()
    }

    pub(super) fn variance(&self) -> f64 {
        variance_factor(self.noise.sum_of_squares, self.noise.degrees)
    }

    /// How much more the scores vary from point to point than the weights say, at least 1.
    pub(super) fn design_effect(&self, own: &[usize]) -> f64 {
        let Spread { squares, held, length } = self.spread;
        let ratios = self.columns(own).into_iter().filter(|c| held[*c] > KEPT_SHARE * length[*c]);
        let (sum, n) =
            ratios.fold((0.0, 0usize), |(sum, n), c| (sum + squares[c] / (self.variance() * held[c]), n + 1));
        if n == 0 { 1.0 } else { (sum / n as f64).max(1.0) }
    }

    /// Are the columns zero? `None` where the base model leaves none of them.
    pub(super) fn test(&self, own: &[usize]) -> Option<Tested> {
        self.tested(own, self.noise, self.design_effect(own))
    }

    /// The same against the noise of another group.
    pub(super) fn test_among(&self, own: &[usize], noise: Noise) -> Option<Tested> {
        self.tested(own, noise, 1.0)
    }

    pub(super) fn tested(&self, own: &[usize], noise: Noise, inflation: f64) -> Option<Tested> {
        let pivoted = self.system.pivoted(&self.columns(own));
        let (drop, dof) = (pivoted.drop(), pivoted.kept.len());
        let left = noise.degrees - dof as f64;
        if dof == 0 || left <= 0.0 || left.is_nan() {
            return None;
        }
        let remaining = variance_factor(noise.sum_of_squares - drop, left);
        let statistic = drop / (dof as f64 * remaining * inflation);
        let ln_p_value = f_ln_sf(statistic, dof as f64, left).min(0.0);
        Some(Tested { statistic, dof, p_value: ln_p_value.exp(), ln_p_value })
    }

    /// Estimate of a column alone and its standard deviation for unit weight; `None` where it is absorbed.
    pub(super) fn alone(&self, own: usize) -> Option<(f64, f64)> {
        let c = self.range.start + own;
        let m = self.system.information[(c, c)];
        (m > KEPT_SHARE * self.system.length[c] && m > 0.0).then(|| (self.system.score[c] / m, m.sqrt().recip()))
    }

    /// Estimates of two columns together and their chi-square for unit weight.
    pub(super) fn pair(&self, a: usize, b: usize) -> Option<([f64; 2], f64)> {
        let (a, b) = (self.range.start + a, self.range.start + b);
        let System { information, score, length, .. } = self.system;
        let m = Matrix2::new(information[(a, a)], information[(a, b)], information[(a, b)], information[(b, b)]);
        if m.determinant() <= KEPT_SHARE.powi(2) * length[a] * length[b] {
            return None;
        }
        let s = Vector2::new(score[a], score[b]);
        let x = m.try_inverse()? * s;
        Some(([x.x, x.y], s.dot(&x)))
    }

    /// Joint estimates of columns, `None` where the base model leaves too little of one.
    pub(super) fn estimates(&self, own: &[usize]) -> Option<DVector<f64>> {
        let columns = self.columns(own);
        let pivoted = self.system.pivoted(&columns);
        if pivoted.kept.len() < own.len() {
            return None;
        }
        let estimate = pivoted.estimate();
        let of = |c: &usize| pivoted.kept.iter().position(|kept| kept == c).map(|k| estimate[k]);
        Some(DVector::from_iterator(own.len(), columns.iter().filter_map(of)))
    }
}

/// Two questions to the same columns: are they zero together, and is the worst of `count` parts zero? Bonferroni over
/// both.
pub(super) fn joint_or_worst(joint: Option<Tested>, worst: Option<Tested>, count: usize) -> Option<Tested> {
    match (joint, worst.map(|worst| worst.of_many(count))) {
        (Some(joint), Some(worst)) if worst.ln_p_value < joint.ln_p_value => Some(worst.of_many(2)),
        (Some(joint), Some(_)) => Some(joint.of_many(2)),
        (joint, worst) => joint.or(worst),
    }
}
