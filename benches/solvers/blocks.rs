//! The blocks and models that are solved.

use anyhow::{Context, Result};
use misclosure::effects::find;
use misclosure::model::{Datum, EffectRef, EffectTerm, Model};
use misclosure::problem::{Problem, ProblemError};
use misclosure::scenario::{Perturbation, Scenario, SurveyNoise, add_noise, add_survey_noise, simulate};
use std::collections::{BTreeMap, BTreeSet};

/// A simulated block.
pub struct Block {
    pub name: &'static str,
    preset: &'static str,
    parameters: &'static [(&'static str, f64)],
    /// Memory, bytes, below which it is left out.
    pub needs: u64,
    /// What Ceres takes of it, a kilobyte a measurement, no machine for this has.
    pub with_ceres: bool,
}

/// The scenario that is no preset.
const AREAL: &str = "areal";

const GIGABYTE: u64 = 1_000_000_000;

pub const BLOCKS: [Block; 4] = [
    Block {
        name: "small",
        preset: "dike",
        parameters: &[("points", 26_300.0), ("check", 0.0)],
        needs: 0,
        with_ceres: true,
    },
    Block {
        name: "medium",
        preset: "corridor",
        parameters: &[("length_m", 2000.0), ("points", 352_000.0), ("check", 0.0)],
        needs: 4 * GIGABYTE,
        with_ceres: true,
    },
    Block { name: AREAL, preset: AREAL, parameters: &[("points", 360_000.0)], needs: 4 * GIGABYTE, with_ceres: true },
    Block {
        name: "large",
        preset: "corridor",
        parameters: &[("length_m", 9500.0), ("points", 1_670_000.0), ("check", 0.0)],
        needs: 8 * GIGABYTE,
        with_ceres: false,
    },
];

/// Models whose cost is held against that of the plain camera: an effect of each stage that every measurement goes
/// through, alone and all together, and values of every image.
pub const MODELS: [(&str, &[&str]); 7] = [
    ("plain", &[]),
    ("exposure", &["rolling-shutter"]),
    ("ray", &["refraction"]),
    ("interior", &["focal-time"]),
    ("image", &["decentring-high"]),
    ("each stage", &["rolling-shutter", "refraction", "focal-time", "decentring-high"]),
    ("per image", &["focal-image"]),
];

/// The plain camera without any datum, which is all that the reference knows; those above have that of control and
/// GNSS.
pub const FREE: &str = "free";

const SEED: u64 = 1;
const NOISE_PX: f64 = 0.3;

/// Approximations as a GNSS receiver of one frequency and a gimbal give them; the points are intersected.
const START: Perturbation = Perturbation { focal_fraction: 2e-3, position_m: 0.1, angle_rad: 2e-3, points: true };

pub fn block(name: &str) -> Result<&'static Block> {
    let names = BLOCKS.map(|block| block.name).join(", ");
    BLOCKS.iter().find(|block| block.name == name).with_context(|| format!("no block {name}; there are: {names}"))
}

pub fn problem(block: &Block, model: &str) -> Result<Problem> {
    let overrides = block.parameters.iter().map(|(key, value)| (key.to_string(), *value)).collect();
    let scenario = match block.preset {
        AREAL => Scenario::from_toml_with(include_str!("areal.toml"), "areal.toml", &overrides)?,
        preset => Scenario::preset(preset, &overrides)?,
    };
    let mut simulation = simulate(&scenario, SEED)?;
    add_noise(&mut simulation.block, NOISE_PX, SEED)?;
    add_survey_noise(&mut simulation.block, SurveyNoise { gnss: true, control: true, check: false }, SEED);
    simulation.perturb_start(START, SEED)?;
    let (block, model) = (&mut simulation.block, with_effects(model)?);
    match Problem::new(block, &model) {
        // Of hundreds of thousands of points, one or two are seen from two places that hardly differ.
        Err(ProblemError::NoIntersection { points }) => {
            let names: BTreeSet<&str> = points.iter().map(String::as_str).collect();
            let meets: Vec<bool> = block.tie_points.iter().map(|p| !names.contains(p.name.as_str())).collect();
            block.ties.retain(|measurement| meets[measurement.point.index()]);
            Ok(Problem::new(block, &model)?)
        }
        problem => Ok(problem?),
    }
}

fn with_effects(model: &str) -> Result<Model> {
    if model == FREE {
        return Ok(Model::default());
    }
    let (_, ids) = MODELS.iter().find(|(name, _)| *name == model).context("unknown model")?;
    let mut effects = Vec::new();
    for id in *ids {
        let effect = EffectRef::Builtin(find(id).with_context(|| format!("no effect {id}"))?);
        effects.push(EffectTerm { effect, values: BTreeMap::new(), held: Vec::new() });
    }
    Ok(Model { datum: Datum::All, effects, ..Model::default() })
}
