//! Bundle problems, for the Levenberg-Marquardt loop: the reduced system is what it linearises and solves.

use super::bend;
use super::factor::Factor;
use super::linearise;
use super::lm::{Advanced, Attempt, Iterated};
use super::loss::Curvature;
use super::pattern::Pattern;
use super::point::Prepared;
use super::pool::Pool;
use super::rank::factor_of_full_rank;
use super::spare::Spare;
use super::step::try_step;
use super::structure::Structure;
use super::system::System;
use crate::adjust::AdjustError;
use crate::measure::Frame;
use crate::problem::{Loss, Problem, State};

/// A bundle problem with what is prepared once.
pub struct Bundle<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Its structure.
    pub structure: &'a Structure,
    /// Of a sparse reduced system.
    pub pattern: Option<&'a Pattern>,
    /// Where the passes over the points run.
    pub pool: &'a Pool,
    /// Memory of earlier linearisations.
    pub spare: &'a Spare,
}

/// Values of the unknowns, and the images at these.
pub struct BundleState {
    /// Estimated values.
    pub state: State,
    /// Images at `state`.
    pub frames: Vec<Frame>,
}

impl Bundle<'_> {
    fn at<'b>(&'b self, BundleState { state, frames }: &'b BundleState) -> Prepared<'b> {
        Prepared { problem: self.problem, structure: self.structure, state, frames }
    }
}

impl Iterated for Bundle<'_> {
    type State = BundleState;
    type System = System;
    type Increments = (Vec<f64>, Vec<f64>);

    fn name(&self) -> &'static str {
        super::NAME
    }

    fn is_robust(&self) -> bool {
        self.problem.loss != Loss::None
    }

    fn linearise(&self, state: &BundleState, damping: f64, curvature: Curvature) -> Result<System, AdjustError> {
        self.pool.install(|| linearise::linearise(&self.at(state), damping, curvature, self.spare))
    }

    fn is_done_with(&self, system: System) {
        self.spare.keep(system);
    }

    fn chi_square(&self, system: &System) -> f64 {
        system.chi_square
    }

    fn gradient_max(&self, system: &System) -> f64 {
        gradient_max(system)
    }

    fn solve(&self, system: &System, damping: f64) -> Option<Self::Increments> {
        let factor = self.pool.install(|| Factor::new(self.structure, system, self.pattern, damping));
        factor.ok().map(|factor| factor.solve())
    }

    fn decrement(&self, system: &System, step: &Self::Increments) -> f64 {
        system.decrement(step)
    }

    fn attempt(
        &self,
        state: &BundleState,
        system: &System,
        step: &Self::Increments,
        damping: f64,
        curvature: Curvature,
    ) -> Option<Attempt<BundleState>> {
        let step = self.pool.install(|| try_step(&self.at(state), system, step, damping, curvature, true))?;
        let (chi_square, predicted_drop) = (step.chi_square, step.predicted_drop);
        Some(Attempt { state: BundleState { state: step.state, frames: step.frames }, chi_square, predicted_drop })
    }

    fn advance(
        &self,
        state: &BundleState,
        system: &System,
        step: &Self::Increments,
        damping: f64,
        curvature: Curvature,
        next: f64,
    ) -> Option<Advanced<Self>> {
        let moved = self.pool.install(|| try_step(&self.at(state), system, step, damping, curvature, false))?;
        let after = BundleState { state: moved.state, frames: moved.frames };
        match self.linearise(&after, next, Curvature::Weights) {
            Ok(system) if system.chi_square.is_finite() => {
                let (chi_square, predicted_drop) = (system.chi_square, moved.predicted_drop);
                Some((Attempt { state: after, chi_square, predicted_drop }, Some(system)))
            }
            // Whether rays meet is another question than whether the step was good: asked when it comes to the next
            // step.
            _ => Some((self.attempt(state, system, step, damping, curvature)?, None)),
        }
    }

    fn part(&self, (images, border): &Self::Increments, share: f64) -> Self::Increments {
        let part = |step: &[f64]| step.iter().map(|x| share * x).collect();
        (part(images), part(border))
    }

    fn followed(&self, state: &BundleState, damping: f64) -> Option<Attempt<BundleState>> {
        let nonlinear = &self.structure.nonlinear;
        if nonlinear.is_empty() {
            return None;
        }
        let mut system = self.linearise(state, damping, Curvature::Weights).ok()?;
        system.hold(nonlinear);
        let increments = self.solve(&system, damping)?;
        self.attempt(state, &system, &increments, damping, Curvature::Weights)
    }

    fn bent(
        &self,
        state: &BundleState,
        straight: &BundleState,
        step: &Self::Increments,
        damping: f64,
    ) -> Option<Attempt<BundleState>> {
        let shifted = self.pool.install(|| bend::shifted_by_bend(&self.at(state), &straight.state, step))?;
        let shifted = Bundle { problem: &shifted, ..*self };
        let system = shifted.linearise(state, damping, Curvature::Weights).ok()?;
        let increments = shifted.solve(&system, damping)?;
        // The points follow by what was measured.
        self.attempt(state, &system, &increments, damping, Curvature::Weights)
    }

    /// The damping hides directions without information, so that without it they are named.
    fn stuck(&self, state: &BundleState, iterations: usize, cost: f64) -> AdjustError {
        let undamped = self.linearise(state, 0.0, Curvature::Weights);
        match undamped.and_then(|system| factor_of_full_rank(self.problem, self.structure, &system, self.pattern)) {
            Err(error) => error,
            Ok(_) => {
                let reason = format!("no step reduces the cost {cost:.6e}");
                AdjustError::NotConverged { solver: super::NAME, iterations, reason }
            }
        }
    }
}

/// Largest gradient entry (by scaled unknowns) of a system.
pub fn gradient_max(system: &System) -> f64 {
    let largest = |values: &[f64]| values.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    largest(&system.gradient_images).max(largest(&system.gradient_border)).max(system.gradient_points_max)
}
