//! Effects that are nonlinear in a parameter of their own (a lag): tested at a few values of it, of which the best is kept and its significance
//! corrected for the choice.

use super::candidate::{Addition, Candidate};
use super::score::Screening;
use crate::effects::{Domain, Role};
use crate::math::statistics::chi_square_quantile;
use crate::problem::Problem;

/// Values that are tried besides the default: the domain's end and its halves, since a lag acts by its ratio to the length of a flight.
const HALVINGS: i32 = 6;

/// The candidate at each value of its searched range; itself where it has none, or where the block has no times to compute it with.
pub fn of(problem: &Problem, candidate: Candidate) -> Vec<Candidate> {
    let timed = problem.image_contexts.iter().all(|context| !context.time_s.is_nan());
    let Some((name, nominal, domain)) = range(&candidate) else { return vec![candidate] };
    let mut values = vec![nominal];
    if candidate.testable() && timed {
        values.extend((0..HALVINGS).rev().map(|k| domain.0 + (domain.1 - domain.0) * 0.5f64.powi(k)));
    }
    let at = |value: f64| {
        let mut candidate = candidate.clone();
        if let Addition::Effect(term) = &mut candidate.addition {
            term.values.insert(name.clone(), value);
            term.held.push(name.clone());
        }
        candidate
    };
    values.into_iter().map(at).collect()
}

/// Name, default and limits of a parameter that is searched over a range.
fn range(candidate: &Candidate) -> Option<(String, f64, (f64, f64))> {
    candidate.term()?.effect.descriptor().parameters.iter().find_map(|parameter| match parameter.role {
        Role::Searched(Domain::Range(a, b)) => Some((parameter.name.to_string(), parameter.nominal, (a, b))),
        _ => None,
    })
}

/// Of several variants of one candidate keeps the most significant, and corrects it by Davies' bound
/// `P(sup > c) <= P(c) + V / pi exp(-c^2 / 2)`, `V` the angle that the statistic's direction turns through over the range.
/// A parameter whose default is best stays held there; otherwise a refit estimates it. Source: Davies (1977), Biometrika 64.
pub fn keep_best(screening: &mut Screening) {
    let mut position = 0;
    while position < screening.scores.len() {
        let id = screening.scores[position].candidate.id.clone();
        let others: Vec<usize> =
            (position + 1..screening.scores.len()).filter(|i| screening.scores[*i].candidate.id == id).collect();
        if !others.is_empty() {
            let turned = turn(screening, position, &others);
            for other in others.into_iter().rev() {
                screening.scores.remove(other);
                screening.moved.remove(other);
                screening.correlation.remove(other);
                screening.correlation.iter_mut().for_each(|row| {
                    row.remove(other);
                });
            }
            let score = &mut screening.scores[position];
            let c2 = chi_square_of(score.ln_p);
            let davies = turned / std::f64::consts::PI * (-0.5 * c2).exp();
            score.ln_p = if davies > 0.0 { (score.ln_p.exp() + davies).min(1.0).ln() } else { score.ln_p };
            release(&mut score.candidate);
        }
        position += 1;
    }
}

/// Angle through which the statistic turns, from value to value of the parameter.
fn turn(screening: &Screening, best: usize, others: &[usize]) -> f64 {
    let value = |i: usize| {
        let candidate = &screening.scores[i].candidate;
        let name = range(candidate).map(|(name, ..)| name).unwrap_or_default();
        candidate.term().and_then(|term| term.values.get(&name).copied()).unwrap_or(0.0)
    };
    let mut all: Vec<usize> = others.iter().copied().chain([best]).collect();
    all.sort_by(|a, b| value(*a).total_cmp(&value(*b)));
    all.windows(2).map(|pair| screening.correlation[pair[0]][pair[1]].clamp(0.0, 1.0).acos()).sum()
}

/// Chi-square with one degree of freedom of this p-value; beyond the tables its exponential tail.
fn chi_square_of(ln_p: f64) -> f64 {
    if ln_p > -600.0 { chi_square_quantile(1.0 - ln_p.exp(), 1.0).min(-2.0 * ln_p) } else { -2.0 * ln_p }
}

fn release(candidate: &mut Candidate) {
    let Some((name, nominal, _)) = range(candidate) else { return };
    if let Addition::Effect(term) = &mut candidate.addition
        && term.values.get(&name).is_some_and(|value| *value != nominal)
    {
        term.held.retain(|held| *held != name);
    }
}
