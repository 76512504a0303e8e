//! Models that the loop makes of others.

use super::added::Added;
use super::candidate::Addition;
use super::linearised::{Linearised, WEAK_PRIOR};
use super::select::{Nature, Searched, Situation, Taken};
use crate::block::Block;
use crate::camera;
use crate::effects::{Kind, Role};
use crate::model::{EffectTerm, Model, PRIOR_KEY};
use crate::problem::State;
use crate::problem::with_priors;
use crate::run::RunError;
use crate::run::fit::Fit;

/// Standard deviation (typical sizes) below which random values are none.
pub const SMALLEST_DEVIATION: f64 = 1e-4;

/// The model of a fit with the sets of `situation`, whatever it had taken in before. A set that joins does so in the
/// directions that the others leave: coefficients of the effect that the camera absorbs are held at zero, or they would
/// be estimated twice. A shape with a place starts at its predicted size, without which it has no place.
pub fn with_members(
    block: &Block,
    fit: &Fit,
    linearised: &Linearised,
    situation: &Situation<'_>,
    values: &[f64],
    added: &mut Added,
) -> Result<Model, RunError> {
    let is_member = |id: &str| situation.taken.iter().any(|taken| linearised.sets[taken.set].id == id);
    let mut model = at_solution(fit);
    let leaving = linearised.taken.iter().map(|taken| &linearised.sets[taken.set].id).filter(|id| !is_member(id));
    for id in leaving {
        take_out(&mut model, fit, id, added);
    }
    let state = linearised.moved(values);
    for taken in situation.taken.iter().filter(|taken| linearised.candidates[taken.set].is_some()) {
        let set = &linearised.sets[taken.set];
        match linearised.candidates[taken.set].as_ref().map(|candidate| &candidate.addition) {
            Some(Addition::Effect(term)) => {
                if let Searched::Places { count, .. } = set.search {
                    added.placed.insert(set.id.clone(), count);
                }
                let term = match set.nature {
                    Nature::Law => law(term, linearised, situation, taken.set, &state),
                    Nature::Chance => random(term, linearised, taken),
                };
                model.effects.push(term);
            }
            Some(Addition::Free(indices)) => {
                let held = |k: &usize| (*k, fit.solution.state.interiors.iter().map(|interior| interior[*k]).collect());
                added.freed.insert(set.id.clone(), indices.iter().map(held).collect());
                indices.iter().for_each(|k| model.free[*k] = true);
                model = with_priors(block, &model)?;
            }
            None => {}
        }
    }
    Ok(model)
}

/// The term of a law that joins.
fn law(term: &EffectTerm, linearised: &Linearised, situation: &Situation<'_>, set: usize, state: &State) -> EffectTerm {
    let mut term = term.clone();
    let own = &linearised.sets[set];
    // A value of a range is the place to start from, unless it is the default.
    for parameter in &term.effect.descriptor().parameters {
        let value = term.values.get(parameter.name.as_ref());
        if matches!(parameter.role, Role::Searched(_)) && value.is_some_and(|value| *value != parameter.nominal) {
            term.held.retain(|held| *held != parameter.name);
        }
    }
    let kept = situation.without(&own.id).beside().determined(&own.columns);
    if own.columns.len() > 1 {
        term.values.insert(PRIOR_KEY.to_string(), WEAK_PRIOR);
    }
    let problem = linearised.null.problem();
    let theta = problem.layout().theta(0);
    for column in &own.columns {
        let t = linearised.null.unknown(*column) - theta;
        let name = problem.theta[t].short_name(&own.id).to_string();
        if !kept.contains(column) {
            term.held.push(name.clone());
        }
        if matches!(own.search, Searched::Places { .. }) {
            term.values.insert(name, state.theta[t]);
        }
    }
    term
}

