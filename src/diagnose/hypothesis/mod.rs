//! Hypotheses: everything that may be true of a block beyond the plain model, each with its columns, its prior and
//! its price.
//!
//! | kind | values | examples |
//! |---|---|---|
//! | law | determined by the measurements; prior: half the plausible range | rolling-shutter, focal-time, free:radial |
//! | random effect | `N(0, t^2)`, one per image, `t` estimated | focal-image, pp-image |
//! | field | `N(0, t^2)` in typical sizes, `t` estimated | image-fourier, image-grid, focal-spline |
//!
//! A field is a random effect, never a free fit of its many columns: as free columns it could take every smooth law for
//! nothing, and a law beside it would never pay.

mod price;

pub use price::PLACE_PARAMETERS;
pub(super) use price::of_option;

use super::candidate::lower_terms;
use super::linearised::Linearised;
use super::select::{Nature, Searched, Situation};
use super::settings::Settings;
use crate::effects::Stage;
use crate::score::System;
use crate::score::pivoted::{KEPT_SHARE, Pivoted};
use crate::score::separability::seen_by;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// One hypothesis; variants of an effect are several that share an id.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Id of the effect, `free:f` and so on.
    pub id: String,
    /// Of those with the same key a set has one at most: of the variants of an effect, and of the fields of a stage,
    /// which are bases of the same unknown pattern.
    pub key: String,
    /// Its set of the linearisation.
    pub set: usize,
    /// Its columns, those that the base leaves.
    pub columns: Vec<usize>,
    /// A random effect or a field.
    pub random: bool,
    /// Values that each of its columns stands for: more than one where columns are a sample of the values per image.
    pub values_per_column: f64,
    /// Names a cause; a field does not.
    pub physical: bool,
    /// A law at a place that was searched.
    pub placed: bool,
    /// A law of the lens or the sensor without a place of its own: the camera takes most of it.
    pub lens: bool,
    /// Id of the lower terms of its series: a term of a series is tested beside the terms below it, never in their
    /// place.
    pub above: Option<&'static str>,
    /// See `price.rs`.
    pub price: f64,
    /// Design effect of its score.
    pub design_effect: f64,
}

/// Lowest price of each effect so far, by id. A hypothesis costs as much to take in as its removal saves, although its
/// variants are candidates where it is out and its range a parameter where it is in; and noise looks less correlated as
/// the model gets better. Prices that only fall make a descent end.
pub type Prices = BTreeMap<String, f64>;

/// All hypotheses of a linearisation: those in the model, then its candidates. `known`: prices at linearisations
/// before.
pub fn all(linearised: &Linearised, known: &Prices, settings: &Settings<'_>) -> Vec<Hypothesis> {
    let situation = linearised.situation(settings);
    let base = Situation { taken: Vec::new(), ..situation.clone() };
    let beside_model = beside_model(&situation);
    let of_base = &base.beside();
    let sets = 0..linearised.sets.len();
    let is_law = |set: &usize| linearised.sets[*set].nature == Nature::Law;
    let pivoted = |set: usize| is_law(&set).then(|| of_base.pivoted(&linearised.sets[set].columns));
    let pivoted: Vec<Option<Pivoted>> = sets.clone().into_par_iter().map(pivoted).collect();
    let hypothesis = |set: usize| {
        let own = &linearised.sets[set];
        let (design_effect, drop) = beside_model[set];
        let random = pivoted[set].is_none();
        let (columns, price) = match &pivoted[set] {
            None => (own.columns.clone(), price::of_variance(design_effect, situation.ln_level)),
            Some(of_set) => {
                let same = same_id(&base, set);
                let law = price::Law {
                    dof: of_set.kept.len() as f64,
                    design_effect,
                    drop,
                    searched: own.search,
                    variants: same.len() as f64,
                    angle: angle(&base, of_base, &same),
                };
                let (ln_level, redundancy) = (situation.ln_level, linearised.system.redundancy);
                let smaller = contained(linearised, of_base, &pivoted, set);
                let price = smaller.map(|smaller| law.price_beyond(smaller, ln_level, redundancy));
                (of_set.kept.clone(), price.fold(law.price(ln_level, redundancy), f64::max))
            }
        };
        let (id, physical) = (own.id.clone(), own.physical);
        let price = known.get(&id).map_or(price, |known| known.min(price));
        let stage = linearised.stage(set);
        let key = if physical { id.clone() } else { format!("field:{stage:?}") };
        let lens = physical && !random && own.search == Searched::None && matches!(stage, None | Some(Stage::Image));
        let above = lower_terms(&id);
        let placed = matches!(own.search, Searched::Places { .. });
        let values_per_column = linearised.values_per_column(set);
        let hypothesis = Hypothesis {
            id,
            key,
            set,
            columns,
            random,
            values_per_column,
            physical,
            placed,
            lens,
            above,
            price,
            design_effect,
        };
        (!hypothesis.columns.is_empty()).then_some(hypothesis)
    };
    sets.into_par_iter().filter_map(hypothesis).collect()
}

/// Degrees of freedom of each law that another one contains: values of the larger one do all that it can do. Where
/// the smaller one is true, the larger one only adds to it.
fn contained<'a>(
    linearised: &'a Linearised,
    base: &'a System,
    pivoted: &'a [Option<Pivoted>],
    set: usize,
) -> impl Iterator<Item = f64> + 'a {
    let sets = &linearised.sets;
    let larger = pivoted[set].as_ref();
    let is_plain = |set: usize| sets[set].physical && sets[set].search == Searched::None;
    let within = move |other: usize| {
        let (larger, smaller) = (larger?, pivoted[other].as_ref()?);
        let dof = smaller.kept.len();
        let could_be = is_plain(set) && is_plain(other) && dof > 0 && dof < larger.kept.len();
        let seen = |column: &usize| seen_by(base, &base.pivoted(&[*column]), larger).powi(2) > 1.0 - KEPT_SHARE;
        (could_be && smaller.kept.iter().all(seen)).then_some(dof as f64)
    };
    (0..sets.len()).filter(move |other| *other != set).filter_map(within)
}

/// What each set says beside the model, without itself where it is in: its design effect and the drop of `v'Pv`.
fn beside_model(situation: &Situation<'_>) -> Vec<(f64, f64)> {
    let beside = situation.beside();
    let of_set = |set: usize| {
        let id = &situation.sets[set].id;
        let judged = match situation.has(id) {
            true => {
                let without = situation.without(id);
                without.judge(set, &without.beside())
            }
            false => situation.judge(set, &beside),
        };
        judged.map_or((1.0, 0.0), |judged| (judged.design_effect, judged.drop))
    };
    (0..situation.sets.len()).into_par_iter().map(of_set).collect()
}

/// The variants of a set.
fn same_id(situation: &Situation<'_>, set: usize) -> Vec<usize> {
    (0..situation.sets.len()).filter(|other| situation.sets[*other].id == situation.sets[set].id).collect()
}

/// Angle through which the direction of a statistic turns over the values of a range.
fn angle(situation: &Situation<'_>, base: &System, variants: &[usize]) -> f64 {
    let place = |set: &usize| match situation.sets[*set].search {
        Searched::Range(place) => Some((place, *set)),
        _ => None,
    };
    let mut places: Vec<(f64, usize)> = variants.iter().filter_map(place).collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pivoted: Vec<_> = places.iter().map(|(_, set)| base.pivoted(&situation.sets[*set].columns)).collect();
    pivoted.windows(2).map(|pair| seen_by(base, &pair[0], &pair[1]).clamp(0.0, 1.0).acos()).sum()
}
