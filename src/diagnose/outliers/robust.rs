//! A robust fit, for a block whose adjustment fails: a measurement that is wrong by hundreds of pixels can bend a block so far that its camera
//! is not determined any more, and then nothing says which one it is.

use super::{Outliers, Snooping, Solved, Strictness};
use crate::adjust::{AdjustError, Options};
use crate::block::Block;
use crate::diagnose::fit::{Fit, fit};
use crate::model::{Loss, Model};

/// A fit that single measurements cannot bend: with Cauchy's loss; where the camera is not determined even so, it is held at its start values.
/// `None` where that fails, too.
pub fn robust_fit(block: &Block, model: &Model, options: &Options) -> Option<Fit> {
    let robust = Model { loss: Loss::Cauchy, ..model.clone() };
    let held = Model { free: [false; 12], ..robust.clone() };
    // Near enough for a judgement of what is wrong by many standard deviations.
    let few = Options { max_iterations: options.max_iterations.min(MOST_ITERATIONS), ..options.clone() };
    [robust, held].iter().find_map(|model| fit(block, model, None, &few).ok())
}

/// Iterations of a robust fit at most.
const MOST_ITERATIONS: usize = 50;

/// Measurements that stand alone at a solution, the worst first. `block` is what it is a solution of.
///
/// # Errors
/// A solution at which predictions fail.
pub fn stand_alone(block: &Block, model: &Model, solved: &Solved) -> Result<Outliers, AdjustError> {
    let mut search = Snooping::new(block, model);
    search.judge(block, solved, Strictness::Tight)?;
    let mut outliers = search.outliers(block);
    outliers.rejected.sort_by(|a, b| b.normalised.total_cmp(&a.normalised));
    Ok(outliers)
}
