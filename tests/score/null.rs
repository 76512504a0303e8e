//! p-values where nothing is missing: uniform for every linear candidate, not too small for those whose p-value is a bound (a scanned place
//! or lag, a variance component).
//!
//! The p-value of a linear candidate is that of F with the estimated variance factor, as the program computes it: exactly uniform, for any
//! redundancy, while the base is linear over the size of the noise. Family-wise over all candidates: Bonferroni.

use super::blocks::{self, SIGNIFICANCE, everything_free, fitted, small, with_noise};
use misclosure::camera;
use misclosure::diagnose::candidate::candidates;
use misclosure::diagnose::fit::screen_all;
use misclosure::diagnose::score::{Base, Score, screen};
use misclosure::effects::{self, Role};
use misclosure::math::statistics::kolmogorov_smirnov;
use rayon::prelude::*;
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
    let bound = effect.is_some_and(|effect| effect.descriptor().parameters.iter().any(|p| bounded(&p.role)));
    if bound { Kind::Bound } else { Kind::Exact }
}

/// p-values of a model's candidates in a block that it describes.
fn p_values(seed: u64) -> Vec<(String, f64)> {
    let block = with_noise(&small(), seed);
    let threads = blocks::options().threads;
    let base = fitted(&block, &everything_free());
    let screening = screen_all(&block, &base, &[], threads, SIGNIFICANCE).expect("a screening");
    let mut scores = screening.scores;
    // Groups of the camera are candidates where they are held; all but the focal length, then the focal length.
    let f = [0];
    for held in [(1..12).collect::<Vec<usize>>(), f.to_vec()] {
        let mut model = everything_free();
        held.iter().for_each(|k| model.free[*k] = false);
        let held_base = fitted(&block, &model);
        let mut list = candidates(&block, &held_base.problem, &held_base.model, &[]);
        list.retain(|candidate| candidate.term().is_none());
        let at = Base {
            block: &block,
            model: &held_base.model,
            problem: &held_base.problem,
            state: &held_base.solution.state,
            threads,
            significance: SIGNIFICANCE,
        };
        scores.extend(screen(&at, list, &BTreeMap::new()).expect("a screening").scores);
    }
    let tested = |score: &&Score| score.dof > 0.0;
    scores.iter().filter(tested).map(|score| (score.candidate.id.clone(), score.p_value())).collect()
}

#[test]
fn p_values_of_noise_are_uniform() {
    let each: Vec<Vec<(String, f64)>> = (1..=BLOCKS).into_par_iter().map(p_values).collect();
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
    assert_eq!(tested, known, "every candidate is tested in this block");
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
