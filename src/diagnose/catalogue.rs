//! The candidates of a fit, each in the variants that are tested: values of a lag, the option that a drift follows
//! (time or order), kinds of coordinates that are of a map.

use super::added::Added;
use super::candidate::{Addition, Candidate, candidates as all};
use super::select::Searched;
use crate::block::Block;
use crate::effects::{Descriptor, Domain, Role, Stage};
use crate::model::EffectRef;
use crate::problem::Problem;
use crate::run::fit::Fit;

/// Values that are tried besides the default: the domain's end and its halves, since a lag acts by its ratio to the
/// length of a flight.
const HALVINGS: i32 = 6;
/// Share of a block's span by which times of an even sequence may be off by rounding.
const EVEN: f64 = 1e-9;

/// The `wanted` candidates that are not in the model: those that the block can test, in each variant, and those that it
/// cannot, with what they need.
pub fn candidates(
    block: &Block,
    fit: &Fit,
    added: &Added,
    plugins: &[EffectRef],
    wanted: impl Fn(&Candidate) -> bool,
) -> (Vec<(Candidate, Searched)>, Vec<Candidate>) {
    let Fit { model, problem, solution, .. } = fit;
    let (mut tested, mut untested) = (Vec::new(), Vec::new());
    for mut candidate in all(block, problem, model, plugins) {
        let is_in = model.effects.iter().any(|term| term.effect.descriptor().id == candidate.id)
            || added.freed.contains_key(&candidate.id);
        if is_in || !wanted(&candidate) {
            continue;
        }
        if candidate.testable() && !super::domain::holds(problem, &solution.state, &candidate) {
            candidate.needs.push("every measured point inside the effect's domain".into());
        }
        match candidate.testable() {
            true => tested.extend(variants(problem, candidate)),
            false => untested.push(candidate),
        }
    }
    (tested, untested)
}

fn variants(problem: &Problem, candidate: Candidate) -> Vec<(Candidate, Searched)> {
    if candidate.scanned() {
        return vec![(candidate, Searched::None)];
    }
    let found = [lags, options].map(|variants| variants(problem, &candidate));
    let found = found.into_iter().find(|variants| !variants.is_empty());
    found.unwrap_or_else(|| vec![(candidate, Searched::None)])
}

/// The candidate at each value of a range that one of its parameters is searched over, held there.
fn lags(problem: &Problem, candidate: &Candidate) -> Vec<(Candidate, Searched)> {
    let timed = problem.image_contexts.iter().all(|context| !context.time_s.is_nan());
    let Some(term) = candidate.term() else { return Vec::new() };
    let range = term.effect.descriptor().parameters.iter().find_map(|parameter| match parameter.role {
        Role::Searched(Domain::Range(a, b)) => Some((parameter.name.to_string(), parameter.nominal, (a, b))),
        _ => None,
    });
    let Some((name, nominal, domain)) = range else { return Vec::new() };
    let mut values = vec![nominal];
    if timed {
        values.extend((0..HALVINGS).rev().map(|k| domain.0 + (domain.1 - domain.0) * 0.5f64.powi(k)));
    }
    let at = |value: f64| (with(candidate, &name, value, true), Searched::Range(value));
    values.into_iter().map(at).collect()
}

/// The candidate at each value of an option, where they act differently. Kinds of coordinates are equally likely. What
/// is not the default elsewhere costs more: where two options look alike, the default holds.
fn options(problem: &Problem, candidate: &Candidate) -> Vec<(Candidate, Searched)> {
    let Some(term) = candidate.term() else { return Vec::new() };
    let descriptor = term.effect.descriptor();
    let Some((place, values)) = option(problem, descriptor) else { return Vec::new() };
    let searched = |value: f64| match descriptor.stage {
        Stage::Frame => Searched::Variant,
        _ if value == descriptor.parameters[place].nominal => Searched::None,
        _ => Searched::Option,
    };
    let name = &descriptor.parameters[place].name;
    values.iter().map(|(_, value)| (with(candidate, name, *value, false), searched(*value))).collect()
}

/// The option of an effect whose values act differently in a block: its position among the parameters, and its named
/// values. A drift may follow times or the order of the images: where the platform pauses, a drift in the camera's own
/// steps is none in time. Coordinates of a map may be those of control or those of GNSS positions.
pub(super) fn option<'a>(problem: &Problem, descriptor: &'a Descriptor) -> Option<(usize, &'a [(&'static str, f64)])> {
    let even = || problem.image_contexts.iter().all(|context| (context.tau - context.tau_order).abs() < EVEN);
    let differs = |name: &str| match name {
        "against" => !even(),
        "in" => descriptor.stage == Stage::Frame && !problem.gnss.is_empty() && !problem.control.is_empty(),
        _ => false,
    };
    descriptor.parameters.iter().enumerate().find_map(|(place, parameter)| match &parameter.role {
        Role::Given(values) if differs(&parameter.name) => Some((place, &**values)),
        _ => None,
    })
}

fn with(candidate: &Candidate, name: &str, value: f64, held: bool) -> Candidate {
    let mut candidate = candidate.clone();
    if let Addition::Effect(term) = &mut candidate.addition {
        term.values.insert(name.to_string(), value);
        if held {
            term.held.push(name.to_string());
        }
    }
    candidate
}
