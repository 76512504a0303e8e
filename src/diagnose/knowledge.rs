//! Knowledge is a prior: in a projected coordinate system the curvature of the Earth and the scale of the map are
//! known, and need not be discovered. In one block at one height neither could be told from radial distortion or from
//! the scale of the block.

use crate::block::{Block, Role};
use crate::effects;
use crate::geodesy::map;
use crate::model::{Datum, EffectRef, EffectTerm, Model};
use serde::{Deserialize, Serialize};

/// A size that is known from elsewhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// The effect.
    pub effect: String,
    /// Its parameter.
    pub parameter: String,
    /// Its value, in the parameter's unit.
    pub value: f64,
    /// How it is known, in words.
    pub source: String,
}

/// `model` with the effects that a block's coordinate system says are there, held at their known sizes. An effect of
/// the user's own model stays as it is.
pub fn with_known(block: &Block, model: &Model) -> (Model, Vec<Known>) {
    let mut model = model.clone();
    let mut all = Vec::new();
    for known in of_map(block, model.datum) {
        let has = |term: &EffectTerm| term.effect.descriptor().id == known.effect;
        let Some(effect) = effects::find(&known.effect).filter(|_| !model.effects.iter().any(has)) else { continue };
        model.effects.push(EffectTerm {
            effect: EffectRef::Builtin(effect),
            values: [(known.parameter.clone(), known.value)].into(),
            held: vec![known.parameter.clone()],
        });
        all.push(known);
    }
    (model, all)
}

/// What the block's map says; nothing where its coordinates are Cartesian, or where none of them take part.
fn of_map(block: &Block, datum: Datum) -> Vec<Known> {
    let control = || block.surveyed.iter().filter(|point| point.role == Role::Control).map(|point| point.position);
    let antennas = || block.images.iter().filter_map(|image| Some(image.gnss.as_ref()?.position));
    let surveyed: Vec<_> = match datum {
        Datum::Free => return Vec::new(),
        Datum::Control => control().collect(),
        Datum::Gnss => antennas().collect(),
        Datum::All if control().next().is_some() => control().collect(),
        Datum::All => antennas().collect(),
    };
    if surveyed.is_empty() {
        return Vec::new();
    }
    let centre = surveyed.iter().sum::<nalgebra::Vector3<f64>>() / surveyed.len() as f64 + block.origin;
    let Some(scale) = map::scale(&block.crs, centre.into()) else { return Vec::new() };
    let known = |effect: &str, parameter: &str, value: f64, what: &str| Known {
        effect: effect.into(),
        parameter: parameter.into(),
        value,
        source: format!("{what} ({})", block.crs),
    };
    vec![
        known("earth-curvature", "q", 1.0, "heights of a map count from the curved Earth"),
        known("map-scale", "m", scale, "point scale of the projection at the survey's centre and its mean height"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{Scenario, simulate};

    #[test]
    fn a_map_has_a_known_scale_and_a_local_block_has_none() {
        let scenario = Scenario::preset("mapping", &[("points".to_string(), 100.0)].into()).expect("a preset");
        let mut block = simulate(&scenario, 1).expect("a block").block;
        let model = Model { datum: Datum::All, ..Model::default() };
        assert!(with_known(&block, &model).1.is_empty());
        block.crs = "EPSG:32632".into();
        block.origin = nalgebra::Vector3::new(500_000.0, 5_000_000.0, 0.0);
        let (with, known) = with_known(&block, &model);
        let sizes: Vec<(&str, f64)> = known.iter().map(|known| (known.effect.as_str(), known.value)).collect();
        assert!(
            matches!(sizes[..], [("earth-curvature", 1.0), ("map-scale", m)] if (m + 4e-4).abs() < 1e-5),
            "{sizes:?}"
        );
        assert_eq!(with.effects.len(), 2);
        assert!(with_known(&block, &with).1.is_empty(), "what is in the model stays as it is");
        assert!(with_known(&block, &Model::default()).1.is_empty(), "a free block has no survey");
    }
}
