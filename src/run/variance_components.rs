//! Standard deviations of random effects (`a_i ~ N(0, s^2)`) as variance components: at a fit, the null model gives
//! score and information of the values, and their marginal likelihood the variance, without a fit per round
//! ([`crate::math::variance_component`]).

use super::{Progress, RunError};
use crate::adjust::{CovarianceOf, Options, Solver};
use crate::effects::Role;
use crate::math::variance_component::RandomValues;
use crate::null_model::{NoColumns, NullModel, is_column};
use crate::problem::{Problem, State};

/// Fits at most: the likelihood is that of a linear model, and what bends it is gone after the second.
const FITS: usize = 3;
/// Relative change of a standard deviation at which it is known well enough, in its own relative uncertainty `1 /
/// sqrt(2 n)`.
const SHARE_OF_UNCERTAINTY: f64 = 0.05;
/// Change of chi-square at which these fits stop: the values are then known to a hundredth of their sigma.
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
    let options = Options { covariance: CovarianceOf::Nothing, chi_square_change, ..options.clone() };
    for _ in 0..FITS {
        let name = solver.name();
        let solution = solver.solve(problem, &options, &mut |iteration| progress(name, iteration))?;
        let mut known = true;
        for group in &groups {
            let scale = problem.theta[group[0]].scale;
            let Some(before) = problem.theta[group[0]].prior_sigma else { continue };
            let variance = variance(problem, &solution.state, group, options.threads)?;
            let after = (variance.sqrt() * scale).max(SMALLEST_SHARE * scale);
            known &= (after / before).ln().abs() < SHARE_OF_UNCERTAINTY / (2.0 * group.len() as f64).sqrt();
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

/// Variance of a group's values (scaled units), from the fit `state` and, of many images, those of a sample; other
/// random values keep their priors.
fn variance(problem: &Problem, state: &State, group: &[usize], threads: usize) -> Result<f64, RunError> {
    let group: Vec<usize> = group.iter().copied().filter(|t| is_column(problem, &problem.theta[*t])).collect();
    let mut base = problem.clone();
    for t in &group {
        base.theta[*t].free = false;
        base.theta[*t].prior_sigma = None;
    }
    let columns = group.iter().map(|t| problem.layout().theta(*t)).collect();
    let values: Vec<f64> = group.iter().map(|t| state.theta[*t] / problem.theta[*t].scale).collect();
    let redundancy = base.redundancy().2 as f64;
    let null = NullModel::new(base, state.clone(), columns, threads)?;
    let scores = null.test(&NoColumns)?;
    let n = group.len();
    // The score where all values are zero, and v'Pv beside what they explain there.
    let at_zero = |i: usize| scores.score[i] + (0..n).map(|j| scores.information[(i, j)] * values[j]).sum::<f64>();
    let factor = null.chi_square() / redundancy;
    let random = RandomValues::new(n, |i, j| scores.information[(i, j)], at_zero);
    Ok(random.map_or(0.0, |random| random.variance(factor, 0.0)))
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
