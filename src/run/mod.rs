//! One run: adjust a block under a model with the chosen solvers, hold them against each other, take the result into
//! the survey's system and compare it with control and check points.

pub mod cost;
pub(crate) mod distortion_centre;
pub mod fit;
mod fitted;
pub mod folder;
mod gnss;
mod loose_poses;
pub mod multistart;
mod pinned;
mod residual_means;
mod residuals;
pub mod set_aside;
mod solvers;
pub mod squares;
pub mod start_focal;
pub mod start_values;
pub mod summary;
mod tie_residuals;
mod variance_components;

pub use fitted::FittedModel;
pub use gnss::{GnssResidual, gnss_residuals, gnss_rms_m, heading_deg};
pub use residual_means::{CELLS, CellMean, MeanSquares, cell_means, rms_by};
pub use residuals::{ResidualKind, ResidualRow, residual_rows, tie_rms_px};
pub use tie_residuals::TieResiduals;

use crate::adjust::agreement::Agreement;
use crate::adjust::{AdjustError, CovarianceOf, Iteration, Options, Solution, Solver};
use crate::block::{Block, Role};
use crate::evaluate::{Alignment, Comparison, Method, checks};
use crate::measure::{MeasureError, Predictor};
use crate::mistakes::Mistake;
use crate::model::{Datum, Model};
use crate::problem::{Problem, ProblemError, State};
use fit::Fit;
use std::ops::ControlFlow;

/// Why a run failed.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Block and model do not make a problem.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// A solver failed.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
    /// A state at which measurements cannot be predicted.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// The control points do not determine a similarity.
    #[error("the similarity from the control points: {0}")]
    Similarity(#[from] crate::evaluate::similarity::SimilarityError),
}

/// Standard deviation (px) under which a mark says nothing.
const NO_WEIGHT_PX: f64 = 1e9;

/// Control points that a similarity needs.
const SIMILARITY_POINTS: usize = 3;

/// Reduced unknowns above which the covariance of every pose and point is left out of a run (its memory grows with
/// their square).
const EVERYTHING_UNKNOWNS: usize = 6000;

