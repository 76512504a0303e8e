//! Images whose rotation is known to no better than a radian are not oriented: two control points leave a rotation
//! about their line, and rounding alone keeps the normal matrix from showing it.

use crate::adjust::{AdjustError, NullDirection, Solution};
use crate::problem::Problem;

/// Standard deviation of a rotation (unit weight, rad) that says that nothing determines it.
const LOOSE_RAD: f64 = 1.0;

/// Images named at most; the rest is counted by the first of them.
const NAMED: usize = 3;

/// Errors: [`AdjustError::Singular`] that names the loosest images. Passes where the covariance of poses was not asked
/// for.
pub fn check(problem: &Problem, solver: &'static str, solution: &Solution) -> Result<(), AdjustError> {
    let Some(covariance) = &solution.covariance else { return Ok(()) };
    let mut loose: Vec<(f64, usize, usize)> = covariance
        .poses
        .iter()
        .enumerate()
        .filter_map(|(image, block)| {
            let sigmas = (0..3).map(|k| (block[(k, k)].sqrt(), image, k));
            sigmas.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(sigma, ..)| *sigma > LOOSE_RAD)
        })
        .collect();
    if loose.is_empty() {
        return Ok(());
    }
    loose.sort_by(|a, b| b.0.total_cmp(&a.0));
    let largest = loose[0].0;
    let component = |&(sigma, image, k): &(f64, usize, usize)| {
        (problem.unknown_name(problem.layout().pose(image, k)), sigma / largest)
    };
    let mut components: Vec<(String, f64)> = loose.iter().take(NAMED).map(component).collect();
    if loose.len() > NAMED {
        components[0].0 += &format!(" and the rotation of {} more images", loose.len() - 1);
    }
    Err(AdjustError::Singular { solver, directions: vec![NullDirection { components }] })
}
