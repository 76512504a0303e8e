//! A robust fit, for a block that blunders bend: a measurement that is wrong by hundreds of pixels can bend a
//! least-squares fit so far that its camera is not determined any more, or that nothing at it says which one is wrong.

use super::majority::start_where_most_rays_meet;
use super::{Outliers, SIGNIFICANCE, Snooping, Solved, Strictness};
use crate::adjust::{AdjustError, Options};
use crate::block::Block;
use crate::model::{Loss, Model};
use crate::problem::Problem;
use crate::run::RunError;
use crate::run::fit::{Fit, solve};

/// A fit that single measurements cannot bend: with Cauchy's loss, from where most rays of each point meet; where the
/// camera is not determined even so, it is held at its start values. `near`: an earlier fit of the same images, to
/// start from.
///
/// With the camera held it need not converge where the options allow that, for a search. An image that wrong
/// measurements alone hold slides along with every step, and what is a hundred pixels off elsewhere stands out all the
/// same; without both, the next fit is of what can converge.
///
/// # Errors
/// Those of the fit with the camera held.
pub fn robust_fit(block: &Block, model: &Model, near: Option<&Fit>, options: &Options) -> Result<Fit, RunError> {
    let fit = |model: &Model, may_stay_unconverged: bool| -> Result<Fit, RunError> {
        let mut problem = Problem::near(block, model, near.map(Fit::solved))?;
        let near_enough = RESIDUAL_CHANGE.powi(2) * (2 * problem.observations.len()) as f64;
        let few = Options {
            max_iterations: options.max_iterations.min(MOST_ITERATIONS),
            chi_square_change: options.chi_square_change.max(near_enough),
            may_stay_unconverged,
            ..options.clone()
        };
        start_where_most_rays_meet(&mut problem);
        Ok(solve(model, problem, &few)?)
    };
    let robust = Model { loss: Loss::Cauchy, ..model.clone() };
    fit(&robust, false).or_else(|_| fit(&Model { free: [false; 12], ..robust }, options.may_stay_unconverged))
}

/// Did a [`robust_fit`] converge? One that did not says what stands far off, and nothing of what does not.
pub fn has_converged(robust: &Fit) -> bool {
    robust.solution.iterations < MOST_ITERATIONS
}

/// Iterations of a robust fit at most.
const MOST_ITERATIONS: usize = 50;

/// Change of a residual in standard deviations, in the mean over the block, that a robust fit may leave: it tells what
/// is wrong by many. An image most of whose measurements are wrong has no orientation to converge to, and would hold up
/// the judgement of all others.
const RESIDUAL_CHANGE: f64 = 0.01;

/// Measurements that stand alone at a solution, the worst first. `block` is what it is a solution of: the rays of its
/// points met.
///
/// # Errors
/// A solution at which predictions fail.
pub fn stand_alone(block: &Block, solved: Solved<'_>) -> Result<Outliers, AdjustError> {
    let mut search = Snooping::nothing(block, SIGNIFICANCE);
    search.judge(block, solved, Strictness::Tight)?;
    let mut outliers = search.outliers(block);
    outliers.rejected.sort_by(|a, b| b.normalised.total_cmp(&a.normalised));
    Ok(outliers)
}
