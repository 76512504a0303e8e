//! Models that the loop makes of others.

use super::added::Added;
use super::candidate::Addition;
use super::fit::{DiagnoseError, Fit};
use super::linearised::Linearised;
use super::select::{Judged, Nature, Searched, Set, Situation};
use super::test::System;
use crate::block::Block;
use crate::camera;
use crate::effects::Role;
use crate::model::{Model, PRIOR_KEY};
use crate::problem::Problem;

/// Standard deviation, in typical sizes, of the prior of an effect of several coefficients: no effect of this size is met, and what the
/// measurements determine to a typical size moves by a thousandth.
const WEAK_PRIOR: f64 = 30.0;

/// The drop of `v'Pv` that the refit of a set brings to first order: that of its test, less what the prior of its coefficients keeps back and
/// what those would take that are not determined well enough to be estimated.
pub fn predicted_drop(linearised: &Linearised, beside: &System, judged: &Judged) -> f64 {
    let set = &linearised.sets[judged.set];
    let is_effect = linearised.candidates[judged.set].as_ref().is_some_and(|candidate| candidate.term().is_some());
    match is_effect && has_prior(set) {
        true => beside.drop_with_prior(&beside.determined(&set.columns), WEAK_PRIOR.powi(2)),
        false => judged.drop,
    }
}

/// A law of several coefficients, some of which a block may hardly determine.
fn has_prior(set: &Set) -> bool {
    set.nature == Nature::Law && set.columns.len() > 1
}

/// The model with a set in it, and its problem, which starts where the fit ended: its first step is then the one that the null model predicts,
/// as far as the solver's damping trusts it. In the directions that the base leaves: coefficients of the effect that the camera absorbs are
/// held at zero, or they would be estimated twice. A shape with a place starts at its predicted size, without which it has no place.
pub fn with_set(
    block: &Block,
    fit: &Fit,
    linearised: &Linearised,
    situation: &Situation<'_>,
    set: usize,
    values: &[f64],
    added: &mut Added,
) -> Result<(Model, Problem), DiagnoseError> {
    let mut model = at_solution(fit);
    let id = &linearised.sets[set].id;
    let extended = linearised.null.problem();
    let state = linearised.moved(values);
    match linearised.candidates[set].as_ref().map(|candidate| &candidate.addition) {
        Some(Addition::Effect(term)) => {
            let mut term = term.clone();
            // A value of a range is the place to start from, unless it is the default.
            for parameter in &term.effect.descriptor().parameters {
                let value = term.values.get(parameter.name.as_ref());
                if matches!(parameter.role, Role::Searched(_)) && value.is_some_and(|value| *value != parameter.nominal)
                {
                    term.held.retain(|held| *held != parameter.name);
                }
            }
            let columns = &linearised.sets[set].columns;
            let kept = situation.without(id).beside().determined(columns);
            if has_prior(&linearised.sets[set]) {
                term.values.insert(PRIOR_KEY.to_string(), WEAK_PRIOR);
            }
            let theta = extended.layout().theta(0);
            let scanned = matches!(linearised.sets[set].search, Searched::Places { .. });
            if let Searched::Places { count, .. } = linearised.sets[set].search {
                added.placed.insert(id.clone(), count);
            }
            for column in columns {
                let entry = &extended.theta[linearised.null.unknown(*column) - theta];
                let name = entry.short_name(id).to_string();
                if linearised.sets[set].nature == Nature::Law {
                    if !kept.contains(column) {
                        term.held.push(name.clone());
                    }
                    if scanned {
                        term.values.insert(name, state.theta[linearised.null.unknown(*column) - theta]);
                    }
                }
            }
            if let (Nature::Chance, Some(taken)) = (linearised.sets[set].nature, situation.taken.last()) {
                for parameter in &term.effect.descriptor().parameters {
                    if let Role::Random(name) = parameter.role {
                        let unit = linearised.unit(columns[0]);
                        term.values.insert(name.to_string(), taken.variance.sqrt().max(1e-4) * unit);
                    }
                }
            }
            model.effects.push(term);
        }
        Some(Addition::Free(indices)) => {
            let held = |k: &usize| (*k, fit.solution.state.interiors.iter().map(|interior| interior[*k]).collect());
            added.freed.insert(id.clone(), indices.iter().map(held).collect());
            indices.iter().for_each(|k| model.free[*k] = true);
        }
        None => {}
    }
    let problem = Problem::near(block, &model, Some((&fit.problem, &fit.solution.state)))?;
    Ok((model, problem))
}

/// The model of a fit without one of the effects that the diagnosis took in; a group that was set free goes back to where it was held.
pub fn without_effect(fit: &Fit, id: &str, added: &mut Added) -> Model {
    let mut model = at_solution(fit);
    added.placed.remove(id);
    if let Some(held) = added.freed.remove(id) {
        for (k, values) in held {
            model.free[k] = false;
            for (camera, value) in fit.problem.camera_names.iter().zip(values) {
                let of = model.camera_values.entry(camera.clone()).or_default();
                of.insert(camera::PARAMETERS[k].to_string(), value);
            }
        }
        return model;
    }
    let mut position = 0;
    model.effects.retain(|term| {
        position += 1;
        position <= added.own || term.effect.descriptor().id != id
    });
    model
}

/// The model with the start values of effects and cameras where its fit ended: what is adjusted with it again ends in the same minimum. (An
/// unflat sensor and a free centre of distortion have two, 2.7 units of `v'Pv` apart in a small block.)
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
            _ => {
                let name = entry.short_name(&descriptor.id).to_string();
                term.values.insert(name, fitted.solution.state.theta[t]);
            }
        }
    }
    model
}

/// The model with the start values of free camera parameters where the block has them: a fit of another model may have driven them far away.
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
