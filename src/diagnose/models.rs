//! Models that the loop makes of others.

use super::fit::Fit;
use super::score::Score;
use crate::camera;
use crate::effects::Role;
use crate::model::Model;

/// The model with a candidate in it, at the values that its score estimates.
pub fn with_candidate(model: &Model, score: &Score) -> Model {
    match score.start_term() {
        Some(term) => {
            let mut model = model.clone();
            model.effects.push(term);
            model
        }
        None => score.candidate.added_to(model),
    }
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
                let prefix = format!("{}.", descriptor.id);
                let name = entry.name.strip_prefix(&prefix).unwrap_or(&entry.name).to_string();
                term.values.insert(name, fitted.solution.state.theta[t]);
            }
        }
    }
    model
}

/// The model without some of its effects.
pub fn without_effects(model: &Model, ids: &[String]) -> Model {
    let mut model = model.clone();
    model.effects.retain(|term| !ids.iter().any(|id| term.effect.descriptor().id == *id));
    model
}
