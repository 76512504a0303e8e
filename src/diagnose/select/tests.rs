//! Rules on small systems: regressions of a few hundred measurements in images, no block.

use super::challenge::{self, Shape};
use super::{Event, Excerpt, Known, Nature, Searched, Set, Situation, Taken, instead, need, next};
use crate::diagnose::test::System;
use crate::diagnose::test::design_effect::Clusters;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeSet;

const IMAGES: usize = 24;
/// Measurements of an image.
const EACH: usize = 40;

/// Measurements as sums of columns and noise of unit weight.
struct Regression {
    columns: Vec<Vec<f64>>,
    sets: Vec<Set>,
    v: Vec<f64>,
    taken: Vec<Taken>,
    refused: BTreeSet<String>,
    unresolved: BTreeSet<String>,
    plausible: Option<[f64; 2]>,
}

fn normal(count: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
}

/// A column that every measurement feels, unlike those of other seeds.
fn wave(seed: u64) -> Vec<f64> {
    normal(IMAGES * EACH, 1000 + seed)
}

/// The column that image `i` has to itself.
fn of_image(i: usize) -> Vec<f64> {
    (0..IMAGES * EACH).map(|k| if k / EACH == i { 1.0 } else { 0.0 }).collect()
}

/// A law of the place of the image in the block.
fn drift() -> Vec<f64> {
    (0..IMAGES * EACH).map(|k| (k / EACH) as f64 / IMAGES as f64 - 0.5).collect()
}

impl Regression {
    fn new(seed: u64) -> Self {
        let v = normal(IMAGES * EACH, seed);
        let [refused, unresolved] = [BTreeSet::new(), BTreeSet::new()];
        Self { columns: vec![], sets: vec![], v, taken: vec![], refused, unresolved, plausible: None }
    }

    fn set(mut self, id: &str, nature: Nature, columns: Vec<Vec<f64>>) -> Self {
        let first = self.columns.len();
        let columns_of = (first..first + columns.len()).collect();
        let (id, physical, search) = (id.to_string(), true, Searched::None);
        self.sets.push(Set { id, columns: columns_of, nature, physical, search });
        self.columns.extend(columns);
        self
    }

    /// What the measurements have of a column.
    fn truth(mut self, column: &[f64], size: f64) -> Self {
        self.v.iter_mut().zip(column).for_each(|(v, c)| *v += size * c);
        self
    }

    fn with_in(mut self, set: usize) -> Self {
        self.taken.push(Taken { set, variance: 0.0, removable: true });
        self
    }

