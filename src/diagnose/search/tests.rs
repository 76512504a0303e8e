//! The search on small systems: regressions of a few hundred measurements in images, no block.

use super::*;
use crate::diagnose::hypothesis::Hypothesis;
use crate::math::statistics::chi_square_quantile;
use crate::run::squares::Surveyed;
use crate::score::System;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const IMAGES: usize = 24;
/// Measurements of an image.
const EACH: usize = 40;
/// Level of one hypothesis.
const LEVEL: f64 = 1e-4;

/// Measurements as sums of columns and noise of unit weight.
struct Regression {
    columns: Vec<Vec<f64>>,
    hypotheses: Vec<Hypothesis>,
    prior: Vec<f64>,
    v: Vec<f64>,
}

fn normal(count: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
}

/// A column that every measurement feels, unlike those of other seeds.
fn wave(seed: u64) -> Vec<f64> {
    normal(IMAGES * EACH, 1000 + seed)
}

/// `a` and `b`, mixed so that their correlation with `a` is `share`.
fn mixed(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    let other = (1.0 - share * share).sqrt();
    a.iter().zip(b).map(|(a, b)| share * a + other * b).collect()
}

/// The columns that each image has to itself.
fn images() -> Vec<Vec<f64>> {
    let of_image = |i: usize| (0..IMAGES * EACH).map(|k| if k / EACH == i { 1.0 } else { 0.0 }).collect();
    (0..IMAGES).map(of_image).collect()
}

/// A law of the place of the image in the block.
fn drift() -> Vec<f64> {
    (0..IMAGES * EACH).map(|k| (k / EACH) as f64 / IMAGES as f64 - 0.5).collect()
}

impl Regression {
    fn new(seed: u64) -> Self {
        Self { columns: vec![], hypotheses: vec![], prior: vec![], v: normal(IMAGES * EACH, seed) }
    }

    fn hypothesis(mut self, id: &str, random: bool, columns: Vec<Vec<f64>>) -> Self {
        let first = self.columns.len();
        let dof = if random { 1.0 } else { columns.len() as f64 };
        let level = if random { 2.0 * LEVEL } else { LEVEL };
        self.hypotheses.push(Hypothesis {
            id: id.into(),
            key: id.into(),
            set: self.hypotheses.len(),
            columns: (first..first + columns.len()).collect(),
            random,
            values_per_column: 1.0,
            physical: true,
            placed: false,
            lens: false,
            above: None,
            price: chi_square_quantile(1.0 - level, dof),
            design_effect: 1.0,
        });
        self.prior.extend(columns.iter().map(|_| 0.0));
        self.columns.extend(columns);
        self
    }

    fn law(self, id: &str, columns: Vec<Vec<f64>>) -> Self {
        self.hypothesis(id, false, columns)
    }

    fn random(self, id: &str, columns: Vec<Vec<f64>>) -> Self {
        self.hypothesis(id, true, columns)
    }

    /// What the measurements have of a column.
    fn truth(mut self, column: &[f64], size: f64) -> Self {
        self.v.iter_mut().zip(column).for_each(|(v, c)| *v += size * c);
        self
    }

    fn system(&self) -> System {
        let (n, q) = (self.v.len(), self.columns.len());
        let c = DMatrix::from_fn(n, q, |k, j| self.columns[j][k]);
        let v = DVector::from_column_slice(&self.v);
        System {
            score: c.tr_mul(&v),
            information: c.tr_mul(&c).into(),
            length: (0..q).map(|j| c.column(j).norm_squared()).collect(),
            least: vec![0.0; q],
            chi_square: v.norm_squared(),
            redundancy: n as f64,
        }
    }

