//! Covariance of what all images share: cameras and effects.

use super::rows::CovarianceRow;
use crate::adjust::Covariance;
use crate::camera::PARAMETERS;
use crate::problem::Problem;

/// Unknowns beyond which the table has those of the cameras alone: a field over the sensor has hundreds.
const MOST: usize = 80;

/// Every pair of unknowns once; `sigma0` is the standard deviation of unit weight.
pub(super) fn rows(problem: &Problem, covariance: &Covariance, sigma0: f64) -> Vec<CovarianceRow> {
    let layout = problem.layout();
    let of_camera = |unknown: usize| layout.camera_parameter(unknown);
    let all: Vec<usize> = (0..covariance.shared_unknowns.len()).collect();
    let kept: Vec<usize> = match all.len() > MOST {
        true => all.into_iter().filter(|row| of_camera(covariance.shared_unknowns[*row]).is_some()).collect(),
        false => all,
    };
    let name = |row: usize| {
        let unknown = covariance.shared_unknowns[row];
        match of_camera(unknown) {
            Some((camera, k)) => (problem.camera_names[camera].clone(), PARAMETERS[k].to_string()),
            None => (String::new(), problem.theta[unknown - layout.theta(0)].name.clone()),
        }
    };
    let mut rows = Vec::new();
    for (place, &i) in kept.iter().enumerate() {
        for &j in &kept[place..] {
            let ((camera, parameter), (with_camera, with_parameter)) = (name(i), name(j));
            let value = covariance.shared[(i, j)];
            let correlation = value / (covariance.shared[(i, i)] * covariance.shared[(j, j)]).sqrt();
            rows.push(CovarianceRow {
                camera,
                parameter,
                with_camera,
                with_parameter,
                covariance: sigma0 * sigma0 * value,
                correlation: Some(correlation).filter(|correlation| correlation.is_finite()),
            });
        }
    }
    rows
}
