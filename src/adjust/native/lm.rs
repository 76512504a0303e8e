//! Levenberg-Marquardt on the reduced system. It stops by the Newton decrement: when a full step, without damping, would change chi-square by
//! less than is asked for. The factorisation that tells is the one that the covariance needs anyway.

use super::factor::{Factor, Pattern};
use super::linearise;
use super::point::{Curvature, Prepared};
use super::rank::factor_of_full_rank;
use super::step::try_step;
use super::structure::Structure;
use super::system::System;
use crate::adjust::{AdjustError, CovarianceOf, Iteration, Options, Progress};
use crate::measure::{self, Frame};
use crate::problem::{Loss, Problem, State};
use rayon::ThreadPool;
use std::time::Instant;

/// Damping at the start: small, because the start values of a block are near and the diagonal is unscaled information.
const START_DAMPING: f64 = 1e-7;
/// Factor of the damping after a step whose drop was predicted.
const RELAX: f64 = 0.1;
/// A drop of this share of the predicted one: the problem is as good as linear over the step.
const GOOD_PREDICTION: f64 = 0.9;
/// Factor of the damping after a bad step, doubled with every further one.
const TIGHTEN: f64 = 2.0;
/// Below this the damping changes nothing that the measurements tell.
const LEAST_DAMPING: f64 = 1e-13;
/// Above this a step is a crawl along the gradient: nothing reduces the cost any more.
const MOST_DAMPING: f64 = 1e12;
/// Whether a full step still finds something is asked only under a damping that does not itself make steps small.
const CONVERGED_DAMPING: f64 = 1e-4;
/// Chi-square itself is known to no better than this share of it: a sum of some 1e5 squares of differences of image coordinates. Large
/// weights (tie points weighted by their multiplicity) make that more than the absolute change asked for.
const CHI_SQUARE_ROUNDING: f64 = 1e-12;

/// With a robust loss, a step that changes chi-square by less than this share is near the solution: measurements hardly cross the corner of the
/// loss any more, and its second derivative says more than its weights.
const NEAR_SHARE: f64 = 1e-3;

/// Full steps that promise less than so many times the change of chi-square that is asked for are idle where they gain less than that.
const IDLE_PROMISE: f64 = 1e3;

/// Where the iterations ended.
pub struct Outcome {
    /// Estimated values.
    pub state: State,
    /// Steps tried.
    pub iterations: usize,
    /// Undamped system at `state`.
    pub system: System,
    /// Images at `state`.
    pub frames: Vec<Frame>,
}

