//! A variance that does not trust the measurements of an image to be independent.

use super::score::block_of;
use crate::adjust::native::score::Profile;
use nalgebra::{DMatrix, DVector};

/// Fewer images tell nothing about a variance between images.
const LEAST_CLUSTERS: f64 = 10.0;
/// One null case in 700 gets a design effect that it does not have.
const DESIGN_SIGMAS: f64 = 3.0;

/// Factor by which the variance of the score exceeds what independent measurements would give, from the scores of single images after the
/// candidate is fitted; one unless it is above one by more than its own uncertainty allows. Source: Liang and Zeger (1986), the cluster
/// sandwich; images are the clusters because matching errs together within an image.
pub(super) fn design_effect(
    profile: &Profile<'_>,
    columns: &[usize],
    whitening: &DMatrix<f64>,
    values: &DVector<f64>,
) -> f64 {
    let dof = whitening.ncols();
    let position = |column: &usize| profile.refined.iter().position(|refined| refined == column);
    let Some(columns) = columns.iter().map(position).collect::<Option<Vec<usize>>>() else { return 1.0 };
    let columns = columns.as_slice();
    let (mut sum, mut squares, mut expected_squares, mut clusters) = (0.0, 0.0, 0.0, 0.0);
    for (score, information) in &profile.by_image {
        let own = DVector::from_fn(columns.len(), |i, _| score[columns[i]]) - block_of(information, columns) * values;
        let share = (whitening.transpose() * block_of(information, columns) * whitening).trace();
        if share <= 0.0 {
            continue;
        }
        let size = (whitening.transpose() * own).norm_squared();
        sum += size;
        squares += size * size;
        expected_squares += share * share;
        clusters += 1.0;
    }
    if clusters < LEAST_CLUSTERS || dof == 0 {
        return 1.0;
    }
    let effect = sum / dof as f64;
    let uncertainty = squares.max(2.0 * expected_squares).sqrt() / dof as f64;
    if effect > 1.0 + DESIGN_SIGMAS * uncertainty { effect } else { 1.0 }
}
