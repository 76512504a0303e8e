//! p-values where nothing is missing: uniform for every linear candidate, not too small for those whose p-value is a
//! bound (a scanned place or lag, a variance component).
//!
//! The p-value of a linear candidate is that of F with the estimated variance factor, as the program computes it:
//! exactly uniform, for any redundancy, while the base is linear over the size of the noise. Family-wise over all
//! candidates: Bonferroni.

use super::blocks::{UNTESTABLE, everything_free, fitted, settings, small, with_noise};
use super::in_turn::in_turn;
use misclosure::block::Block;
use misclosure::camera;
use misclosure::diagnose::added::Added;
use misclosure::diagnose::linearised::linearise;
use misclosure::effects::{self, Role, Stage};
use misclosure::math::statistics::kolmogorov_smirnov;
use misclosure::model::Model;
use std::collections::{BTreeMap, BTreeSet};

/// Blocks with noise alone.
const BLOCKS: u64 = 240;
/// Probability that any candidate fails though all p-values are what they should be.
const FAMILY_LEVEL: f64 = 0.05;

/// What is known of a candidate's p-value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// F: uniform.
    Exact,
    /// Corrected for a search, or an approximated tail: not too small.
    Bound,
}

fn kind(id: &str) -> Kind {
    let bounded = |role: &Role| matches!(role, Role::Random(_) | Role::Searched(_));
    let effect = effects::find(id);
    // The best of the kinds of coordinates that it may act on, too.
    let chosen = |effect: &dyn effects::Effect| effect.descriptor().stage == Stage::Frame;
    // Coefficients of a field are random values.
    let field = |effect: &dyn effects::Effect| effect.descriptor().kind == effects::Kind::Empirical;
    let bound = effect.is_some_and(|effect| {
        chosen(effect) || field(effect) || effect.descriptor().parameters.iter().any(|p| bounded(&p.role))
    });
    if bound { Kind::Bound } else { Kind::Exact }
}

/// p-values of every candidate of a model.
fn tested(block: &Block, model: &Model) -> Vec<(String, f64)> {
    let fit = fitted(block, model);
    let settings = settings();
    let linearised = linearise(block, &fit, &Added::default(), &settings).expect("a null model");
    let situation = linearised.situation(&settings);
    let judged = situation.judge_all(&situation.beside());
    judged.iter().map(|judged| (linearised.sets[judged.set].id.clone(), judged.ln_p.exp())).collect()
}

/// p-values of a model's candidates in a block that it describes.
fn p_values(seed: u64) -> Vec<(String, f64)> {
    let block = with_noise(&small(), seed);
    let mut p_values = tested(&block, &everything_free());
    // Groups of the camera are candidates where they are held; all but the focal length, then the focal length.
    for held in [(1..12).collect::<Vec<usize>>(), vec![camera::F]] {
        let mut model = everything_free();
        held.iter().for_each(|k| model.free[*k] = false);
        let of_held = tested(&block, &model).into_iter().filter(|(id, _)| id.starts_with("free:"));
        p_values.extend(of_held);
    }
    p_values
}

#[test]
fn p_values_of_noise_are_uniform() {
    let seeds: Vec<u64> = (1..=BLOCKS).collect();
    let each = in_turn(&seeds, |seed| p_values(*seed));
    let mut by_id: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (id, p) in each.into_iter().flatten() {
        by_id.entry(id).or_default().push(p);
    }
    let known: BTreeSet<String> = effects::catalogue()
        .iter()
        .map(|effect| effect.descriptor().id.to_string())
        .chain(camera::GROUPS.iter().map(|(group, _)| format!("free:{group}")))
        .collect();
    let tested: BTreeSet<String> = by_id.keys().cloned().collect();
    let untestable: BTreeSet<String> = UNTESTABLE.iter().map(|id| id.to_string()).collect();
    assert!(tested.is_disjoint(&untestable), "a small block cannot tell these: {UNTESTABLE:?}");
    assert_eq!(&tested | &untestable, known, "every other candidate is tested in this block");
    let level = FAMILY_LEVEL / by_id.len() as f64;
    let mut failures = Vec::new();
    println!("Kolmogorov-Smirnov over {BLOCKS} blocks, {} candidates, each held to {level:.5}", by_id.len());
    for (id, sample) in &by_id {
        assert_eq!(sample.len(), BLOCKS as usize, "{id}");
        let (distance, two_sided) = kolmogorov_smirnov(sample, |p| p);
        let one_sided = too_small(sample);
        let mean = sample.iter().sum::<f64>() / sample.len() as f64;
        let kind = kind(id);
        let p = if kind == Kind::Exact { two_sided } else { one_sided };
        println!("{id:18} {kind:?}: D {distance:.4}, p {p:.4}, mean {mean:.3}");
        if p.is_nan() || p <= level {
            failures.push(format!("{id}: p {p:.2e}, mean p-value {mean:.3}"));
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

/// Probability of so many small values by chance (one-sided Kolmogorov-Smirnov, its asymptotic bound).
fn too_small(sample: &[f64]) -> f64 {
    let mut sorted = sample.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let excess = sorted.iter().enumerate().map(|(k, p)| (k + 1) as f64 / n - p).fold(0.0, f64::max);
    (-2.0 * n * excess * excess).exp()
}

#[test]
fn the_test_itself_sees_what_is_not_uniform() {
    let uniform: Vec<f64> = (0..BLOCKS).map(|k| (k as f64 + 0.5) / BLOCKS as f64).collect();
    // Statistics ten per cent too large, as a chi-square would be with a variance factor taken ten per cent too small.
    let inflated: Vec<f64> = uniform.iter().map(|p| p.powf(1.5)).collect();
    assert!(kolmogorov_smirnov(&uniform, |p| p).1 > 0.99 && too_small(&uniform) > 0.9);
    assert!(kolmogorov_smirnov(&inflated, |p| p).1 < 0.05 / 30.0 && too_small(&inflated) < 0.05 / 30.0);
    let deflated: Vec<f64> = uniform.iter().map(|p| p.powf(1.0 / 1.5)).collect();
    assert!(kolmogorov_smirnov(&deflated, |p| p).1 < 0.05 / 30.0 && too_small(&deflated) > 0.9);
}