    /// Calls `ask` with the situation.
    fn ask<T>(&self, ask: impl FnOnce(&Situation<'_>) -> T) -> T {
        let (n, q) = (self.v.len(), self.columns.len());
        let c = DMatrix::from_fn(n, q, |k, j| self.columns[j][k]);
        let v = DVector::from_column_slice(&self.v);
        let system = System {
            score: c.tr_mul(&v),
            information: c.tr_mul(&c).into(),
            length: (0..q).map(|j| c.column(j).norm_squared()).collect(),
            least: vec![0.0; q],
            chi_square: v.norm_squared(),
            redundancy: n as f64,
        };
        let part = |i: usize| {
            let (c, v) = (c.rows(i * EACH, EACH), v.rows(i * EACH, EACH));
            (c.tr_mul(&v), c.tr_mul(&c))
        };
        let clusters = Clusters { parts: (0..IMAGES).map(part).collect() };
        let clustered: Vec<Option<usize>> = (0..q).map(Some).collect();
        ask(&Situation {
            system: &system,
            known: &Known::default(),
            sets: &self.sets,
            values: &vec![0.0; q],
            plausible: &vec![self.plausible; q],
            clusters: &clusters,
            clustered: &clustered,
            design_effects: &vec![1.0; self.sets.len()],
            taken: self.taken.clone(),
            ln_level: 1e-4f64.ln(),
            refused: self.refused.clone(),
            unresolved: self.unresolved.clone(),
        })
    }

    fn next(&self) -> Option<Event> {
        self.ask(next)
    }
}

/// What a structure takes out: the same by all columns, and by those that the question is about.
fn taken_out_by(name: &str, columns: &[usize], regression: &Regression) -> Option<Event> {
    let shapes = vec![Shape { name: name.into(), columns: columns.to_vec() }];
    regression.ask(|whole| {
        let by_all = challenge::rule(whole, &shapes);
        let excerpt = Excerpt::new(whole, shapes);
        assert_eq!(challenge::rule(&excerpt.situation(whole), &excerpt.shapes), by_all);
        by_all
    })
}

fn images() -> Vec<Vec<f64>> {
    (0..IMAGES).map(of_image).collect()
}

#[test]
fn noise_lets_nothing_in() {
    for seed in 0..20 {
        let quiet = Regression::new(seed)
            .set("a", Nature::Law, vec![wave(1)])
            .set("b", Nature::Law, vec![wave(2), wave(3)])
            .set("image", Nature::Chance, images());
        assert_eq!(quiet.next(), None, "seed {seed}");
    }
}

#[test]
fn the_surest_enters() {
    let both = Regression::new(1)
        .set("weak", Nature::Law, vec![wave(1)])
        .set("strong", Nature::Law, vec![wave(2)])
        .truth(&wave(1), 0.2)
        .truth(&wave(2), 0.4);
    assert_eq!(both.next(), Some(Event::Added { set: 1 }));
    assert_eq!(both.with_in(1).next(), Some(Event::Added { set: 0 }), "beside the strong one the weak one enters");
}

#[test]
fn what_was_refused_does_not_enter_and_what_is_impossible_is_looked_into() {
    let strong = || Regression::new(1).set("strong", Nature::Law, vec![wave(2)]).truth(&wave(2), 0.5);
    assert_eq!(strong().next(), Some(Event::Added { set: 0 }));
    let mut refused = strong();
    refused.refused.insert("strong".into());
    assert_eq!(refused.next(), None);
    let mut impossible = strong();
    impossible.plausible = Some([0.0, 0.1]);
    assert_eq!(impossible.next(), Some(Event::Resembled { set: 0 }), "0.5 +- 0.03 where physics allows 0.1");
    impossible.unresolved.insert("strong".into());
    assert_eq!(impossible.next(), None, "looked into in vain");
    impossible.plausible = Some([0.0, 0.45]);
    assert_eq!(impossible.next(), Some(Event::Added { set: 0 }), "beyond by less than three sigma");
}

#[test]
fn what_takes_all_of_a_weak_effect_could_stand_in_its_place() {
    let alike = |share: f64| {
        let mut alike = wave(1);
        alike.iter_mut().zip(wave(2)).for_each(|(a, b)| *a = share * *a + (1.0 - share * share).sqrt() * b);
        alike
    };
    // Noncentralities of 38 and 960, of which a correlation of 0.85 leaves 11 and 270: the level is at 15.
    let instead = |size: f64, share: f64| {
        let regression = Regression::new(11)
            .set("true", Nature::Law, vec![wave(1)])
            .set("alike", Nature::Law, vec![alike(share)])
            .set("other", Nature::Law, vec![wave(3)])
            .truth(&wave(1), size);
        regression.ask(|situation| instead::of(situation, 0))
    };
    assert_eq!(instead(0.2, 0.85), [1]);
    assert!(instead(1.0, 0.85).is_empty());
    assert_eq!(instead(0.2, 0.3), Vec::<usize>::new(), "not significant in its place");
}

#[test]
fn what_is_not_needed_leaves() {
    let mut mixed = wave(1);
    mixed.iter_mut().zip(wave(2)).for_each(|(a, b)| *a = 0.9 * *a + 0.4 * b);
    let both = Regression::new(3)
        .set("true", Nature::Law, vec![wave(1)])
        .set("alike", Nature::Law, vec![mixed])
        .truth(&wave(1), 0.5)
        .with_in(0)
        .with_in(1);
    assert!(matches!(both.next(), Some(Event::Removed { id, .. }) if id == "alike"));
}

#[test]
fn a_law_enters_before_chance_of_the_same_quantity() {
    let drifting = Regression::new(4)
        .set("image", Nature::Chance, images())
        .set("drift", Nature::Law, vec![drift()])
        .truth(&drift(), 3.0);
    assert_eq!(drifting.next(), Some(Event::Added { set: 1 }));
    assert_eq!(drifting.with_in(1).next(), None, "nothing is left for chance");
}

#[test]
fn two_laws_that_hide_each_other_enter_before_chance() {
    let step: Vec<f64> = drift().iter().map(|t| if *t < 0.0 { 0.5 } else { -0.5 }).collect();
    // A saw: of what both do, neither alone explains the half.
    let saw = Regression::new(4)
        .set("image", Nature::Chance, images())
        .set("drift", Nature::Law, vec![drift()])
        .set("step", Nature::Law, vec![step.clone()])
        .truth(&drift(), 6.0)
        .truth(&step, 4.5);
    let Some(Event::Added { set: first @ (1 | 2) }) = saw.next() else { panic!("{:?}", saw.next()) };
    let second = 3 - first;
    let both = saw.with_in(first);
    assert_eq!(both.next(), Some(Event::Added { set: second }));
    assert_eq!(both.with_in(second).next(), None, "nothing is left for chance");
}

#[test]
fn chance_that_happens_to_drift_is_no_law() {
    let sizes = normal(IMAGES, 77);
    let hunting = (0..IMAGES).fold(
        Regression::new(5).set("drift", Nature::Law, vec![drift()]).set("image", Nature::Chance, images()),
        |regression, i| regression.truth(&of_image(i), 2.0 * sizes[i]),
    );
    assert_eq!(hunting.next(), Some(Event::Added { set: 1 }));
}

#[test]
fn a_structure_takes_out_what_it_could_itself_be() {
    let pattern = wave(9);
    let mut alike = pattern.clone();
    alike.iter_mut().zip(wave(2)).for_each(|(a, b)| *a = 0.75 * *a + 0.66 * b);
    let false_name = Regression::new(6)
        .set("other", Nature::Law, vec![wave(3), wave(4)])
        .set("false", Nature::Law, vec![alike])
        .set("image", Nature::Chance, images())
        .set("pattern", Nature::Law, vec![pattern.clone()])
        .truth(&pattern, 0.6)
        .with_in(1);
    let removed = taken_out_by("pattern", &[3 + IMAGES], &false_name);
    assert!(matches!(removed, Some(Event::Removed { id, .. }) if id == "false"));
}

#[test]
fn a_piece_of_a_structure_is_not_an_effect() {
    // A wave over all measurements, and a bump at one of its crests: they overlap by a fortieth.
    let count = IMAGES * EACH;
    let wave: Vec<f64> = (0..count).map(|k| (0.1 * k as f64).sin()).collect();
    let bump: Vec<f64> = (0..count).map(|k| (-((k as f64 - 455.5) / 15.0).powi(2)).exp()).collect();
    let bumped = Regression::new(8)
        .set("bump", Nature::Law, vec![bump])
        .set("wave", Nature::Law, vec![wave.clone()])
        .truth(&wave, 5.0)
        .with_in(0);
    assert_eq!(bumped.ask(need::rule), None, "significant while the wave is not known");
    let removed = taken_out_by("wave", &[1], &bumped);
    assert!(matches!(&removed, Some(Event::Removed { id, .. }) if id == "bump"), "{removed:?}");
}

#[test]
fn of_places_the_refined_one_says_which_variant_it_is() {
    let mut other = wave(1);
    other.iter_mut().zip(wave(2)).for_each(|(a, b)| *a = 0.8 * *a + 0.6 * b);
    let mut placed = Regression::new(9)
        .set("flaw", Nature::Law, vec![wave(1)])
        .set("flaw", Nature::Law, vec![other])
        .truth(&wave(1), 0.5);
    placed.sets[0].search = Searched::Places { count: 100.0, drop: 90.0, elsewhere: 1.0 };
    placed.sets[1].search = Searched::Places { count: 100.0, drop: 110.0, elsewhere: 1.0 };
    let (judged, rivals) = placed.ask(|situation| {
        let beside = situation.beside();
        (situation.judge_all(&beside), situation.rivals(0, &beside))
    });
    assert_eq!((judged.len(), judged[0].set), (1, 0), "on the grid the other was better");
    let of_other = placed.ask(|situation| situation.judge(1, &situation.beside()).map(|judged| judged.ln_p));
    assert_eq!(Some(judged[0].ln_p), of_other, "that there is one says the grid");
    assert!(rivals.is_empty());
}

#[test]
fn the_best_of_many_places_is_no_spot_where_all_of_them_take_something() {
    let mut placed = Regression::new(10).set("flaw", Nature::Law, vec![wave(1)]).truth(&wave(1), 0.5);
    let mut where_others_take = |elsewhere| {
        placed.sets[0].search = Searched::Places { count: 100.0, drop: 90.0, elsewhere };
        placed.ask(|situation| situation.judge(0, &situation.beside()).expect("a set").ln_p)
    };
    let [nothing, as_much_as_noise, a_tenth] = [0.0, 1.0, 9.0].map(&mut where_others_take);
    assert!(nothing < -30.0 && (as_much_as_noise - nothing).abs() < 3.0, "{nothing} {as_much_as_noise}");
    assert!(a_tenth > -5.0, "a hundred places of which one takes ten times as much as another: {a_tenth}");
}

#[test]
fn a_share_of_a_drop_is_judged_as_the_whole() {
    let mut placed = Regression::new(10).set("flaw", Nature::Law, vec![wave(1)]).truth(&wave(1), 0.5);
    for search in [Searched::None, Searched::Places { count: 100.0, drop: 90.0, elsewhere: 1.0 }] {
        placed.sets[0].search = search;
        let (whole, same, none) = placed.ask(|situation| {
            let beside = situation.beside();
            let judged = situation.judge(0, &beside).expect("a set");
            let share = |share| situation.ln_p_of_share(&judged, &beside, share);
            (judged.ln_p, share(1.0), share(0.0))
        });
        assert!((same - whole).abs() < 1e-12 * whole.abs() && whole < -20.0, "{search:?}: {same} {whole}");
        assert!((-1e-9..=0.0).contains(&none), "{search:?}: {none}");
    }
}

#[test]
fn a_structure_elsewhere_takes_nothing_out() {
    let drift_of_positions = Regression::new(7)
        .set("true", Nature::Law, vec![wave(1)])
        .set("pattern", Nature::Law, vec![wave(9)])
        .truth(&wave(1), 0.3)
        .truth(&wave(9), 1.5)
        .with_in(0);
    assert_eq!(taken_out_by("pattern", &[1], &drift_of_positions), None);
}

#[test]
fn what_was_asked_for_last_is_not_taken_for_something_else() {
    let both = Regression::new(12)
        .set("a", Nature::Law, vec![wave(1)])
        .set("b", Nature::Law, vec![wave(2)])
        .truth(&wave(1), 0.5)
        .with_in(0)
        .with_in(1);
    both.ask(|situation| {
        let [all, again] = [0, 1].map(|_| situation.beside().score.clone());
        let without = situation.without("a").beside().score.clone();
        assert_eq!((all[0], &all), (0.0, &again));
        assert!(without[0] > 100.0 && without[1] == 0.0, "{without}");
        assert_eq!(situation.beside().score, all);
    });
}
