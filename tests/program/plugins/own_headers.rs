//! Headers of ours with only the id changed: the solvers agree on the plug-in as they do on the effect that is built
//! in, at the same cost. (Some seconds: a compiler has to read Eigen and Ceres' Jets for each.)

use crate::common;
use crate::plugins::compiled::{CPP, compile};
use misclosure::adjust::Options;
use misclosure::block::Block;
use misclosure::effects::{Effect, plugin};
use misclosure::model::{Datum, EffectRef, EffectTerm, Model};
use misclosure::scenario::{Scenario, SurveyNoise, add_noise, add_survey_noise, simulate};
use std::path::Path;
use std::sync::Arc;

const HEADERS: [&str; 6] =
    ["decentring-high", "earth-curvature", "flat-port", "forward-motion", "gravity-sag", "unflatness"];
/// 28 images with everything that an effect may need.
const SMALL: &str = include_str!("../../diagnosis/score/small.toml");
/// px.
const NOISE: f64 = 0.3;
/// Relative difference of two costs, both converged by the rule of the solvers (1e-8 of a chi-square of about a
/// thousand).
const COST: f64 = 1e-9;

/// The header `id` as a plug-in `my-id`.
fn plugged(folder: &Path, id: &str) -> Arc<dyn Effect> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("cpp/effects/{id}.h"));
    let source = std::fs::read_to_string(path).expect("a header");
    let renamed = source.replace(&format!("\"{id}\""), &format!("\"my-{id}\""));
    assert_ne!(source, renamed);
    plugin::load(&compile(folder, &format!("my-{id}"), &renamed, CPP, &[])).expect("a plug-in")
}

fn block() -> Block {
    let scenario = Scenario::from_toml(SMALL, "small.toml").expect("a scenario");
    let mut block = simulate(&scenario, 1).expect("a block").block;
    add_noise(&mut block, NOISE, 1).expect("noise");
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, 1);
    block
}

#[test]
fn solvers_agree_on_plug_ins_as_on_what_is_built_in() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let block = block();
    let cost = |effect: EffectRef| {
        let term = EffectTerm { effect, values: Default::default(), held: Vec::new() };
        // A centre of distortion of its own beside an unflat sensor is found in some hundred iterations: not what is
        // tested here.
        let model = Model { datum: Datum::All, effects: vec![term], tie_dc_to_pp: true, ..Model::default() };
        common::try_both(&block, &model, &Options::default()).map(|run| run.solution().cost)
    };
    let plugins = std::thread::scope(|scope| {
        let compiled = HEADERS.map(|id| scope.spawn(|| plugged(folder.path(), id)));
        compiled.map(|thread| thread.join().expect("a plug-in"))
    });
    for (id, plugin) in HEADERS.into_iter().zip(plugins) {
        let own = cost(EffectRef::Builtin(misclosure::effects::find(id).expect("an effect")))
            .unwrap_or_else(|text| panic!("{id} built in: {text}"));
        let other = cost(EffectRef::Plugin(plugin)).unwrap_or_else(|text| panic!("{id} as a plug-in: {text}"));
        assert!((other / own - 1.0).abs() < COST, "{id}: cost {other} instead of {own}");
    }
}
