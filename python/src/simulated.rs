//! Simulated blocks, and blocks that are measured again under errors.

use misclosure::block::Block;
use misclosure::inject::{self, Injected, Other};
use misclosure::kit::inject::ByFormula;
use misclosure::model::EffectRef;
use misclosure::scenario::{
    Perturbation, Scenario, Simulation, SurveyNoise, add_noise, add_survey_noise, preset_names,
};
use misclosure::shared::{self, Usage};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A preset by its name, or the file of a scenario.
pub fn read_scenario(name: &str, overrides: &BTreeMap<String, f64>) -> anyhow::Result<Scenario> {
    if preset_names().contains(&name) {
        return Ok(Scenario::preset(name, overrides)?);
    }
    if !name.ends_with(".toml") {
        let presets = preset_names().join(", ");
        return Err(Usage(format!("`{name}` is neither a preset ({presets}) nor a scenario's file")).into());
    }
    let text = std::fs::read_to_string(name);
    let text = text.map_err(|error| Usage(format!("cannot read the scenario {name}: {error}")))?;
    Ok(Scenario::from_toml_with(&text, name, overrides)?)
}

/// Noise, and wrong start values: of the focal lengths (a fraction), of positions (m), of rotations (rad).
pub fn disturb(
    simulation: &mut Simulation,
    seed: u64,
    noise_px: f64,
    noise_survey: bool,
    [focal_fraction, position_m, angle_rad]: [f64; 3],
    points: bool,
) -> anyhow::Result<()> {
    add_noise(&mut simulation.block, noise_px, seed)?;
    if noise_survey {
        add_survey_noise(&mut simulation.block, SurveyNoise { gnss: true, control: true, check: true }, seed);
    }
    Ok(simulation.perturb_start(Perturbation { focal_fraction, position_m, angle_rad, points }, seed)?)
}

/// The block measured again in the world of its truth, and what was done.
pub fn measured_again(
    block: &Block,
    truth: Option<&Block>,
    errors: &[String],
    plugins: &[PathBuf],
    seed: u64,
) -> anyhow::Result<(Block, serde_json::Value)> {
    let refused = |error: anyhow::Error| Usage(format!("{error:#}"));
    let no_truth = || Usage("this block has no truth: errors are injected into simulated blocks".into());
    let truth = truth.ok_or_else(no_truth)?;
    let plugins: Vec<EffectRef> = shared::plugins(plugins)?.into_iter().map(EffectRef::Plugin).collect();
    let (mut injections, mut others): (Vec<_>, Vec<Other>) = (Vec::new(), Vec::new());
    for text in errors {
        let id = text.split(':').next().unwrap_or_default();
        if plugins.iter().any(|effect| effect.descriptor().id == id) {
            let term = shared::term(text, &plugins)?;
            let (applied, action) = ByFormula::new(block, truth, &term, seed).map_err(refused)?;
            others.push((applied, Box::new(action)));
        } else {
            injections.push(inject::parse(text).map_err(refused)?);
        }
    }
    let Injected { block, report } = inject::apply_with(block, truth, &injections, others, seed).map_err(refused)?;
    Ok((block, serde_json::to_value(&report)?))
}
