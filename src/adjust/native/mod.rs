//! The native solver: Jacobians by hand, tangent-space rotations, its own elimination of the points and its own
//! Levenberg-Marquardt.

mod aligned;
mod bend;
mod bundle;
mod chunks;
mod columns;
mod covariance;
mod dense;
mod eliminate;
mod evaluation;
mod factor;
mod follow;
pub(crate) mod for_null_model;
mod in_order;
mod iterated;
pub mod kernels;
mod linearise;
pub mod lm;
mod loss;
mod nonlinear;
mod normal_equations;
mod pattern;
mod point;
pub(crate) mod pool;
mod rank;
mod rows;
mod second_look;
mod side_by_side;
mod spare;
mod step;
mod structure;
mod system;
mod turn;

use super::{AdjustError, Covariance, Evaluation, LinearSolver, Options, Progress, ReducedSystem, Solution, Solver};
use crate::measure::{self, Frame, MeasureError};
use crate::problem::{Loss, Problem, State};
pub use loss::Curvature;
pub use rank::EFFECT_DOMAIN;

use bundle::{Bundle, BundleState, gradient_max};
use normal_equations::NormalEquations;
use pattern::Pattern;
use point::Prepared;
use pool::Pool;
use spare::Spare;
use std::time::Instant;
use structure::Structure;

const NAME: &str = "native";

/// Most unknowns of one image: six of the pose and three image-wise effect parameters.
pub(crate) const MAX_DIM: usize = 9;

/// The native solver.
#[derive(Debug, Clone, Copy, Default)]
pub struct Native;

impl Solver for Native {
    fn name(&self) -> &'static str {
        NAME
    }

    fn solve(
        &self,
        problem: &Problem,
        options: &Options,
        progress: &mut Progress<'_>,
    ) -> Result<Solution, AdjustError> {
        let Options { threads, linear_solver, covariance, .. } = options;
        if *linear_solver == LinearSolver::Iterative {
            let option = "the iterative linear solver; use auto, dense or sparse".into();
            return Err(AdjustError::Unsupported { solver: NAME, option });
        }
        // Numerical derivatives of a plug-in would cost more than all the rest; those of its values are taken where
        // solvers are compared.
        let problem = &*problem.with_own_derivatives();
        let structure = structure(problem)?;
        let pattern = Pattern::of(&structure, *linear_solver);
        // The progress callback need not be Send: the iterations stay on this thread, their passes go to the pool.
        let pool = Pool::new(*threads)?;
        let started = Instant::now();
        let spare = Spare::default();
        let bundle = Bundle { problem, structure: &structure, pattern: pattern.as_deref(), pool: &pool, spare: &spare };
        let (state, frames) = (problem.start.clone(), frames(problem, &structure, &problem.start)?);
        let outcome = lm::minimise(&bundle, BundleState { state, frames }, options, progress)?;
        let BundleState { state, frames } = outcome.state;
        let seconds = started.elapsed().as_secs_f64();
        let factor = rank::factor_of_full_rank(problem, &structure, &outcome.system, pattern.as_deref())?;
        let at = Prepared { problem, structure: &structure, state: &state, frames: &frames };
        let covariance = pool.install(|| covariance::covariance(&at, &factor, *covariance))?;
        Ok(Solution {
            cost: 0.5 * outcome.system.chi_square,
            converged: true,
            iterations: outcome.iterations,
            seconds,
            gradient_max: gradient_max(&outcome.system),
            covariance,
            state,
        })
    }

    fn evaluate(&self, problem: &Problem, state: &State) -> Result<Evaluation, AdjustError> {
        evaluation::evaluate(problem, &structure(problem)?, state)
    }

    fn reduced_system(&self, problem: &Problem, state: &State) -> Result<ReducedSystem, AdjustError> {
        let plain = Problem { loss: Loss::None, ..problem.clone() };
        let structure = structure(&plain)?;
        let frames = frames(&plain, &structure, state)?;
        let at = Prepared { problem: &plain, structure: &structure, state, frames: &frames };
        let system = linearise::linearise(&at, 0.0, Curvature::Weights, &Spare::default())?;
        Ok(evaluation::reduced(&structure, &system))
    }

    fn covariance_at(&self, problem: &Problem, state: &State) -> Result<Covariance, AdjustError> {
        let structure = structure(problem)?;
        let frames = frames(problem, &structure, state)?;
        let at = Prepared { problem, structure: &structure, state, frames: &frames };
        let system = linearise::linearise(&at, 0.0, Curvature::Weights, &Spare::default())?;
        let pattern = Pattern::of(&structure, LinearSolver::Auto);
        let factor = rank::factor_of_full_rank(problem, &structure, &system, pattern.as_deref())?;
        Ok(covariance::shared(&at, &factor))
    }
}

/// One Gauss-Newton step of poses, cameras and effects from `state`, where another problem than `problem`, hardly
/// different, has its solution; points stay where they are. What it leaves is of the second order of the difference.
///
/// # Errors
/// A singular problem; a state that cannot be projected.
pub fn one_step(problem: &Problem, state: &State, threads: usize) -> Result<State, AdjustError> {
    let structure = structure(problem)?;
    let (images, border) = NormalEquations::at(problem, &structure, state, &Pool::new(threads)?)?.solve();
    let mut next = state.clone();
    step::move_images_and_border(problem, &structure, &mut next, &images, &border);
    Ok(next)
}

fn structure(problem: &Problem) -> Result<Structure, AdjustError> {
    let structure = Structure::new(problem);
    if structure.dim > MAX_DIM {
        let option = format!("{} image-wise effect parameters per image (at most {})", structure.dim - 6, MAX_DIM - 6);
        return Err(AdjustError::Unsupported { solver: NAME, option });
    }
    Ok(structure)
}

fn frames(problem: &Problem, structure: &Structure, state: &State) -> Result<Vec<Frame>, AdjustError> {
    Ok(measure::frames(problem, &structure.stages, state)?)
}

impl From<MeasureError> for AdjustError {
    fn from(error: MeasureError) -> Self {
        let (image, point, reason) = match error {
            MeasureError::Interior { image } => (Some(image), None, "an interior effect is outside its domain"),
            MeasureError::ImagePoint { image, point } => {
                (Some(image), Some(point), "behind the camera, or outside an effect's domain")
            }
            MeasureError::Antenna { image } => (Some(image), None, "a position effect is outside its domain"),
            MeasureError::Surveyed { point } => (None, Some(point), "a control effect is outside its domain"),
        };
        AdjustError::BadStart { image, point, reason: reason.into() }
    }
}
