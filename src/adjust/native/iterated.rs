//! What the Levenberg-Marquardt loop (`lm.rs`) iterates on.

use super::loss::Curvature;
use crate::adjust::AdjustError;

/// Chi-square itself is known to no better than this share of it: a sum of some 1e5 squares of differences of image
/// coordinates. Large weights (tie points weighted by their multiplicity) make that more than the absolute change asked
/// for.
const CHI_SQUARE_ROUNDING: f64 = 1e-12;

/// A least-squares problem as the loop sees it.
pub trait Iterated {
    /// Values of the unknowns, and what is prepared with them.
    type State;
    /// Normal equations at a state.
    type System;
    /// A solution of these.
    type Increments;

    /// Name in messages.
    fn name(&self) -> &'static str;

    /// Has it a robust loss?
    fn is_robust(&self) -> bool;

    /// The normal equations at a state, eliminated under a damping.
    ///
    /// # Errors
    /// A state that cannot be predicted.
    fn linearise(&self, state: &Self::State, damping: f64, curvature: Curvature) -> Result<Self::System, AdjustError>;

    /// Takes a system back that nobody needs any more: its memory may serve the next one.
    fn is_done_with(&self, _system: Self::System) {}

    /// Chi-square at the state of a system.
    fn chi_square(&self, system: &Self::System) -> f64;

    /// Its rounding: smaller changes of it say nothing.
    fn chi_square_rounding(&self, system: &Self::System) -> f64 {
        CHI_SQUARE_ROUNDING * self.chi_square(system)
    }

    /// Largest gradient entry (by scaled unknowns) of a system.
    fn gradient_max(&self, system: &Self::System) -> f64;

    /// The step of a system; `None` where it has none.
    fn solve(&self, system: &Self::System, damping: f64) -> Option<Self::Increments>;

    /// By what chi-square would fall along a step, were the problem linear.
    fn decrement(&self, system: &Self::System, step: &Self::Increments) -> f64;

    /// Takes a step. `None` where the new state cannot be predicted.
    fn attempt(
        &self,
        state: &Self::State,
        system: &Self::System,
        step: &Self::Increments,
        damping: f64,
        curvature: Curvature,
    ) -> Option<Attempt<Self::State>>;

    /// Takes a step that is likely to be good, and linearises after it under the damping `next` without a robust loss's
    /// second derivative: chi-square comes from that, and the pass that it would take for itself is saved. `None` where
    /// the new state cannot be predicted, no system where it is no cheaper so.
    fn advance(
        &self,
        state: &Self::State,
        system: &Self::System,
        step: &Self::Increments,
        damping: f64,
        curvature: Curvature,
        _next: f64,
    ) -> Option<Advanced<Self>> {
        Some((self.attempt(state, system, step, damping, curvature)?, None))
    }

    /// A share of a step.
    fn part(&self, step: &Self::Increments, share: f64) -> Self::Increments;

    /// After a step that led to `state`: lets those unknowns in which the problem is nearly linear follow, while the
    /// others stay. `None` where there are no such others.
    fn followed(&self, _state: &Self::State, _damping: f64) -> Option<Attempt<Self::State>> {
        None
    }

    /// Takes the step that the bend of the problem along `step` asks for, which led to `straight`. `None` where there
    /// is no such thing.
    fn bent(
        &self,
        _state: &Self::State,
        _straight: &Self::State,
        _step: &Self::Increments,
        _damping: f64,
    ) -> Option<Attempt<Self::State>> {
        None
    }

    /// Why no step reduces the cost.
    fn stuck(&self, state: &Self::State, iterations: usize, cost: f64) -> AdjustError;
}

/// A step that was taken.
pub struct Attempt<S> {
    /// The state after it.
    pub state: S,
    /// Chi-square there.
    pub chi_square: f64,
    /// By what it would have fallen, were the problem linear.
    pub predicted_drop: f64,
}

/// A step that was taken, and the system after it where that came along.
pub type Advanced<P> = (Attempt<<P as Iterated>::State>, Option<<P as Iterated>::System>);
