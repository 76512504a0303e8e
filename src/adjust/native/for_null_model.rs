//! The interface for the null model, which asks about further columns at a fit: the order of the unknowns, the normal
//! equations of the fit, and rows of its design matrix.

pub(crate) use super::MAX_DIM;
pub(crate) use super::aligned::zeros;
pub(crate) use super::in_order::locked;
pub(crate) use super::linearise::{prior_rows, rays_do_not_meet};
pub(crate) use super::loss::Curvature;
pub(crate) use super::normal_equations::NormalEquations;
pub(crate) use super::point::{Prepared, inverse_of_damped};
pub(crate) use super::pool::Pool;
pub(crate) use super::rows::Contents;
pub(crate) use super::side_by_side::{Cameras, Eight, Eights, Workspace};
pub(crate) use super::step::move_images_and_border;
pub(crate) use super::structure::{NONE, POSE, Structure};

use crate::adjust::AdjustError;
use crate::problem::Problem;

/// The order of the unknowns of a problem.
///
/// # Errors
/// More unknowns of one image than the solver takes.
pub(crate) fn structure_of(problem: &Problem) -> Result<Structure, AdjustError> {
    super::structure(problem)
}
