//! What is plausible of a column, and how little of it counts as known.

use crate::effects::Role;
use crate::problem::PRIOR_SHARES;
use crate::problem::Problem;

/// Standard deviation, in typical sizes, of the prior of an effect of several coefficients: no effect of this size is
/// met, and what the measurements determine to a typical size moves by a thousandth.
pub const WEAK_PRIOR: f64 = 30.0;

/// Information (unit weight, scaled units) below which a parameter is known to no better than what is plausible of it,
/// or where nothing is said of that, than its domain.
pub fn least_information(problem: &Problem, unknown: usize) -> f64 {
    let layout = problem.layout();
    if let Some((camera, k)) = layout.camera_parameter(unknown) {
        return (problem.camera_scales[camera][k] / problem.camera_domains[camera][k]).powi(2);
    }
    let entry = &problem.theta[unknown - layout.theta(0)];
    let parameter = &problem.effects[entry.effect as usize].effect.descriptor().parameters[entry.parameter as usize];
    match (&parameter.role, plausible_values(problem, unknown)) {
        (Role::Estimated, Some([min, max])) => (max - min).recip().powi(2),
        (Role::Estimated, None) => crate::adjust::native::EFFECT_DOMAIN.powi(-2),
        _ => 0.0,
    }
}

/// Information that the prior of a size adds, in scaled units and of unit weight: half of what is plausible is its
/// standard deviation. Zero where nothing is said of it.
pub fn prior_information(problem: &Problem, unknown: usize) -> f64 {
    if let Some((camera, k)) = problem.layout().camera_parameter(unknown) {
        return (problem.camera_scales[camera][k] / (PRIOR_SHARES[k] * problem.camera_domains[camera][k])).powi(2);
    }
    plausible_values(problem, unknown).map_or(0.0, |[min, max]| (0.5 * (max - min)).powi(-2))
}

/// Information of the prior that a free parameter has in a fit, in scaled units.
pub fn prior_in_fit(problem: &Problem, unknown: usize) -> f64 {
    let layout = problem.layout();
    let information = |scale: f64, sigma: f64| (scale / sigma).powi(2);
    match layout.camera_parameter(unknown) {
        Some((camera, k)) => {
            let own = problem.camera_priors.iter().filter(|p| (p.camera as usize, p.parameter as usize) == (camera, k));
            own.map(|prior| information(problem.camera_scales[camera][k], prior.sigma)).sum()
        }
        None => {
            let entry = &problem.theta[unknown - layout.theta(0)];
            entry.prior_sigma.map_or(0.0, |sigma| information(entry.scale, sigma))
        }
    }
}

/// What is plausible of a parameter, scaled units.
pub fn plausible_values(problem: &Problem, unknown: usize) -> Option<[f64; 2]> {
    let entry = &problem.theta[unknown.checked_sub(problem.layout().theta(0))?];
    let parameter = &problem.effects[entry.effect as usize].effect.descriptor().parameters[entry.parameter as usize];
    let plausible = parameter.plausible.as_ref()?;
    // Both are stated for the same sensor, and the scale is the typical size on this one.
    let typical = parameter.typical.abs();
    Some([plausible.min / typical, plausible.max / typical])
}
