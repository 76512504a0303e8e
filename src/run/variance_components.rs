//! Standard deviations of random effects (`a_i ~ N(0, s^2)`) as variance components, by Förstner's iteration: `s^2 = sum a^2 / r` with the
//! share `r = sum (1 - var(a_i) / s^2)` of the redundancy that the image-wise values contribute.
//!
//! Source: Förstner and Wrobel, Photogrammetric Computer Vision (2016), sec. 4.2.4.

use super::{Progress, RunError};
use crate::adjust::{CovarianceOf, Options, Solver};
use crate::effects::Role;
use crate::problem::Problem;

/// Relative change of a standard deviation at which it is known well enough, in its own relative uncertainty `1 / sqrt(2 n)`.
const SHARE_OF_UNCERTAINTY: f64 = 0.05;
/// The iteration contracts by a factor of its own per round; more rounds mean that the component is zero.
const ROUNDS: usize = 30;
/// Largest ratio of two steps that the rest of their series is taken from.
const MOST_RATIO: f64 = 0.9;
/// Change of chi-square at which the solves between two rounds stop: the values are then known to a hundredth of their sigma.
const CHI_SQUARE_CHANGE: f64 = 1e-4;
/// Below this share of the typical size a component counts as zero and is left there.
const SMALLEST_SHARE: f64 = 1e-4;

/// Estimates the standard deviation of every random effect and leaves it in the problem as the prior of its values.
pub fn estimate(
    problem: &mut Problem,
    solver: &dyn Solver,
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<(), RunError> {
    let groups = random_groups(problem);
    if groups.is_empty() {
        return Ok(());
    }
    let chi_square_change = options.chi_square_change.max(CHI_SQUARE_CHANGE);
    let options = Options { covariance: CovarianceOf::Everything, chi_square_change, ..options.clone() };
    let mut last_steps: Vec<Option<f64>> = vec![None; groups.len()];
    for _ in 0..ROUNDS {
        let name = solver.name();
        let solution = solver.solve(problem, &options, &mut |iteration| progress(name, iteration))?;
        let Some(covariance) = &solution.covariance else { return Ok(()) };
        let mut known = true;
        for (group, last_step) in groups.iter().zip(&mut last_steps) {
            let Some(before) = problem.theta[group[0]].prior_sigma else { continue };
            let variance = before * before;
            let sum: f64 = group.iter().map(|t| solution.state.theta[*t].powi(2)).sum();
            let share: f64 = group.iter().map(|t| 1.0 - covariance.theta_variances[*t] / variance).sum();
            let smallest = SMALLEST_SHARE * problem.theta[group[0]].scale;
            let after = if share > 0.0 { (sum / share).sqrt().max(smallest) } else { smallest };
            let step = (after / before).ln();
            known &= step.abs() < SHARE_OF_UNCERTAINTY / (2.0 * group.len() as f64).sqrt();
            // Steps shrink by a constant ratio: every second one takes the rest of the series with it (Aitken).
            let ratio = last_step.take().map(|last| step / last).filter(|ratio| *ratio > 0.0);
            let whole = match ratio {
                Some(ratio) => step / (1.0 - ratio.min(MOST_RATIO)),
                None => *last_step.insert(step),
            };
            let after = (before * whole.exp()).max(smallest);
            for t in group {
                problem.theta[*t].prior_sigma = Some(after);
            }
        }
        problem.start = solution.state;
        if known {
            break;
        }
    }
    Ok(())
}

/// Positions in `theta` of the values of each standard deviation: one group per effect and name.
fn random_groups(problem: &Problem) -> Vec<Vec<usize>> {
    let mut groups: Vec<((u32, &'static str), Vec<usize>)> = Vec::new();
    for (t, entry) in problem.theta.iter().enumerate() {
        let descriptor = problem.effects[entry.effect as usize].effect.descriptor();
        let Role::Random(name) = descriptor.parameters[entry.parameter as usize].role else { continue };
        if entry.prior_sigma.is_none() {
            continue;
        }
        match groups.iter_mut().find(|(key, _)| *key == (entry.effect, name)) {
            Some((_, group)) => group.push(t),
            None => groups.push(((entry.effect, name), vec![t])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}
