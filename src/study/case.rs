//! One case of the study: a block, the errors put into it, and the model that it is adjusted with. All of it is plain
//! data, so that a finished case can be known again.

use crate::camera::parameter_indices;
use crate::effects;
use crate::model::{EffectRef, EffectTerm, Model, PRIOR_KEY, TieWeights};
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// Unique; names the file of its result.
    pub key: String,
    /// Preset of the scenario.
    pub preset: String,
    /// Parameters of the scenario that are not the preset's.
    pub settings: BTreeMap<String, f64>,
    /// Seed of the scenario.
    pub seed: u64,
    /// Errors, as `misclosure inject` takes them.
    pub errors: Vec<String>,
    /// Flights that are kept, after the errors; none: all.
    pub flights: Vec<String>,
    /// Camera parameters that are held, as `--fix` takes them.
    pub fixed: Vec<String>,
    /// Effects in the model.
    pub effects: Vec<Term>,
    /// Weights of the tie points.
    pub tie_weights: TieWeights,
    /// Keep what pictures need: residuals point by point, the fields over the sensor, the focal length of each image.
    pub pictures: bool,
}

/// An effect in the model of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// Id of a built-in effect.
    pub id: String,
    /// Start values and given values, and the factor of a weak prior.
    pub values: BTreeMap<String, f64>,
}

impl Term {
    /// An effect with nominal start values.
    pub fn new(id: &str) -> Self {
        Self { id: id.into(), values: BTreeMap::new() }
    }

    /// With a start value, or the value of a given parameter.
    pub fn value(mut self, name: &str, value: f64) -> Self {
        self.values.insert(name.into(), value);
        self
    }

    /// With a weak prior of every estimated value: so many times its typical size.
    pub fn prior(self, factor: f64) -> Self {
        self.value(PRIOR_KEY, factor)
    }
}

impl Case {
    /// A case of the study's block: no error, all twelve parameters free, unit weights.
    pub fn dike(key: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            preset: "dike".into(),
            settings: BTreeMap::new(),
            seed: SEED,
            errors: Vec::new(),
            flights: Vec::new(),
            fixed: Vec::new(),
            effects: Vec::new(),
            tie_weights: TieWeights::Unit,
            pictures: false,
        }
    }

    /// With an error.
    pub fn error(mut self, error: impl Into<String>) -> Self {
        self.errors.push(error.into());
        self
    }

    /// With these flights alone.
    pub fn flights(self, flights: &[&str]) -> Self {
        Self { flights: flights.iter().map(ToString::to_string).collect(), ..self }
    }

    /// With a camera parameter held.
    pub fn fix(mut self, name: &str) -> Self {
        self.fixed.push(name.into());
        self
    }

    /// With an effect in the model.
    pub fn effect(mut self, term: Term) -> Self {
        self.effects.push(term);
        self
    }

    /// With these weights.
    pub fn weights(self, tie_weights: TieWeights) -> Self {
        Self { tie_weights, ..self }
    }

    /// With a parameter of the scenario.
    pub fn setting(mut self, name: &str, value: f64) -> Self {
        self.settings.insert(name.into(), value);
        self
    }

    /// With what pictures need.
    pub fn pictures(self) -> Self {
        Self { pictures: true, ..self }
    }

    /// The model.
    ///
    /// # Errors
    /// A name that is no camera parameter or no effect.
    pub fn model(&self) -> Result<Model> {
        let mut model = Model { tie_weights: self.tie_weights, ..Model::default() };
        for name in &self.fixed {
            let indices = parameter_indices(name).with_context(|| format!("no camera parameter is called `{name}`"))?;
            indices.into_iter().for_each(|index| model.free[index] = false);
        }
        for term in &self.effects {
            let effect = effects::find(&term.id).with_context(|| format!("no effect is called `{}`", term.id))?;
            let effect = EffectRef::Builtin(effect);
            model.effects.push(EffectTerm { effect, values: term.values.clone(), held: Vec::new() });
        }
        Ok(model)
    }
}

/// Seed of every scenario of the study: the published block cannot be had, so its random part is drawn once and stated.
pub const SEED: u64 = 1;
