//! A second look at a step that brought less than was predicted, before it is judged.

use super::iterated::{Attempt, Iterated};
use super::loss::Curvature;

/// A drop of this share of the predicted one: the problem is as good as linear over the step.
pub const GOOD_PREDICTION: f64 = 0.9;
/// Below this share a step is poor: a second look costs as much as the step that comes next, which leaves of a step
/// with this quality or a better one what the look would leave, too. Source: three quarters, the good step of trust
/// regions since Fletcher (1971).
const POOR_PREDICTION: f64 = 0.75;
/// The least of a parabola that lies nearer to its start than this share of the step says only that the step was far
/// too long, which the damping says, too.
const LEAST_SHARE: f64 = 0.05;

/// The best that becomes of a step `x` which led to `straight`. Where that brought less than was predicted, one of
/// three things is the reason:
///
/// - Along a few unknowns the problem bends (the place of a flaw on the sensor, the centre of distortion), and the many
///   others that are tied to them (coefficients of what lies there) have gone straight on. They follow in a second step
///   while the few stay. Source: the idea of variable projection, Golub and Pereyra (1973), that such a step is to be
///   judged by what remains when the rest has followed.
/// - Residuals add to the curvature, also to that along the few where the rest follows, and the step goes beyond the
///   minimum (or, damped, not as far). The parabola through both values with the slope at the start has it: `h = s / (2
///   s - b)` of the step, `2 s` the slope and `b` what the whole step brought.
/// - All of it bends, and the rest cannot follow: the bend along the step is looked at, where the parabola was not true
///   either and the step before was poor, too. It costs as much as two steps, and from approximations the first is poor
///   often.
pub fn looked_at_again<P: Iterated>(
    problem: &P,
    state: &P::State,
    system: &P::System,
    x: &P::Increments,
    straight: Attempt<P::State>,
    (damping, curvature): (f64, Curvature),
    poor_before: bool,
) -> Attempt<P::State> {
    let (before, predicted_drop) = (problem.chi_square(system), straight.predicted_drop);
    let drop = |attempt: &Attempt<P::State>| before - attempt.chi_square;
    let following = |moved: &Attempt<P::State>, promised: f64| -> Option<Attempt<P::State>> {
        let once = problem.followed(&moved.state, damping)?;
        // What it fell short of its own promise by is left for another time.
        let left = once.predicted_drop - (moved.chi_square - once.chi_square);
        let again = drop(&once) < POOR_PREDICTION * promised && left > (1.0 - POOR_PREDICTION) * promised;
        let twice = if again { problem.followed(&once.state, damping) } else { None };
        Some(lower(once, twice))
    };
    let followed = following(&straight, predicted_drop);
    let brought = drop(followed.as_ref().unwrap_or(&straight));
    let slope = problem.decrement(system, x);
    let share = slope / (2.0 * slope - brought);
    let of_parabola = Some(share).filter(|_| brought < POOR_PREDICTION * predicted_drop && share > LEAST_SHARE);
    let promised = of_parabola.map_or(predicted_drop, |share| share * slope);
    let at_least = of_parabola.and_then(|share| {
        let moved = problem.attempt(state, system, &problem.part(x, share), damping, curvature)?;
        let followed = following(&moved, promised);
        Some(lower(moved, followed))
    });
    let is_poor = |attempt: &Attempt<P::State>| drop(attempt) < POOR_PREDICTION * promised;
    let asks_for_bend = poor_before && [&followed, &at_least].into_iter().flatten().all(is_poor);
    let bent = if asks_for_bend { problem.bent(state, &straight.state, x, damping) } else { None };
    let best = [followed, at_least, bent].into_iter().fold(straight, lower);
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