/// Iterates from `problem.start`.
pub fn minimise(
    problem: &Problem,
    structure: &Structure,
    pattern: Option<&Pattern>,
    options: &Options,
    pool: &ThreadPool,
    progress: &mut Progress<'_>,
) -> Result<Outcome, AdjustError> {
    let solver = super::NAME;
    let started = Instant::now();
    let mut state = problem.start.clone();
    let mut frames = measure::frames(problem, &structure.stages, &state)?;
    let linearised = |state: &State, frames: &[Frame], damping: f64, curvature: Curvature| {
        let at = Prepared { problem, structure, state, frames };
        pool.install(|| linearise::linearise(&at, damping, curvature))
    };
    let solve = |system: &System, damping: f64| {
        Factor::new(structure, system, pattern, damping).ok().map(|factor| factor.solve())
    };
    let robust = problem.loss != Loss::None;
    let mut search = StepControl { damping: START_DAMPING, tighten: TIGHTEN, curvature: Curvature::Weights };
    let (mut iterations, mut idle) = (0, 0);
    loop {
        let mut damping = search.damping;
        let mut system = linearised(&state, &frames, damping, search.curvature)?;
        let chi_square = system.chi_square;
        let report = Iteration {
            number: iterations,
            cost: 0.5 * chi_square,
            gradient_max: gradient_max(&system),
            seconds: started.elapsed().as_secs_f64(),
        };
        if progress(&report).is_break() || options.stop.is_raised() {
            return Err(AdjustError::Cancelled { solver });
        }
        let small = options.chi_square_change.max(CHI_SQUARE_ROUNDING * chi_square);
        let mut increments = solve(&system, damping);
        let full = damping <= CONVERGED_DAMPING && increments.as_ref().is_some_and(|x| system.decrement(x) < small);
        if full {
            // What weak directions still hold the damping hides, and what outliers still hold the weights.
            damping = 0.0;
            system = linearised(&state, &frames, damping, Curvature::Newton)?;
            increments = solve(&system, damping);
            // A direction without any information is the caller's to name.
            if increments.as_ref().is_none_or(|x| system.decrement(x) < small) {
                // The step is at hand: taken, it leaves rounding where its promise left a share of sigma.
                let at = Prepared { problem, structure, state: &state, frames: &frames };
                let last =
                    increments.and_then(|x| pool.install(|| try_step(&at, &system, &x, damping, Curvature::Newton)));
                if let Some(step) = last.filter(|step| step.chi_square < chi_square) {
                    (state, frames) = (step.state, step.frames);
                    // Without a covariance the system at a step from here, shorter than anybody sees, serves as well.
                    if options.covariance == CovarianceOf::Nothing && !robust {
                        system.chi_square = step.chi_square;
                        return Ok(Outcome { state, iterations, system, frames });
                    }
                }
                let system = linearised(&state, &frames, 0.0, Curvature::Weights)?;
                return Ok(Outcome { state, iterations, system, frames });
            }
        }
        if iterations >= options.max_iterations {
            return Err(AdjustError::NotConverged { solver, iterations, reason: "iteration limit reached".into() });
        }
        iterations += 1;
        let at = Prepared { problem, structure, state: &state, frames: &frames };
        let curvature = if full { Curvature::Newton } else { search.curvature };
        let step = increments.and_then(|x| pool.install(|| try_step(&at, &system, &x, damping, curvature)));
        let drop = step.as_ref().map_or(f64::NEG_INFINITY, |step| chi_square - step.chi_square);
        let predicted = step.as_ref().map_or(f64::INFINITY, |step| step.predicted_drop);
        idle = if drop < small && predicted < IDLE_PROMISE * small { idle + 1 } else { 0 };
        match step {
            Some(step) if drop > 0.0 => {
                state = step.state;
                frames = step.frames;
                search.accepted(full, drop / predicted);
                let near = robust && drop < NEAR_SHARE * chi_square;
                search.curvature = if near { Curvature::Newton } else { Curvature::Weights };
            }
            // A full step that promised something and brings nothing: the state is as good as it gets.
            _ if full => {}
            // The damping may be what makes the step small: whether less of it finds more shows next.
            _ if predicted.abs() < small && drop.abs() < small => search.damping *= RELAX,
            // Measurements went beyond the corner of the loss, or came back; the weights alone are safe from that.
            _ if search.curvature == Curvature::Newton => search.curvature = Curvature::Weights,
            _ => search.refused(),
        }
        if search.damping > MOST_DAMPING {
            let at = Prepared { problem, structure, state: &state, frames: &frames };
            return Err(stuck(&at, pattern, pool, iterations, 0.5 * chi_square));
        }
        if full && drop < small || options.idle_steps.is_some_and(|most| idle >= most) {
            let system = linearised(&state, &frames, 0.0, Curvature::Weights)?;
            return Ok(Outcome { state, iterations, system, frames });
        }
    }
}

/// What the next step is made with.
struct StepControl {
    damping: f64,
    tighten: f64,
    curvature: Curvature,
}

impl StepControl {
    /// After a step that reduced chi-square, by `quality` of what was predicted.
    fn accepted(&mut self, full: bool, quality: f64) {
        // A full step that is not what was predicted says that the valley bends: the damping that its bend needs stays.
        let straight = full && quality > GOOD_PREDICTION;
        self.damping = if straight { LEAST_DAMPING } else { (self.damping * relaxation(quality)).max(LEAST_DAMPING) };
        self.tighten = TIGHTEN;
    }

    /// After a step that did not.
    fn refused(&mut self) {
        self.damping *= self.tighten;
        self.tighten *= 2.0;
    }
}

/// Factor of the damping after an accepted step, by the ratio of its drop to the predicted one: a valley that bends (a centre of distortion
/// that the block hardly determines) is followed at the damping that its bend needs. Source: Nielsen (1999), with a faster fall where the
/// prediction holds.
fn relaxation(quality: f64) -> f64 {
    if quality > GOOD_PREDICTION { RELAX } else { (1.0 - (2.0 * quality - 1.0).powi(3)).max(1.0 / 3.0) }
}

/// Why no step reduces the cost: the damping hides directions without information, so that without it they are named.
fn stuck(at: &Prepared<'_>, pattern: Option<&Pattern>, pool: &ThreadPool, iterations: usize, cost: f64) -> AdjustError {
    let undamped = pool.install(|| linearise::linearise(at, 0.0, Curvature::Weights));
    match undamped.and_then(|system| factor_of_full_rank(at.problem, at.structure, &system, pattern)) {
        Err(error) => error,
        Ok(_) => {
            let reason = format!("no step reduces the cost {cost:.6e}");
            AdjustError::NotConverged { solver: super::NAME, iterations, reason }
        }
    }
}

/// Largest gradient entry (by scaled unknowns) of a system.
pub fn gradient_max(system: &System) -> f64 {
    let largest = |values: &[f64]| values.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    largest(&system.gradient_images).max(largest(&system.gradient_border)).max(system.gradient_points_max)
}
