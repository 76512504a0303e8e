//! A variance that does not trust the measurements of an image to be independent.

use nalgebra::{DMatrix, DVector};

/// Fewer clusters tell nothing about a variance between clusters.
const LEAST_CLUSTERS: f64 = 10.0;
/// Clusters that hold less than this share of what is known of a set say little of its variance.
const LEAST_SHARE: f64 = 0.5;
/// One null case in 700 gets a design effect that it does not have.
const DESIGN_SIGMAS: f64 = 3.0;

/// Score and information over some columns.
type Part = (DVector<f64>, DMatrix<f64>);

/// Parts of score and information by cluster of measurements. Matching errs together within an image, and what nobody
/// models of a sensor at one place, or along its rows or columns.
#[derive(Debug, Clone)]
pub struct Clusters {
    /// Per grouping and cluster, over the same columns.
    pub groupings: Vec<Vec<Part>>,
}

impl Clusters {
    /// Number of columns; `None` without a cluster.
    pub fn columns(&self) -> Option<usize> {
        self.groupings.iter().flatten().next().map(|(score, _)| score.len())
    }

    /// Factor by which the variance of a score exceeds what independent measurements would give: `directions` (columns
    /// x dof) whiten the set that is tested, `change` is what the columns change by when the set is fitted. Of all
    /// groupings the largest; one unless it is above one by more than its own uncertainty allows. Source: Liang and
    /// Zeger (1986), the cluster sandwich.
    pub fn design_effect(&self, directions: &DMatrix<f64>, change: &DVector<f64>, variance: f64) -> f64 {
        // Columns that neither touches only cost.
        let is_touched = |row: &usize| change[*row] != 0.0 || directions.row(*row).iter().any(|value| *value != 0.0);
        let rows: Vec<usize> = (0..change.len()).filter(is_touched).collect();
        let (directions, change) = (&directions.select_rows(&rows), &change.select_rows(&rows));
        let dof = directions.ncols();
        let of_grouping = |parts: &Vec<Part>| {
            let mut spread = Spread::default();
            for (score, information) in parts {
                let information = information.select_rows(&rows).select_columns(&rows);
                let share = (directions.transpose() * &information * directions).trace();
                if share > 0.0 {
                    let left = score.select_rows(&rows) - information * change;
                    spread.add((directions.transpose() * left).norm_squared() / variance, share);
                }
            }
            // Surveyed coordinates are in no cluster: an effect that is known by them has no design effect.
            if spread.expected < LEAST_SHARE * dof as f64 { 1.0 } else { spread.design_effect() }
        };
        self.groupings.iter().map(of_grouping).fold(1.0, f64::max)
    }
}

/// A cluster within an image: score, information, and covariance of the score if measurements are independent, over
/// the image's own values.
#[derive(Debug, Clone)]
pub struct ClusterOfValues {
    /// Score.
    pub score: DVector<f64>,
    /// Information.
    pub information: DMatrix<f64>,
    /// Covariance, unit weight.
    pub covariance: DMatrix<f64>,
}

/// What a cluster has of the variance of a score.
#[derive(Debug, Clone, Copy)]
pub struct Share {
    /// Square of its score over the variance factor.
    size: f64,
    /// What independent measurements would give in the mean.
    expected: f64,
}

/// The same for independent values per image, which take all that an image has in common: clusters are cells within
/// each image, of which these are the shares ([`shares_of`]), image by image.
pub fn of_values<'a>(shares: impl Iterator<Item = &'a Share>) -> f64 {
    let mut spread = Spread::default();
    shares.for_each(|share| spread.add(share.size, share.expected));
    spread.design_effect()
}

/// Shares of the cells of an image. What its values explain is taken out; none where they are not determined.
pub fn shares_of(cells: &[ClusterOfValues], variance: f64) -> Vec<Share> {
    let Some(first) = cells.first() else { return Vec::new() };
    let n = first.score.len();
    let score = cells.iter().fold(DVector::zeros(n), |sum, cell| sum + &cell.score);
    let information = cells.iter().fold(DMatrix::zeros(n, n), |sum, cell| sum + &cell.information);
    let Some(factor) = information.cholesky() else { return Vec::new() };
    let change = factor.solve(&score);
    let lower = factor.l();
    let white = |matrix: &DMatrix<f64>| {
        let half = lower.solve_lower_triangular(matrix)?;
        lower.solve_lower_triangular(&half.transpose())
    };
    let of = |cell: &ClusterOfValues| {
        let left = lower.solve_lower_triangular(&(&cell.score - &cell.information * &change))?;
        let (share, expected) = (white(&cell.information)?, white(&cell.covariance)?);
        // What is left of a cell once the values have been fitted to all cells.
        let expected = expected.trace() - (&share * &share).trace();
        (expected > 0.0).then(|| Share { size: left.norm_squared() / variance, expected })
    };
    cells.iter().filter_map(of).collect()
}

/// Squares of scores of clusters beside what independent measurements would give.
#[derive(Default)]
struct Spread {
    sum: f64,
    squares: f64,
    expected: f64,
    expected_squares: f64,
    clusters: f64,
}

impl Spread {
    fn add(&mut self, size: f64, expected: f64) {
        self.sum += size;
        self.squares += size * size;
        self.expected += expected;
        self.expected_squares += expected * expected;
        self.clusters += 1.0;
    }

    /// The ratio, or one where it is above one by no more than its uncertainty.
    fn design_effect(&self) -> f64 {
        if self.clusters < LEAST_CLUSTERS {
            return 1.0;
        }
        let effect = self.sum / self.expected;
        let uncertainty = self.squares.max(2.0 * self.expected_squares).sqrt() / self.expected;
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
        Clusters { groupings: vec![(0..100).map(part).collect()] }
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

    /// Design effect of ten images of twenty cells: a value per image, and an error per cell.
    fn images(value: f64, error: f64) -> f64 {
        let cell = move |image: usize, k: usize| {
            let value = if image.is_multiple_of(2) { value } else { -value };
            let error = if k.is_multiple_of(2) { error } else { -error };
            let information = DMatrix::from_element(1, 1, 4.0);
            let score = DVector::from_element(1, 4.0 * value + error);
            ClusterOfValues { score, covariance: information.clone(), information }
        };
        let cells = |image: usize| -> Vec<ClusterOfValues> { (0..20).map(|k| cell(image, k)).collect() };
        let shares: Vec<Share> = (0..10).flat_map(|image| shares_of(&cells(image), 1.0)).collect();
        of_values(shares.iter())
    }

    #[test]
    fn values_per_image_are_no_design_effect_but_errors_within_are() {
        assert_eq!(images(50.0, 2.0), 1.0);
        // Each cell's score has variance 4 if its measurements are independent; a twentieth of it goes with the value.
        assert_relative_eq!(images(50.0, 6.0), 9.0 * 20.0 / 19.0, epsilon = 1e-9);
    }

    #[test]
    fn an_effect_that_is_there_is_none() {
        let parts = (0..100).map(|_| (DVector::from_element(1, 0.5), DMatrix::from_element(1, 1, 0.01))).collect();
        let clusters = Clusters { groupings: vec![parts] };
        assert_eq!(clusters.design_effect(&DMatrix::identity(1, 1), &DVector::from_element(1, 50.0), 1.0), 1.0);
    }
}
