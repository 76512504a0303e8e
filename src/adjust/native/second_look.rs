//! A second look at a step that brought less than was predicted, before it is judged.

use super::iterated::{Attempt, Iterated};
use super::loss::Curvature;

/// A drop of this share of the predicted one: the problem is as good as linear over the step.
pub const GOOD_PREDICTION: f64 = 0.9;
/// Below this share a step is poor: a second look costs as much as the step that comes next, which leaves of a step with this quality or a better
/// one what the look would leave, too. Source: three quarters, the good step of trust regions since Fletcher (1971).
const POOR_PREDICTION: f64 = 0.75;
/// The least of a parabola that lies nearer to its start than this share of the step says only that the step was far too long, which the damping
/// says, too.
const LEAST_SHARE: f64 = 0.05;

/// The best that becomes of a step `x` which led to `straight`. Where that brought less than was predicted, one of three things is the reason:
///
/// - Along a few unknowns the problem bends (the place of a flaw on the sensor, the centre of distortion), and the many others that are tied to them
///   (coefficients of what lies there) have gone straight on. They follow in a second step while the few stay. Source: the idea of variable
///   projection, Golub and Pereyra (1973), that such a step is to be judged by what remains when the rest has followed.
/// - All of it bends, and the rest cannot follow: the bend along the step is looked at, where the step before was poor, too. It costs as much as
///   two steps, and from approximations the first is poor often.
/// - Large residuals add to the curvature, and the step goes beyond the minimum. The parabola through both values with the slope at the start has it:
///   `h = s / (2 s - b)` of the step, `2 s` the slope and `b` what the whole step brought.
pub fn looked_at_again<P: Iterated>(
    problem: &P,
    state: &P::State,
    system: &P::System,
    x: &P::Increments,
    straight: Attempt<P::State>,
    (damping, curvature): (f64, Curvature),
    poor_before: bool,
) -> Attempt<P::State> {
    let before = problem.chi_square(system);
    let predicted_drop = straight.predicted_drop;
    let brings_little = |attempt: &Attempt<P::State>| before - attempt.chi_square < POOR_PREDICTION * predicted_drop;
    let (slope, brought) = (problem.decrement(system, x), before - straight.chi_square);
    let share = slope / (2.0 * slope - brought);
    let followed = problem.followed(&straight.state, damping);
    let asks_for_bend = poor_before && followed.as_ref().is_none_or(brings_little);
    let bent = if asks_for_bend { problem.bent(state, &straight.state, x, damping) } else { None };
    let mut best = lower(lower(straight, followed), bent);
    if brings_little(&best) && share > LEAST_SHARE {
        best = lower(best, problem.attempt(state, system, &problem.part(x, share), damping, curvature));
    }
    Attempt { predicted_drop, ..best }
}

/// Whether an attempt from where chi-square was `before` brought less than was predicted.
pub fn is_poor<S>(attempt: &Attempt<S>, before: f64) -> bool {
    before - attempt.chi_square < POOR_PREDICTION * attempt.predicted_drop
}

/// The one with the lower chi-square.
fn lower<S>(one: Attempt<S>, other: Option<Attempt<S>>) -> Attempt<S> {
    match other {
        Some(other) if other.chi_square < one.chi_square => other,
        _ => one,
    }
}
