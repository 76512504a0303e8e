//! Shared unknowns in which predicted measurements are far from linear.
//!
//! In nearly all of its shared unknowns (coefficients of a camera and of effects) a block is as good as linear over a
//! step. Not in those that say *where* something lies which the others say *how large* it is: a searched place on the
//! sensor, a searched width, the centre of distortion. Their products with the coefficients make narrow valleys that
//! bend.

use crate::camera::{DCX, DCY, PPX, PPY};
use crate::problem::Problem;

/// Columns of a border, by the layout numbers of its unknowns.
pub fn columns(problem: &Problem, border: &[usize]) -> Vec<usize> {
    let layout = problem.layout();
    let searched: Vec<usize> = problem.searched().into_iter().map(|t| layout.theta(t)).collect();
    let centre: &[usize] = if problem.tie_dc_to_pp { &[PPX, PPY] } else { &[DCX, DCY] };
    let bends = |unknown: &usize| match layout.camera_parameter(*unknown) {
        Some((_, parameter)) => centre.contains(&parameter),
        None => searched.contains(unknown),
    };
    (0..border.len()).filter(|column| bends(&border[*column])).collect()
}