/// What one adjustment gave.
#[derive(Debug, Clone)]
pub struct Run {
    /// The problem that was solved.
    pub problem: Problem,
    /// Name of each solver and what it found; the first is the one that results are taken from.
    pub solutions: Vec<(&'static str, Solution)>,
    /// Solvers that failed where another found a solution, and why.
    pub failures: Vec<(&'static str, AdjustError)>,
    /// Do the solvers agree? `None` where one alone found a solution.
    pub agreement: Option<Agreement>,
    /// Surveyed points against the adjusted block; `None` without any that can be compared.
    pub comparison: Option<Comparison>,
    /// What people got wrong, where somebody looked.
    pub mistakes: Vec<Mistake>,
}

impl Run {
    /// The solution that results are taken from.
    pub fn solution(&self) -> &Solution {
        &self.solutions[0].1
    }

    /// `v'Pv`, `sum rho` with a robust loss.
    pub fn chi_square(&self) -> f64 {
        2.0 * self.solution().cost
    }

    /// `sqrt(v'Pv / redundancy)`; NaN without redundancy.
    pub fn sigma0(&self) -> f64 {
        (self.chi_square() / self.problem.redundancy().2 as f64).sqrt()
    }

    /// Does the block have a scale?
    pub fn has_scale(&self) -> bool {
        let similarity = self.comparison.as_ref().is_some_and(|comparison| comparison.similarity.is_some());
        summary::has_scale(self.problem.datum_defect, similarity)
    }

    /// Why the surveyed points of a block are not compared with it; `None` where they are, or there are none.
    pub fn why_not_compared(&self, block: &Block) -> Option<String> {
        if self.comparison.is_some() || block.surveyed.is_empty() {
            return None;
        }
        let (control, check) = (block.count(Role::Control), block.count(Role::Check));
        Some(format!(
            "{control} control and {check} check points are not compared with the block. With the free datum a \
             similarity takes it to them, which needs {SIMILARITY_POINTS} control points; --datum control, gnss or all \
             needs none"
        ))
    }

    /// Median over the points of the standard deviation in space, a posteriori, in the units of the block (m); NaN
    /// where it was not computed.
    pub fn point_sigma_m(&self) -> f64 {
        let points = self.solution().covariance.iter().flat_map(|covariance| &covariance.points);
        let sigmas: Vec<f64> = points.map(|covariance| covariance.trace().max(0.0).sqrt()).collect();
        if sigmas.is_empty() { f64::NAN } else { self.sigma0() * crate::math::statistics::median(&sigmas) }
    }
}

/// Called after each iteration with the name of the solver.
pub type Progress<'a> = dyn FnMut(&'static str, &Iteration) -> ControlFlow<()> + 'a;

/// Options that fit a problem: covariance of everything where that is affordable.
pub fn options_for(problem: &Problem, options: &Options) -> Options {
    let layout = problem.layout();
    let reduced = layout.point(0, 0);
    let covariance = if reduced > EVERYTHING_UNKNOWNS && options.covariance >= CovarianceOf::Everything {
        CovarianceOf::Shared
    } else {
        options.covariance
    };
    Options { covariance, ..options.clone() }
}

/// Adjusts with each solver in turn from the same start values, and compares. One solver that finds a solution is
/// enough; what became of the other stands in [`Run::failures`].
pub fn adjust(
    block: &Block,
    model: &Model,
    solvers: &[&dyn Solver],
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<Run, RunError> {
    adjust_from(block, model, None, solvers, options, progress)
}

/// [`adjust`] from where a `near` problem of the same images ended, instead of from the block's approximations.
pub fn adjust_from(
    block: &Block,
    model: &Model,
    near: Option<(&Problem, &State)>,
    solvers: &[&dyn Solver],
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<Run, RunError> {
    let without_motion = match near {
        Some(_) => None,
        None => fit::fit_without_motion(block, model, options)?,
    };
    let near = near.or(without_motion.as_ref().map(Fit::solved));
    let mut problem = Problem::near(block, model, near)?;
    let options = options_for(&problem, options);
    if let Some(first) = solvers.first() {
        variance_components::estimate(&mut problem, *first, &options, progress)?;
    }
    solve(block, problem, solvers, &options, progress)
}

/// [`adjust`] for a problem that is already laid out.
pub fn solve(
    block: &Block,
    problem: Problem,
    solvers: &[&dyn Solver],
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<Run, RunError> {
    let solvers::Solved { solutions, failures, agreement } = solvers::solve(&problem, solvers, options, progress)?;
    let comparison = compare(block, &problem, &solutions[0].1)?;
    Ok(Run { problem, solutions, failures, agreement, comparison, mistakes: Vec::new() })
}

/// Compares surveyed points with an adjusted block: after a similarity from the control points where the datum is free.
pub fn compare(block: &Block, problem: &Problem, solution: &Solution) -> Result<Option<Comparison>, RunError> {
    compare_state(block, problem, &solution.state)
}

/// [`compare`] at any state of a problem.
pub fn compare_state(block: &Block, problem: &Problem, state: &State) -> Result<Option<Comparison>, RunError> {
    if block.surveyed.is_empty() {
        return Ok(None);
    }
    let free = problem.datum_defect > 0;
    if free && block.count(Role::Control) < SIMILARITY_POINTS {
        return Ok(None);
    }
    // Marks in images that take no part would be compared with poses that nothing adjusted.
    let idle = problem.images_without_part();
    let mut judged = std::borrow::Cow::Borrowed(block);
    if !idle.is_empty() {
        for mark in &mut judged.to_mut().marks {
            if idle.contains(&problem.image_names[mark.image.index()].as_str()) {
                mark.sigma = Some(NO_WEIGHT_PX);
            }
        }
    }
    let block = judged.as_ref();
    let fitted = FittedModel { predictor: Predictor::new(problem, state)? };
    let alignment = if free { Alignment::FromControl } else { Alignment::None };
    Ok(Some(checks::compare(&fitted, block, alignment, Method::Image)?))
}

/// The datum that a command uses where none is asked for: `all` for a diagnosis where the block has control or GNSS.
pub fn default_diagnosis_datum(block: &Block) -> Datum {
    let gnss = block.images.iter().any(|image| image.gnss.is_some());
    if gnss || block.count(Role::Control) > 0 { Datum::All } else { Datum::Free }
}
