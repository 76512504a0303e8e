//! The search for the hypotheses of the lowest objective, on `(s, M)`: a beam over sets with the moves add, drop,
//! exchange, and add two.

use crate::diagnose::models::SMALLEST_DEVIATION;
use crate::diagnose::objective::{Conditional, Members, Objective};
use crate::score::random;
use rayon::prelude::*;
use std::sync::Arc;

/// Sets that are kept from round to round.
const BEAM: usize = 5;
/// Rounds at the most: each adds one or two hypotheses.
const MOST_ROUNDS: usize = 12;
/// Sets of more columns are no part of the pairs that are tried: each pair is factorised anew.
const PAIR_COLUMNS: usize = 12;
/// Difference of the objective below which two sets are as good as each other: what a fit that decides leaves.
pub const SAME: f64 = 1e-2;

/// A set of hypotheses and its objective.
#[derive(Debug, Clone)]
pub struct Ranked {
    /// The set.
    pub members: Members,
    /// `J`, to first order.
    pub value: f64,
}

/// Sets other than `current`, best first.
pub fn search(objective: &Objective<'_>, current: &Members) -> Vec<Ranked> {
    let start = Ranked { value: objective.value(current), members: current.clone() };
    let mut found = vec![start.clone()];
    let mut beam = vec![start];
    let mut expanded: Vec<Members> = Vec::new();
    for round in 0..MOST_ROUNDS {
        let open: Vec<&Ranked> =
            beam.iter().filter(|own| !expanded.iter().any(|done| done.same(&own.members))).collect();
        if open.is_empty() {
            break;
        }
        let next = open.iter().flat_map(|own| neighbours(objective, &own.members, round == 0)).collect();
        expanded.extend(open.iter().map(|own| own.members.clone()));
        let best = found[0].value;
        found.extend(polished(objective, best_of(next, BEAM)));
        found = best_of(found, 8 * BEAM);
        beam = found.iter().take(BEAM).cloned().collect();
        if round > 0 && found[0].value > best - SAME {
            break;
        }
    }
    found.retain(|own| !own.members.same(current));
    found
}

/// The best of some sets, each once.
fn best_of(mut sets: Vec<Ranked>, count: usize) -> Vec<Ranked> {
    sets.sort_by(|a, b| a.value.total_cmp(&b.value));
    let mut best: Vec<Ranked> = Vec::new();
    for own in sets {
        if best.len() < count && !best.iter().any(|other| other.members.same(&own.members)) {
            best.push(own);
        }
    }
    best
}

/// Sets with the variances of largest likelihood.
fn polished(objective: &Objective<'_>, sets: Vec<Ranked>) -> Vec<Ranked> {
    let polish = |own: Ranked| {
        if own.members.random.is_empty() {
            return own;
        }
        let members = likeliest(objective, &own.members);
        let value = objective.value(&members);
        if value < own.value { Ranked { members, value } } else { own }
    };
    sets.into_iter().map(polish).collect()
}

/// The same members, each random effect with its likeliest variance beside the others.
fn likeliest(objective: &Objective<'_>, members: &Members) -> Members {
    let mut next = members.clone();
    for (h, _) in &members.random {
        if let Some(variance) = likeliest_variance(objective, *h, &next) {
            next = next.with_random(*h, variance);
        }
    }
    next
}

/// Variance of largest likelihood of a random effect beside some members, in units of the variance of unit weight;
/// `None` where none is likelier.
fn likeliest_variance(objective: &Objective<'_>, hypothesis: usize, members: &Members) -> Option<f64> {
    let system = objective.of_random(hypothesis, members);
    let all: Vec<usize> = (0..system.len()).collect();
    random::values(&system, &all)?.likeliest_ratio(objective.variance)
}

impl Objective<'_> {
    /// Some members with a random effect of its likeliest variance; of the smallest one where none is likelier than
    /// zero.
    pub fn with_likeliest(&self, members: &Members, hypothesis: usize) -> Members {
        let variance = likeliest_variance(self, hypothesis, members).unwrap_or(SMALLEST_DEVIATION.powi(2));
        members.with_random(hypothesis, variance)
    }
}

