//! Levenberg-Marquardt. It stops by the Newton decrement: when a full step, without damping, would change chi-square by
//! less than is asked for. The factorisation that tells is the one that the covariance needs anyway.
//!
//! The loop knows nothing of images: it iterates on anything [`Iterated`]. Bundle problems are one (`bundle.rs`); the
//! regression sets of NIST, on which it is validated, are the other (`src/validate/nist`).

use super::loss::Curvature;
use super::second_look::{GOOD_PREDICTION, is_poor, looked_at_again};
use crate::adjust::{AdjustError, CHI_SQUARE_CHANGE, Iteration, Options, Progress};
use std::time::Instant;

pub use super::iterated::{Advanced, Attempt, Iterated};

/// Damping at the start: small, because the start values of a block are near and the diagonal is unscaled information.
const START_DAMPING: f64 = 1e-7;
/// Factor of the damping after a step whose drop was predicted.
const RELAX: f64 = 0.1;
/// Factor of the damping after a bad step, doubled with every further one.
const TIGHTEN: f64 = 2.0;
/// The least damping after a step to where measurements cannot be predicted (behind a camera): it was not a little too
/// long, but let go a direction that hardly anything determines, and each refusal costs a whole pass. It is what Ceres
/// begins with (a trust region of 1e4).
const CAUTIOUS_DAMPING: f64 = 1e-4;
/// The least factor after accepted ones of the steps that follow a refused one: the damping matters there, and a faster
/// fall would be refused again.
const CAREFUL_RELAX: f64 = 1.0 / 3.0;
/// How many these are.
const CAREFUL_STEPS: usize = 2;
/// Below this the damping changes nothing that the measurements tell.
const LEAST_DAMPING: f64 = 1e-13;
/// Above this a step is a crawl along the gradient: nothing reduces the cost any more.
const MOST_DAMPING: f64 = 1e12;
/// A step that promises this share of chi-square, or all but this share, is likely to bring what it promises: the first
/// is short, the second comes from approximations, whose errors are much larger than what the step itself neglects.
const LIKELY_SHARE: f64 = 0.01;
/// Whether a full step still finds something is asked only under a damping that does not itself make steps small.
const CONVERGED_DAMPING: f64 = 1e-4;
/// Steps that polish at most. Large residuals make each leave a share of what was left.
const MOST_POLISHING: usize = 50;

/// With a robust loss, a step that changes chi-square by less than this share is near the solution: measurements hardly
/// cross the corner of the loss any more, and its second derivative says more than its weights.
const NEAR_SHARE: f64 = 1e-3;

/// Full steps that promise less than so many times the change of chi-square that is asked for are idle where they gain
/// less than that.
const IDLE_PROMISE: f64 = 1e3;

/// Where the iterations ended.
pub struct Outcome<P: Iterated> {
    /// Estimated values.
    pub state: P::State,
    /// Steps tried.
    pub iterations: usize,
    /// Undamped system at `state`.
    pub system: P::System,
}

