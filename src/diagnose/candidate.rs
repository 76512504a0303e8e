//! What may be missing: every effect of the catalogue and of plug-ins, and every group of camera parameters that the
//! model holds.

use crate::block::Block;
use crate::camera;
use crate::effects::{self, Kind, Role};
use crate::model::{EffectRef, EffectTerm, Model};
use crate::problem::{Problem, missing_need};
use std::collections::BTreeMap;

/// Effects that go on a series of the camera, with the group of its lower terms: a term of a series is tested beside
/// the terms below it, never in their place (principle of marginality, Nelder 1977).
const SERIES: [(&str, &str); 2] = [("radial-high", "free:radial"), ("decentring-high", "free:decentring")];

/// Group of the lower terms of an effect's series.
pub fn lower_terms(id: &str) -> Option<&'static str> {
    SERIES.iter().find(|(higher, _)| *higher == id).map(|(_, group)| *group)
}

/// Are the values of an effect random, with a variance that is estimated? Those of random effects are, and the
/// coefficients of a field.
pub fn is_random(effect: &EffectRef) -> bool {
    let descriptor = effect.descriptor();
    let random = |parameter: &effects::Parameter| matches!(parameter.role, Role::Random(_));
    descriptor.kind == Kind::Empirical || descriptor.parameters.iter().any(random)
}

/// How a candidate enters the model.
#[derive(Debug, Clone)]
pub enum Addition {
    /// An effect at its nominal parameters (searched ones at a stated place).
    Effect(EffectTerm),
    /// Camera parameters set free, as positions in [`camera::PARAMETERS`].
    Free(Vec<usize>),
}

/// Something that may be missing.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Effect id, or `free:f`.
    pub id: String,
    /// How it enters the model.
    pub addition: Addition,
    /// What the block lacks to test it, or why it is not tested.
    pub needs: Vec<String>,
    /// Names a cause; an empirical one only takes a shape away.
    pub physical: bool,
}

impl Candidate {
    fn of_effect(block: &Block, problem: &Problem, model: &Model, effect: EffectRef) -> Self {
        let descriptor = effect.descriptor();
        let id = descriptor.id.to_string();
        let mut needs: Vec<String> = descriptor
            .needs
            .iter()
            .filter_map(|need| missing_need(block, &problem.image_contexts, *need, model.datum))
            .map(String::from)
            .collect();
        if model.effects.iter().any(|term| term.effect.descriptor().id == descriptor.id) {
            needs.push("nothing: it is in the model".into());
        }
        if let Some(group) = lower_terms(&id).and_then(|group| group.strip_prefix("free:"))
            && camera::GROUPS.iter().any(|(name, own)| *name == group && own.iter().any(|k| !model.free[*k]))
        {
            needs.push(format!("the lower terms of its series in the model (--free {group})"));
        }
        let physical = descriptor.kind == Kind::Physical;
        let addition =
            Addition::Effect(EffectTerm { effect: effect.clone(), values: BTreeMap::new(), held: Vec::new() });
        Self { id, addition, needs, physical }
    }

    /// It can be tested.
    pub fn testable(&self) -> bool {
        self.needs.is_empty()
    }

    /// The effect's term, for effects.
    pub fn term(&self) -> Option<&EffectTerm> {
        match &self.addition {
            Addition::Effect(term) => Some(term),
            Addition::Free(_) => None,
        }
    }

    /// The effect's values are random: tested as a variance component.
    pub fn random(&self) -> bool {
        self.term().is_some_and(|term| is_random(&term.effect))
    }

    /// The effect is nonlinear in a place on the sensor, which a scan finds.
    pub fn scanned(&self) -> bool {
        let on_sensor = |p: &effects::Parameter| {
            matches!(p.role, Role::Searched(effects::Domain::SensorX | effects::Domain::SensorY))
        };
        self.term().is_some_and(|term| term.effect.descriptor().parameters.iter().any(on_sensor))
    }
}

/// Every candidate, in catalogue order: built-in effects, plug-ins, held groups of camera parameters.
pub fn candidates(block: &Block, problem: &Problem, model: &Model, plugins: &[EffectRef]) -> Vec<Candidate> {
    let builtin = effects::catalogue().iter().map(|effect| EffectRef::Builtin(*effect));
    let mut list: Vec<Candidate> = builtin
        .chain(plugins.iter().cloned())
        .map(|effect| Candidate::of_effect(block, problem, model, effect))
        .collect();
    for (group, indices) in camera::GROUPS {
        let held: Vec<usize> =
            indices.iter().copied().filter(|k| !(model.free[*k] || model.tie_dc_to_pp && matches!(k, 3 | 4))).collect();
        if !held.is_empty() {
            let id = format!("free:{group}");
            list.push(Candidate { id, addition: Addition::Free(held), needs: Vec::new(), physical: true });
        }
    }
    list
}