    /// The objective with some members; nothing is surveyed.
    fn objective(&self, current: &Members) -> Objective<'_> {
        Objective::new(&self.system(), Surveyed::default(), &self.prior, &self.hypotheses, current, LEVEL.ln())
    }

    /// Ids of the set at which the descent ends.
    fn best(&self) -> Vec<String> {
        self.best_from(&Members::default())
    }

    /// The same from some members: in each step the variance factor is that of the set before.
    fn best_from(&self, start: &Members) -> Vec<String> {
        let mut current = start.clone();
        loop {
            let objective = self.objective(&current);
            let now = objective.value(&current);
            let best = search(&objective, &current).into_iter().next().filter(|best| best.value < now - SAME);
            let Some(best) = best else { break };
            current = best.members;
        }
        current.all().map(|h| self.hypotheses[h].id.clone()).collect()
    }
}

#[test]
fn noise_lets_nothing_in() {
    let found = (0..20).filter(|seed| {
        let quiet = Regression::new(*seed).law("a", vec![wave(1)]).law("b", vec![wave(2), wave(3)]);
        !quiet.random("image", images()).best().is_empty()
    });
    assert_eq!(found.count(), 0, "three hypotheses at 1e-4 in 20 blocks");
}

#[test]
fn one_hypothesis_alone_enters_where_its_test_is_significant() {
    let column = wave(1);
    for seed in 0..20 {
        let one = Regression::new(seed).law("a", vec![column.clone()]).truth(&column, 0.12);
        let system = one.system();
        let drop = system.pivoted(&[0]).drop();
        let f = drop / ((system.chi_square - drop) / (system.redundancy - 1.0));
        // The price is the quantile of chi-square here: between it and that of F neither is asked for.
        let quantile = chi_square_quantile(1.0 - LEVEL, 1.0);
        if (f / quantile - 1.0).abs() > 0.02 {
            assert_eq!(!one.best().is_empty(), f > quantile, "seed {seed}: F = {f}, quantile {quantile}");
        }
    }
}

#[test]
fn causes_enter_together_and_one_that_only_looks_alike_does_not() {
    let alike = mixed(&wave(1), &wave(9), 0.9);
    let both = Regression::new(1)
        .law("alike", vec![alike])
        .law("weak", vec![wave(1)])
        .law("strong", vec![wave(2)])
        .truth(&wave(1), 0.2)
        .truth(&wave(2), 0.4);
    assert_eq!(both.best(), ["weak", "strong"]);
    let from_alike = Members { laws: vec![0], random: vec![] };
    assert_eq!(both.best_from(&from_alike), ["weak", "strong"], "the wrong one is exchanged");
}

#[test]
fn a_law_explains_more_simply_what_values_per_image_explain_too() {
    let drifting = Regression::new(4).random("image", images()).law("drift", vec![drift()]).truth(&drift(), 3.0);
    assert_eq!(drifting.best(), ["drift"]);
}

#[test]
fn two_laws_that_hide_each_other_enter_as_a_pair() {
    // The difference of two columns that are nearly alike: neither alone explains anything.
    let (a, b) = (wave(1), mixed(&wave(1), &wave(2), 0.98));
    let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    let hidden = Regression::new(5).law("a", vec![a]).law("b", vec![b]).truth(&difference, 2.0);
    assert_eq!(hidden.best(), ["a", "b"]);
}

#[test]
fn a_sample_of_the_values_has_the_determinant_of_all() {
    let of = |columns: Vec<Vec<f64>>| {
        let mut regression = Regression::new(6).random("image", columns);
        regression.hypotheses[0].values_per_column = IMAGES as f64 / regression.columns.len() as f64;
        let members = Members { laws: vec![], random: vec![(0, 0.7)] };
        regression.objective(&members).log_determinant(&members)
    };
    let half = images().into_iter().step_by(2).collect();
    let [all, half] = [images(), half].map(of);
    assert!(all > 1.0 && (half / all - 1.0).abs() < 1e-12, "{half} for {all}");
}

