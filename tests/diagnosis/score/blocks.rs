//! Blocks, and their screening as a diagnosis makes it.

use misclosure::adjust::{CovarianceOf, Options};
use misclosure::block::Block;
use misclosure::diagnose::settings::Settings;
use misclosure::measure::Predictor;
use misclosure::model::{Datum, EffectTerm, Model};
use misclosure::problem::Problem;
use misclosure::run::fit::{Fit, fit};
use misclosure::scenario::{Scenario, SurveyNoise, add_noise, add_survey_noise, simulate};
use std::collections::BTreeMap;

/// Family-wise level of the screenings; no test here depends on it.
pub const SIGNIFICANCE: f64 = 1e-3;
/// Effects whose size these blocks, at most some hundred metres across, would know worse than physics limits it.
pub const UNTESTABLE: [&str; 2] = ["earth-curvature", "refraction"];
/// Seed of the blocks' geometry.
const GEOMETRY: u64 = 1;

/// Settings of every screening.
pub fn settings() -> Settings<'static> {
    Settings { plugins: &[], options: options(), significance: SIGNIFICANCE, snoop: true, tell: &|_| {} }
}

/// Options of every fit: one thread each, the tests take turns on several blocks at once.
pub fn options() -> Options {
    Options { threads: 1, covariance: CovarianceOf::Nothing, ..Options::default() }
}

/// The small block of this test without errors; its approximations are the truth.
pub fn small() -> Block {
    let scenario = Scenario::from_toml(include_str!("small.toml"), "small.toml").expect("a scenario");
    simulate(&scenario, GEOMETRY).expect("a block").block
}

/// A preset without errors; its approximations are the truth.
pub fn preset(name: &str, parameters: &[(&str, f64)]) -> Block {
    let parameters: BTreeMap<String, f64> = parameters.iter().map(|(key, value)| (key.to_string(), *value)).collect();
    let scenario = Scenario::preset(name, &parameters).expect("a preset");
    simulate(&scenario, GEOMETRY).expect("a block").block
}

/// The block with errors of its stated standard deviations.
pub fn with_noise(block: &Block, seed: u64) -> Block {
    let mut block = block.clone();
    let px = block.sigma.tie_px;
    assert_eq!(block.sigma.mark_px, px, "one standard deviation for ties and marks");
    add_noise(&mut block, px, seed).expect("noise");
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, seed);
    block
}

/// Everything free, all observations of positions in.
pub fn everything_free() -> Model {
    Model { datum: Datum::All, ..Model::default() }
}

/// Fits, or says for which block not.
pub fn fitted(block: &Block, model: &Model) -> Fit {
    fit(block, model, None, &options()).unwrap_or_else(|error| panic!("{}: {error}", block.name))
}

/// The error-free block as it is measured under an effect whose free parameters take the values `size` times their
/// typical sizes, in turn up and down.
///
/// The effect's own formula makes these measurements: what is tested with them is whether a prediction to first order
/// meets the refit, and both see the same block.
pub fn measured_under(block: &Block, term: &EffectTerm, size: f64) -> Block {
    let model = Model { effects: vec![term.clone()], ..everything_free() };
    let problem = Problem::new(block, &model).unwrap_or_else(|error| panic!("{term:?}: {error}"));
    let mut state = problem.start.clone();
    let free = problem.theta.iter().enumerate().filter(|(_, entry)| entry.free);
    for (number, (t, entry)) in free.enumerate() {
        state.theta[t] += size * entry.scale * if number % 2 == 0 { 1.0 } else { -1.0 };
    }
    let predictor = Predictor::new(&problem, &state).unwrap_or_else(|error| panic!("{term:?}: {error}"));
    let mut measured = block.clone();
    let ties =
        measured.ties.iter_mut().map(|row| (block.tie_points[row.point.index()].position.expect("the truth"), row));
    let marks = measured.marks.iter_mut().map(|row| (block.surveyed[row.point.index()].position, row));
    for (point, row) in ties.chain(marks) {
        let (at, _) = predictor.image_point(row.image.index(), &point).expect("in the domain");
        (row.x, row.y) = (at[0], at[1]);
    }
    for (i, image) in measured.images.iter_mut().enumerate() {
        if let Some(gnss) = image.gnss.as_mut() {
            gnss.position = predictor.antenna(i).expect("in the domain");
        }
    }
    for point in &mut measured.surveyed {
        point.position = predictor.surveyed(&point.position).expect("in the domain");
    }
    measured
}
