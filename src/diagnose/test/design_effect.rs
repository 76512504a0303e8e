//! A variance that does not trust the measurements of an image to be independent.

use nalgebra::{DMatrix, DVector};

/// Fewer clusters tell nothing about a variance between clusters.
const LEAST_CLUSTERS: f64 = 10.0;
/// Clusters that hold less than this share of what is known of a set say little of its variance.
const LEAST_SHARE: f64 = 0.5;
/// One null case in 700 gets a design effect that it does not have.
const DESIGN_SIGMAS: f64 = 3.0;

/// Parts of score and information by cluster of measurements (images: matching errs together within an image).
#[derive(Debug, Clone)]
pub struct Clusters {
    /// Per cluster, over the same columns.
    pub parts: Vec<(DVector<f64>, DMatrix<f64>)>,
}

impl Clusters {
    /// The columns that some directions or a change touch, alone: the others only cost.
    pub(super) fn touched(
        &self,
        directions: &DMatrix<f64>,
        change: &DVector<f64>,
    ) -> (Self, DMatrix<f64>, DVector<f64>) {
        let is_touched = |row: &usize| change[*row] != 0.0 || directions.row(*row).iter().any(|value| *value != 0.0);
        let rows: Vec<usize> = (0..change.len()).filter(is_touched).collect();
        let part = |(score, information): &(DVector<f64>, DMatrix<f64>)| {
            (score.select_rows(&rows), information.select_rows(&rows).select_columns(&rows))
        };
        let parts = self.parts.iter().map(part).collect();
        (Self { parts }, directions.select_rows(&rows), change.select_rows(&rows))
    }

    /// Factor by which the variance of a score exceeds what independent measurements would give: `directions` (columns x dof) whiten the set
    /// that is tested, `change` is what the columns change by when the set is fitted. One unless it is above one by more than its own
    /// uncertainty allows. Source: Liang and Zeger (1986), the cluster sandwich.
    pub fn design_effect(&self, directions: &DMatrix<f64>, change: &DVector<f64>, variance: f64) -> f64 {
        let dof = directions.ncols();
        let (touched, directions, change) = &self.touched(directions, change);
        let (mut sum, mut squares, mut expected, mut expected_squares, mut clusters) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (score, information) in &touched.parts {
            let share = (directions.transpose() * information * directions).trace();
            if share <= 0.0 {
                continue;
            }
            let size = (directions.transpose() * (score - information * change)).norm_squared() / variance;
            sum += size;
            squares += size * size;
            expected += share;
            expected_squares += share * share;
            clusters += 1.0;
        }
        // Surveyed coordinates are in no cluster: an effect that is known by them has no design effect.
        if clusters < LEAST_CLUSTERS || expected < LEAST_SHARE * dof as f64 {
            return 1.0;
        }
        let effect = sum / expected;
        let uncertainty = squares.max(2.0 * expected_squares).sqrt() / expected;
        if effect > 1.0 + DESIGN_SIGMAS * uncertainty { effect } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn clusters(score: f64) -> Clusters {
        let part = |k: usize| {
            let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            (DVector::from_element(1, sign * score), DMatrix::from_element(1, 1, 0.01))
        };
        Clusters { parts: (0..100).map(part).collect() }
    }

    #[test]
    fn errors_that_an_image_shares_widen_the_variance() {
        let (direction, nothing) = (DMatrix::identity(1, 1), DVector::zeros(1));
        // Each part of the score has variance 0.01 if its measurements are independent.
        assert_eq!(clusters(0.1).design_effect(&direction, &nothing, 1.0), 1.0);
        assert_relative_eq!(clusters(0.3).design_effect(&direction, &nothing, 1.0), 9.0, epsilon = 1e-12);
        assert_eq!(
            clusters(0.3).design_effect(&direction, &nothing, 9.0),
            1.0,
            "weights that are wrong are no design effect"
        );
    }

    #[test]
    fn an_effect_that_is_there_is_none() {
        let parts = (0..100).map(|_| (DVector::from_element(1, 0.5), DMatrix::from_element(1, 1, 0.01))).collect();
        let clusters = Clusters { parts };
        assert_eq!(clusters.design_effect(&DMatrix::identity(1, 1), &DVector::from_element(1, 50.0), 1.0), 1.0);
    }
}
