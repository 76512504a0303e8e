//! A small dense problem for the loop of the native Levenberg-Marquardt: damped by its scaled columns, solved by
//! orthogonal triangularisation.

use super::models::{MOST, Value, observed, predict};
use super::set::Set;
use crate::adjust::AdjustError;
use crate::adjust::native::Curvature;
use crate::adjust::native::lm::{Attempt, Iterated};
use nalgebra::{DMatrix, DVector};

/// Name in messages.
const NAME: &str = "native loop";

/// A regression set as a least-squares problem.
pub struct Regression<'a>(pub &'a Set);

/// A linearised set.
pub struct Rows {
    /// Derivatives by the scaled parameters, whose columns have length one.
    jacobian: DMatrix<f64>,
    /// One over the length of each column.
    scale: Vec<f64>,
    /// Observed minus computed.
    misclosures: DVector<f64>,
}

impl Regression<'_> {
    /// Predictions at some parameters; `None` where one is no number.
    fn predictions(&self, b: &[f64]) -> Option<Vec<Value>> {
        let unknowns: Vec<Value> = b.iter().enumerate().map(|(k, b)| Value::unknown(*b, k)).collect();
        let row = |row: &Vec<f64>| {
            let value = predict(&self.0.name, &unknowns, &row[1..])?;
            (value.value.is_finite() && value.slope[..MOST].iter().all(|slope| slope.is_finite())).then_some(value)
        };
        self.0.rows.iter().map(row).collect()
    }

    fn misclosures(&self, predictions: &[Value]) -> DVector<f64> {
        let rows = self.0.rows.iter().zip(predictions);
        DVector::from_iterator(predictions.len(), rows.map(|(row, at)| observed(&self.0.name, row[0]) - at.value))
    }

    /// The stated sum of squares and that of the certified values, where they do not go together.
    pub fn contradiction(&self) -> Option<(f64, f64)> {
        /// The certified values have eleven digits; a prediction has some of them less.
        const OF_VALUES: f64 = 1e-9;
        const OF_SUM: f64 = 1e-6;
        let predictions = self.predictions(&self.0.certified);
        let found = predictions.map_or(f64::NAN, |at| self.misclosures(&at).norm_squared());
        let rounding: f64 = self.0.rows.iter().map(|row| (OF_VALUES * row[0]).powi(2)).sum();
        let stated = self.0.sum_of_squares;
        let agrees = (found - stated).abs() <= OF_SUM * stated + rounding;
        (!agrees).then_some((stated, found))
    }

    /// Standard deviations at a system, a posteriori; `None` where it is singular.
    pub fn deviations(&self, system: &Rows) -> Option<Vec<f64>> {
        let n = system.scale.len();
        let redundancy = system.misclosures.len() - n;
        let variance = system.misclosures.norm_squared() / redundancy as f64;
        let inverse = system.jacobian.clone().qr().r().try_inverse()?;
        Some((0..n).map(|k| inverse.row(k).norm() * system.scale[k] * variance.sqrt()).collect())
    }
}

impl Iterated for Regression<'_> {
    type State = Vec<f64>;
    type System = Rows;
    type Increments = DVector<f64>;

    fn name(&self) -> &'static str {
        NAME
    }

    fn is_robust(&self) -> bool {
        false
    }

    fn linearise(&self, b: &Vec<f64>, _: f64, _: Curvature) -> Result<Rows, AdjustError> {
        let predictions = self.predictions(b).ok_or_else(|| AdjustError::BadStart {
            image: None,
            point: None,
            reason: format!("{} has no finite prediction", self.0.name),
        })?;
        let mut jacobian = DMatrix::from_fn(predictions.len(), b.len(), |i, k| predictions[i].slope[k]);
        let mut scale = Vec::with_capacity(b.len());
        for mut column in jacobian.column_iter_mut() {
            let length = column.norm();
            let inverse = if length > 0.0 { length.recip() } else { 1.0 };
            column *= inverse;
            scale.push(inverse);
        }
        Ok(Rows { jacobian, scale, misclosures: self.misclosures(&predictions) })
    }

    fn chi_square(&self, system: &Rows) -> f64 {
        system.misclosures.norm_squared()
    }

    fn chi_square_rounding(&self, system: &Rows) -> f64 {
        // A misclosure has the rounding of what is observed; with a fit to all digits that is all there is to it.
        let rounding: f64 = self.0.rows.iter().map(|row| (f64::EPSILON * row[0]).powi(2)).sum();
        let chi_square = system.misclosures.norm_squared();
        rounding + 2.0 * (rounding * chi_square).sqrt()
    }

    fn gradient_max(&self, system: &Rows) -> f64 {
        system.jacobian.tr_mul(&system.misclosures).amax()
    }

    fn solve(&self, system: &Rows, damping: f64) -> Option<DVector<f64>> {
        // The normal equations (J'J + damping D) x = J'v, D of ones as the columns are scaled, without forming J'J.
        let (m, n) = system.jacobian.shape();
        let mut rows = DMatrix::zeros(m + n, n);
        rows.view_mut((0, 0), (m, n)).copy_from(&system.jacobian);
        (0..n).for_each(|k| rows[(m + k, k)] = damping.sqrt());
        let mut right = DVector::zeros(m + n);
        right.rows_mut(0, m).copy_from(&system.misclosures);
        let qr = rows.qr();
        let right = qr.q().tr_mul(&right);
        let step = qr.r().solve_upper_triangular(&right)?;
        step.iter().all(|value| value.is_finite()).then_some(step)
    }

    fn decrement(&self, system: &Rows, step: &DVector<f64>) -> f64 {
        system.jacobian.tr_mul(&system.misclosures).dot(step)
    }

    fn attempt(
        &self,
        b: &Vec<f64>,
        system: &Rows,
        step: &DVector<f64>,
        damping: f64,
        _: Curvature,
    ) -> Option<Attempt<Vec<f64>>> {
        let next: Vec<f64> = (0..b.len()).map(|k| b[k] + step[k] * system.scale[k]).collect();
        let chi_square = self.misclosures(&self.predictions(&next)?).norm_squared();
        // As of the bundle: x'g + damping x'x.
        let predicted_drop = self.decrement(system, step) + damping * step.norm_squared();
        chi_square.is_finite().then_some(Attempt { state: next, chi_square, predicted_drop })
    }

    fn part(&self, step: &DVector<f64>, share: f64) -> DVector<f64> {
        share * step
    }

    fn stuck(&self, _: &Vec<f64>, iterations: usize, cost: f64) -> AdjustError {
        AdjustError::NotConverged { solver: NAME, iterations, reason: format!("no step reduces the cost {cost:.6e}") }
    }
}