#[test]
fn values_that_happen_to_drift_are_no_law() {
    let sizes = normal(IMAGES, 77);
    let hunting = images()
        .iter()
        .enumerate()
        .fold(Regression::new(5).law("drift", vec![drift()]).random("image", images()), |regression, (i, own)| {
            regression.truth(own, 2.0 * sizes[i])
        });
    assert_eq!(hunting.best(), ["image"]);
}

#[test]
fn a_law_far_beyond_the_chance_of_its_own_values_is_found_beside_them() {
    let sizes = normal(IMAGES, 78);
    let both = images().iter().enumerate().fold(
        Regression::new(6).law("drift", vec![drift()]).random("image", images()).truth(&drift(), 20.0),
        |regression, (i, own)| regression.truth(own, sizes[i]),
    );
    assert_eq!(both.best(), ["drift", "image"]);
}

#[test]
fn a_strong_pattern_of_a_field_hides_no_law_and_takes_none_of_it() {
    // A field of 30 waves of which one is the pattern; the law is a tenth of it and lies outside.
    let field: Vec<Vec<f64>> = (0..30).map(|k| wave(100 + k)).collect();
    let law = mixed(&wave(2), &wave(103), 0.95);
    let block = Regression::new(7)
        .law("law", vec![law.clone()])
        .random("field", field.clone())
        .truth(&field[7], 3.0)
        .truth(&field[12], 2.0)
        .truth(&law, 0.3);
    assert_eq!(block.best(), ["law", "field"]);
}

#[test]
fn an_implausible_size_is_dear() {
    let column = wave(2);
    let mut strong = Regression::new(8).law("strong", vec![column.clone()]).truth(&column, 0.5);
    assert_eq!(strong.best(), ["strong"]);
    // A size of 0.5 where 0.01 is its prior's standard deviation: the prior gives way to 0.06 and leaves the rest.
    strong.prior[0] = 0.02f64.powi(-2);
    let none = Members::default();
    let members = Members { laws: vec![0], random: vec![] };
    let with_prior = strong.objective(&none).value(&members);
    strong.prior[0] = 0.0;
    let free = strong.objective(&none).value(&members);
    assert!(with_prior > free + 100.0, "2500 v'Pv of a size 25 times its prior");
}

#[test]
fn lower_terms_of_a_series_stay_while_a_higher_one_is_in() {
    let mut regression = Regression::new(5).law("free:radial", vec![normal(IMAGES * EACH, 6)]);
    regression = regression.law("radial-high", vec![normal(IMAGES * EACH, 7)]);
    regression.hypotheses[1].above = Some("free:radial");
    let both = Members { laws: vec![0, 1], random: vec![] };
    let objective = regression.objective(&both);
    let reached: Vec<Members> = search(&objective, &both).into_iter().map(|ranked| ranked.members).collect();
    assert!(reached.iter().any(|members| members.laws.is_empty()), "without either");
    assert!(!reached.iter().any(|members| members.laws == [1]), "the higher one alone");
}

/// A cause that moves antennas leaves large residuals there, and these are no noise of the images.
#[test]
fn what_the_survey_is_missed_by_is_no_noise() {
    let column = wave(2);
    let block = Regression::new(8).law("law", vec![column.clone()]).truth(&column, 0.2);
    let (system, none, members) = (block.system(), Members::default(), Members { laws: vec![0], random: vec![] });
    let gain = |survey: Surveyed| {
        let objective = Objective::new(&system, survey, &block.prior, &block.hypotheses, &none, LEVEL.ln());
        objective.value(&none) - objective.value(&members)
    };
    let of_images = gain(Surveyed::default());
    let n = system.redundancy;
    assert_eq!(gain(Surveyed { chi_square: 20.0, count: 30.0 }), of_images, "as precise as stated");
    let misses = Surveyed { chi_square: 0.5 * system.chi_square, count: 0.1 * n };
    assert!(gain(misses) > 1.5 * of_images, "{} beside {of_images}", gain(misses));
}