/// Iterates from `state`.
///
/// # Errors
/// A state that cannot be predicted, no convergence, a wish to end.
pub fn minimise<P: Iterated>(
    problem: &P,
    mut state: P::State,
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<Outcome<P>, AdjustError> {
    let solver = problem.name();
    let started = Instant::now();
    let robust = problem.is_robust();
    let mut search =
        StepControl { damping: START_DAMPING, tighten: TIGHTEN, careful: 0, curvature: Curvature::Weights };
    let (mut iterations, mut idle, mut poor) = (0, 0, false);
    // The system at the state, where the last step brought it along, and whether without damping.
    let mut ready = None;
    loop {
        let (mut system, undamped) = match ready.take() {
            Some(brought) => brought,
            None => (problem.linearise(&state, search.damping, search.curvature)?, false),
        };
        let mut damping = if undamped { 0.0 } else { search.damping };
        let chi_square = problem.chi_square(&system);
        let report = Iteration {
            number: iterations,
            cost: 0.5 * chi_square,
            gradient_max: problem.gradient_max(&system),
            seconds: started.elapsed().as_secs_f64(),
        };
        if progress(&report).is_break() || options.stop.is_raised() {
            return Err(AdjustError::Cancelled { solver });
        }
        let small = options.chi_square_change.max(problem.chi_square_rounding(&system));
        let mut increments = problem.solve(&system, damping);
        if increments.is_none() && undamped {
            damping = search.damping;
            system = problem.linearise(&state, damping, search.curvature)?;
            increments = problem.solve(&system, damping);
        }
        let full =
            damping <= CONVERGED_DAMPING && increments.as_ref().is_some_and(|x| problem.decrement(&system, x) < small);
        if full {
            // What weak directions still hold the damping hides, and what outliers still hold the weights.
            if damping > 0.0 || robust {
                damping = 0.0;
                system = problem.linearise(&state, damping, Curvature::Newton)?;
                increments = problem.solve(&system, damping);
            }
            // A direction without any information is the caller's to name.
            let decrement = increments.as_ref().map_or(0.0, |x| problem.decrement(&system, x));
            if decrement < small {
                // The step is at hand: taken, it leaves rounding where its promise left a share of sigma.
                let last = increments
                    .and_then(|x| problem.advance(&state, &system, &x, damping, Curvature::Newton, damping))
                    .filter(|(step, _)| step.chi_square < chi_square);
                let (mut state, mut system, mut steps) = match last {
                    Some((step, system)) => (step.state, system, 0),
                    None => (state, (!robust).then_some(system), 0),
                };
                let asked = options.chi_square_change;
                if asked < CHI_SQUARE_CHANGE && decrement > asked {
                    (state, steps) = polish(problem, state, asked)?;
                    system = None;
                }
                let system = match system {
                    Some(system) => system,
                    None => problem.linearise(&state, 0.0, Curvature::Weights)?,
                };
                return Ok(Outcome { state, iterations: iterations + steps, system });
            }
        }
        if iterations >= options.max_iterations {
            if options.may_stay_unconverged {
                let system = problem.linearise(&state, 0.0, Curvature::Weights)?;
                return Ok(Outcome { state, iterations, system });
            }
            return Err(AdjustError::NotConverged { solver, iterations, reason: "iteration limit reached".into() });
        }
        iterations += 1;
        let curvature = if full { Curvature::Newton } else { search.curvature };
        let next = search.after_a_good_step(full);
        let last = increments.as_ref().is_some_and(|x| is_likely_last(problem, &system, x, small));
        let taken = increments.as_ref().and_then(|x| match !robust && is_likely_good(problem, &system, x) {
            true => problem.advance(&state, &system, x, damping, curvature, if last { 0.0 } else { next }),
            false => Some((problem.attempt(&state, &system, x, damping, curvature)?, None)),
        });
        let (mut step, mut after) = taken.map_or((None, None), |(step, after)| (Some(step), after));
        let was_poor = step.as_ref().is_some_and(|step| step.predicted_drop > small && is_poor(step, chi_square));
        if let (Some(straight), Some(x)) = (step.take_if(|_| was_poor && !robust), &increments) {
            step = Some(looked_at_again(problem, &state, &system, x, straight, (damping, curvature), poor));
            after = None;
        }
        poor = was_poor;
        let drop = step.as_ref().map_or(f64::NEG_INFINITY, |step| chi_square - step.chi_square);
        let predicted = step.as_ref().map_or(f64::INFINITY, |step| step.predicted_drop);
        idle = if drop < small && predicted < IDLE_PROMISE * small { idle + 1 } else { 0 };
        match step {
            Some(step) if drop > 0.0 => {
                state = step.state;
                search.accepted(full, drop / predicted);
                let near = robust && drop < NEAR_SHARE * chi_square;
                search.curvature = if near { Curvature::Newton } else { Curvature::Weights };
                ready = after.filter(|_| search.damping == next).map(|system| (system, last));
            }
            // A full step that promised something and brings nothing: the state is as good as it gets.
            _ if full => {}
            // The damping may be what makes the step small: whether less of it finds more shows next.
            _ if predicted.abs() < small && drop.abs() < small => search.damping *= RELAX,
            // Measurements went beyond the corner of the loss, or came back; the weights alone are safe from that.
            _ if search.curvature == Curvature::Newton => search.curvature = Curvature::Weights,
            Some(_) => search.refused(),
            None => search.lost(),
        }
        if search.damping > MOST_DAMPING {
            return Err(problem.stuck(&state, iterations, 0.5 * chi_square));
        }
        if full && drop < small || options.idle_steps.is_some_and(|most| idle >= most) {
            let system = problem.linearise(&state, 0.0, Curvature::Weights)?;
            return Ok(Outcome { state, iterations, system });
        }
        problem.is_done_with(system);
    }
}

/// Whether a step is likely to bring what it promises.
fn is_likely_good<P: Iterated>(problem: &P, system: &P::System, step: &P::Increments) -> bool {
    let share = problem.decrement(system, step) / problem.chi_square(system);
    !(LIKELY_SHARE..1.0 - LIKELY_SHARE).contains(&share)
}

/// Whether a step is likely to be the last but one that changes chi-square by more than `small`: what a problem's bend
/// leaves of a decrement is, as a share of chi-square, about the square of what it was. Whether anything is left is
/// then asked without damping at once.
fn is_likely_last<P: Iterated>(problem: &P, system: &P::System, step: &P::Increments, small: f64) -> bool {
    let decrement = problem.decrement(system, step);
    decrement * decrement < small * problem.chi_square(system)
}

/// Goes on with full steps where the rounding of chi-square hides what they gain and more is asked for than usual: the
/// decrement has its digits from the gradient, and tells longer than chi-square does whether a step is worth it. Gives
/// the steps taken.
fn polish<P: Iterated>(problem: &P, mut state: P::State, asked: f64) -> Result<(P::State, usize), AdjustError> {
    let mut least = f64::INFINITY;
    for steps in 0..MOST_POLISHING {
        let system = problem.linearise(&state, 0.0, Curvature::Newton)?;
        let Some(step) = problem.solve(&system, 0.0) else { return Ok((state, steps)) };
        let decrement = problem.decrement(&system, &step);
        if decrement <= asked || decrement.is_nan() || decrement >= least {
            return Ok((state, steps));
        }
        let bound = problem.chi_square(&system) + problem.chi_square_rounding(&system);
        let Some(next) = problem.attempt(&state, &system, &step, 0.0, Curvature::Newton) else {
            return Ok((state, steps));
        };
        if next.chi_square > bound {
            return Ok((state, steps));
        }
        (state, least) = (next.state, decrement);
    }
    Ok((state, MOST_POLISHING))
}

/// What the next step is made with.
struct StepControl {
    damping: f64,
    tighten: f64,
    careful: usize,
    curvature: Curvature,
}

impl StepControl {
    /// The damping that a step which brings all that was predicted leads to.
    fn after_a_good_step(&self, full: bool) -> f64 {
        let mut after = Self { ..*self };
        after.accepted(full, 1.0);
        after.damping
    }

    /// After a step that reduced chi-square, by `quality` of what was predicted.
    fn accepted(&mut self, full: bool, quality: f64) {
        // A full step that is not what was predicted says that the valley bends: the damping that its bend needs stays.
        let straight = full && quality > GOOD_PREDICTION;
        self.damping = if straight {
            LEAST_DAMPING
        } else {
            (self.damping * relaxation(quality, self.careful > 0)).max(LEAST_DAMPING)
        };
        self.careful = self.careful.saturating_sub(1);
        self.tighten = TIGHTEN;
    }

    /// After a step that did not.
    fn refused(&mut self) {
        self.damping *= self.tighten;
        self.tighten *= 2.0;
        self.careful = CAREFUL_STEPS;
    }

    /// After a step to where measurements cannot be predicted, or where there was none.
    fn lost(&mut self) {
        self.refused();
        self.damping = self.damping.max(CAUTIOUS_DAMPING);
    }
}

/// Factor of the damping after an accepted step, by the ratio of its drop to the predicted one: a valley that bends (a
/// centre of distortion that the block hardly determines) is followed at the damping that its bend needs. Source:
/// Nielsen (1999), with a faster fall where the prediction holds.
fn relaxation(quality: f64, careful: bool) -> f64 {
    match quality > GOOD_PREDICTION && !careful {
        true => RELAX,
        false => (1.0 - (2.0 * quality - 1.0).powi(3)).max(CAREFUL_RELAX),
    }
}

#[cfg(test)]
#[path = "lm_tests.rs"]
mod tests;