/// The term of random values that join, with their standard deviation.
fn random(term: &EffectTerm, linearised: &Linearised, taken: &Taken) -> EffectTerm {
    let mut term = term.clone();
    let deviation = taken.variance.sqrt().max(SMALLEST_DEVIATION);
    let unit = linearised.unit(linearised.sets[taken.set].columns[0]);
    let names = term.effect.descriptor().parameters.iter().filter_map(|parameter| match parameter.role {
        Role::Random(name) => Some(name.to_string()),
        _ => None,
    });
    let names: Vec<String> = names.collect();
    if names.is_empty() {
        // A field: every coefficient has a prior in its typical size.
        term.values.insert(PRIOR_KEY.to_string(), deviation);
    }
    term.values.extend(names.into_iter().map(|name| (name, deviation * unit)));
    term
}

/// Takes what the diagnosis took in out of a model; a group that was set free goes back to where it was held.
fn take_out(model: &mut Model, fit: &Fit, id: &str, added: &mut Added) {
    added.placed.remove(id);
    if let Some(held) = added.freed.remove(id) {
        for (k, values) in held {
            model.free[k] = false;
            model.priors.retain(|prior| prior.parameter != camera::PARAMETERS[k]);
            for (camera, value) in fit.problem.camera_names.iter().zip(values) {
                let of = model.camera_values.entry(camera.clone()).or_default();
                of.insert(camera::PARAMETERS[k].to_string(), value);
            }
        }
        return;
    }
    let mut position = 0;
    model.effects.retain(|term| {
        position += 1;
        position <= added.own || term.effect.descriptor().id != id
    });
}

/// The model with the start values of effects and cameras where its fit ended: what is adjusted with it again ends in
/// the same minimum. (An unflat sensor and a free centre of distortion have two, 2.7 units of `v'Pv` apart in a small
/// block.)
pub fn at_solution(fitted: &Fit) -> Model {
    let mut model = fitted.model.clone();
    let cameras = fitted.problem.camera_names.iter().zip(&fitted.problem.camera_free);
    for ((camera, free), interior) in cameras.zip(&fitted.solution.state.interiors) {
        let values = model.camera_values.entry(camera.clone()).or_default();
        let free = (0..free.len()).filter(|k| free[*k]);
        values.extend(free.map(|k| (camera::PARAMETERS[k].to_string(), interior[k])));
    }
    for (t, entry) in fitted.problem.theta.iter().enumerate() {
        let term = &mut model.effects[entry.effect as usize];
        let descriptor = term.effect.descriptor();
        match descriptor.parameters[entry.parameter as usize].role {
            Role::Random(name) => {
                if let Some(sigma) = entry.prior_sigma {
                    term.values.insert(name.to_string(), sigma);
                }
            }
            // They start at zero, or where the fit that is near ended.
            Role::VelocityError => {}
            _ => {
                let name = entry.short_name(&descriptor.id).to_string();
                term.values.insert(name, fitted.solution.state.theta[t]);
                if let (Kind::Empirical, Some(sigma)) = (descriptor.kind, entry.prior_sigma) {
                    term.values.insert(PRIOR_KEY.to_string(), sigma / entry.scale);
                }
            }
        }
    }
    model
}

/// The model with the start values of free camera parameters where the block has them: a fit of another model may have
/// driven them far away.
pub fn at_approximations(model: &Model) -> Model {
    let mut model = model.clone();
    let is_free = |name: &String| camera::PARAMETERS.iter().zip(model.free).any(|(own, free)| free && own == name);
    model.camera_values.values_mut().for_each(|values| values.retain(|name, _| !is_free(name)));
    model
}

/// The model with every place, width and lag held at its start value; `None` where none is free.
pub fn with_search_held(model: &Model) -> Option<Model> {
    let (mut held, mut any) = (model.clone(), false);
    for term in &mut held.effects {
        for parameter in &term.effect.descriptor().parameters {
            let known = term.held.iter().any(|name| *name == parameter.name);
            if matches!(parameter.role, Role::Searched(_)) && !known {
                term.held.push(parameter.name.to_string());
                any = true;
            }
        }
    }
    any.then_some(held)
}
