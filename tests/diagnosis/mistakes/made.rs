//! Blocks with noise, and what people do to their tables.

use super::common;
use misclosure::adjust::Options;
use misclosure::block::{Block, Role};
use misclosure::diagnose::settings::Settings;
use misclosure::mistakes::Mistake;
use misclosure::model::Model;
use misclosure::scenario::{SurveyNoise, add_noise, add_survey_noise};
use misclosure::screening;
use nalgebra::Vector3;

/// Presets and seeds of every test.
pub const BLOCKS: [(&str, u64); 4] = [("dike", 1), ("dike", 2), ("mapping", 3), ("mapping", 4)];
/// px.
const NOISE: f64 = 0.3;
/// Surveyed points that are kept: control, and check points enough.
const SURVEYED: usize = 60;
const SIGNIFICANCE: f64 = 1e-3;

/// A block of which nothing is wrong but noise.
pub fn block(preset: &str, seed: u64) -> Block {
    let mut block = common::preset(preset, &[("points", 1500.0)], seed).block;
    few_checks(&mut block);
    with_noise(block, seed)
}

/// A block with `points` tie points, all its check points, and noise.
pub fn noisy(preset: &str, points: f64, seed: u64) -> Block {
    with_noise(common::preset(preset, &[("points", points)], seed).block, seed)
}

fn with_noise(mut block: Block, seed: u64) -> Block {
    add_noise(&mut block, NOISE, seed).expect("noise");
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: true }, seed);
    block
}

/// Leaves out most check points.
pub fn few_checks(block: &mut Block) {
    block.surveyed.truncate(SURVEYED);
    block.marks.retain(|mark| mark.point.index() < SURVEYED);
}

/// Mistakes that are named in a block.
pub fn named(block: &Block) -> Vec<Mistake> {
    named_under(block, &Model::default())
}

/// The same before an adjustment of a model, whose datum may need more than the block has.
pub fn named_under(block: &Block, model: &Model) -> Vec<Mistake> {
    screening::mistakes(&block.clone().about_its_centre(), model, SIGNIFICANCE, &Options::default())
}

/// Of a diagnosis.
pub fn settings() -> Settings<'static> {
    Settings { plugins: &[], options: Options::default(), significance: SIGNIFICANCE, snoop: true, tell: &|_| {} }
}

/// Rewrites the coordinates of surveyed points of a role.
pub fn points(block: &mut Block, role: Role, rewrite: impl Fn(Vector3<f64>) -> Vector3<f64>) {
    let list = block.surveyed.iter_mut().filter(|point| point.role == role);
    list.for_each(|point| point.position = rewrite(point.position));
}

/// Rewrites the GNSS positions.
pub fn gnss(block: &mut Block, rewrite: impl Fn(usize, Vector3<f64>) -> Vector3<f64>) {
    for (k, image) in block.images.iter_mut().enumerate() {
        if let Some(gnss) = &mut image.gnss {
            gnss.position = rewrite(k, gnss.position);
        }
    }
}

/// The mistake of a kind and subject among those that are named; fails without it.
pub fn expect<'a>(found: &'a [Mistake], kind: &str, subject: &str, what: &str) -> &'a Mistake {
    let is_it = |mistake: &&Mistake| mistake.kind == kind && mistake.subject == subject;
    let brief: Vec<_> = found.iter().map(|m| (&m.kind, &m.subject, &m.sentence)).collect();
    found.iter().find(is_it).unwrap_or_else(|| panic!("{what}: no {kind} of {subject} among {brief:?}"))
}

/// The only mistake that is named; fails where there are others.
pub fn only<'a>(found: &'a [Mistake], kind: &str, subject: &str, what: &str) -> &'a Mistake {
    let one = expect(found, kind, subject, what);
    assert_eq!(found.len(), 1, "{what}: {found:?}");
    one
}

/// A value within three standard deviations.
pub fn assert_value(mistake: &Mistake, expected: f64, what: &str) {
    let value = mistake.value.unwrap_or(f64::NAN);
    let sigma = mistake.sigma.unwrap_or(1e-4 * expected.abs());
    assert!((value - expected).abs() <= 3.0 * sigma, "{what}: {value} ± {sigma} instead of {expected}");
}