/// Every set that one move reaches.
fn neighbours(objective: &Objective<'_>, members: &Members, pairs: bool) -> Vec<Ranked> {
    let conditional = objective.conditional(&members.random);
    let mut sets = with_one_law(objective, &conditional, members);
    let less: Vec<Members> = members.all().map(|h| members.without(h)).collect();
    for less in less {
        let conditional = objective.conditional(&less.random);
        sets.extend(with_one_law(objective, &conditional, &less));
        sets.push(Ranked { value: objective.value_within(&conditional, &less.laws), members: less });
    }
    if pairs {
        sets.extend(with_two_laws(objective, &conditional, members));
    }
    sets.extend(with_one_random(objective, members));
    sets.retain(|set| objective.allows(&set.members));
    sets
}

/// Is a hypothesis no variant of a member?
fn is_open(objective: &Objective<'_>, members: &Members, hypothesis: usize) -> bool {
    let key = &objective.hypotheses[hypothesis].key;
    !members.all().any(|own| objective.hypotheses[own].key == *key)
}

/// Laws that could join some members.
fn open_laws(objective: &Objective<'_>, members: &Members) -> Vec<usize> {
    let laws = (0..objective.hypotheses.len()).filter(|h| !objective.hypotheses[*h].random);
    laws.filter(|h| is_open(objective, members, *h)).collect()
}

fn with_one_law(objective: &Objective<'_>, conditional: &Arc<Conditional>, members: &Members) -> Vec<Ranked> {
    let beside = beside(objective, conditional, members);
    let price = objective.price(&Members { laws: members.laws.clone(), random: Vec::new() }) + conditional.cost;
    let with = |law: usize| {
        let chi_square = beside.chi_square - beside.pivoted(&objective.of_laws[law]).drop();
        let value = objective.misfit(chi_square) + price + objective.hypotheses[law].price;
        Ranked { members: members.with_law(law), value }
    };
    open_laws(objective, members).into_par_iter().map(with).collect()
}

/// The laws beside those of some members.
fn beside(objective: &Objective<'_>, conditional: &Conditional, members: &Members) -> crate::score::System {
    let columns: Vec<&[usize]> = members.laws.iter().map(|law| objective.of_laws[*law].as_slice()).collect();
    conditional.system.beside(&columns, &[])
}

fn with_two_laws(objective: &Objective<'_>, conditional: &Arc<Conditional>, members: &Members) -> Vec<Ranked> {
    let beside = beside(objective, conditional, members);
    let price = objective.price(&Members { laws: members.laws.clone(), random: Vec::new() }) + conditional.cost;
    let few = |law: &usize| objective.of_laws[*law].len() <= PAIR_COLUMNS;
    let open: Vec<usize> = open_laws(objective, members).into_iter().filter(few).collect();
    let of_first = |(k, first): (usize, &usize)| {
        let with = |second: &usize| {
            let columns = [objective.of_laws[*first].as_slice(), &objective.of_laws[*second]];
            let chi_square = beside.chi_square - beside.pivoted_in_turn(&columns).drop();
            let both = objective.hypotheses[*first].price + objective.hypotheses[*second].price;
            let value = objective.misfit(chi_square) + price + both;
            Ranked { members: members.with_law(*first).with_law(*second), value }
        };
        let differs = |second: &&usize| objective.hypotheses[**second].id != objective.hypotheses[*first].id;
        best_of(open[..k].iter().filter(differs).map(with).collect(), BEAM)
    };
    open.par_iter().enumerate().flat_map_iter(of_first).collect()
}

/// With a random effect whose variance is significant.
fn with_one_random(objective: &Objective<'_>, members: &Members) -> Vec<Ranked> {
    let open = |h: &usize| objective.hypotheses[*h].random && is_open(objective, members, *h);
    let with = |h: usize| {
        let system = objective.of_random(h, members);
        let all: Vec<usize> = (0..system.len()).collect();
        let own = &objective.hypotheses[h];
        // An eigenbasis is O(n^3): none is made where the score says that the variance is zero.
        if !random::may_vary(&system, &all, own.design_effect, objective.ln_level) {
            return None;
        }
        let variance = random::values(&system, &all)?.likeliest_ratio(objective.variance)?;
        let members = members.with_random(h, variance);
        Some(Ranked { value: objective.value(&members), members })
    };
    (0..objective.hypotheses.len()).filter(open).filter_map(with).collect()
}

#[cfg(test)]
mod tests;
