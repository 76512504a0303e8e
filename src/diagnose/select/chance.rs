//! Structure before chance: a law (drift, step, temperature, lag) explains what independent values per image of the same quantity explain, and
//! more simply; independent values enter only for what remains beside it. And the other way round: a law that is no more than chance among
//! such values is none. Two laws may hide each other (a focal length that grows and is set back between flights), and are tried together, too.

use super::{Judged, Nature, Situation};
use crate::diagnose::test::random::{self, law_beside_chance};
use crate::diagnose::test::{System, separability};

/// A law is of the same quantity as chance values where these can take all of it; what they cannot take is the rounding of a law that holds
/// within an image, too.
const SAME_QUANTITY: f64 = 0.99;

/// Of the chance values that may enter the likeliest. Each has one variance, so that likelihoods compare; the sums of squared scores, which
/// tell whether a variance is zero, do not tell whose it is.
pub fn likeliest<'a>(situation: &Situation<'_>, beside: &System, judged: &'a [Judged]) -> Option<&'a Judged> {
    let open = judged
        .iter()
        .filter(|judged| situation.sets[judged.set].nature == Nature::Chance && situation.may_enter(judged));
    let open: Vec<&Judged> = open.collect();
    if open.len() < 2 {
        return open.first().copied();
    }
    // The noise is one, whatever it is asked about: under different variances likelihoods would not compare.
    let variance = open.iter().filter_map(|judged| Some(judged.component.as_ref()?.variance)).fold(0.0, f64::max);
    let likelihood =
        |judged: &&Judged| random::largest_likelihood_ratio(beside, &situation.sets[judged.set].columns, variance);
    open.into_iter()
        .filter_map(|judged| Some((likelihood(&judged)?, judged)))
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, judged)| judged)
}

/// The law to take in instead of `values`: the surest that is significant beside chance among these very values.
pub fn law_instead(situation: &Situation<'_>, beside: &System, judged: &[Judged], values: &Judged) -> Option<usize> {
    let own = &situation.sets[values.set].columns;
    let laws = judged.iter().filter(|law| {
        let set = &situation.sets[law.set];
        set.nature == Nature::Law && situation.may_enter(law)
    });
    let laws: Vec<&Judged> = laws.filter(|law| same_quantity(beside, law, own)).collect();
    let sure = |columns: &[usize], level: f64| {
        law_beside_chance(beside, columns, own, values.design_effect).filter(|ln_p| *ln_p < level)
    };
    let surest = |sets: Vec<(f64, usize)>| sets.into_iter().min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, set)| set);
    let alone = laws.iter().filter_map(|law| Some((sure(&law.pivoted.kept, situation.ln_level)?, law.set)));
    surest(alone.collect()).or_else(|| {
        let pairs = laws.iter().enumerate().flat_map(|(k, one)| laws[..k].iter().map(move |other| (*other, *one)));
        let pairs: Vec<(&Judged, &Judged)> = pairs.collect();
        let level = situation.ln_level - (pairs.len().max(1) as f64).ln();
        // Of the two the one that is surer alone, the first of `judged`: beside it the other enters.
        let both = pairs.into_iter().filter_map(|(first, second)| {
            Some((sure(&[&first.pivoted.kept[..], &second.pivoted.kept].concat(), level)?, first.set))
        });
        surest(both.collect())
    })
}

/// The chance values to take in instead of `law`: those of its quantity, where they are significant and the law is no more than chance among
/// them.
pub fn instead_of_law(situation: &Situation<'_>, beside: &System, judged: &[Judged], law: &Judged) -> Option<usize> {
    let values = judged.iter().find(|values| {
        let set = &situation.sets[values.set];
        set.nature == Nature::Chance && situation.may_enter(values) && same_quantity(beside, law, &set.columns)
    })?;
    let ln_p = law_beside_chance(beside, &law.pivoted.kept, &situation.sets[values.set].columns, values.design_effect)?;
    if ln_p < situation.ln_level {
        return None;
    }
    // Another law of the quantity may still be one.
    Some(law_instead(situation, beside, judged, values).unwrap_or(values.set))
}

fn same_quantity(beside: &System, law: &Judged, values: &[usize]) -> bool {
    separability::seen_by(beside, &law.pivoted, &beside.pivoted(values)) > SAME_QUANTITY
}
