//! A linearisation with its hypotheses: what competes, what is in the model, and what the objective asks for next.

use super::hypothesis::{self, Hypothesis, Prices};
use super::linearised::Linearised;
use super::objective::{Members, Objective};
use super::search::{SAME, search};
use super::settings::Settings;
use crate::math::statistics::chi_square_quantile;
use std::collections::BTreeMap;

/// A linearisation with its hypotheses.
pub struct Competition {
    pub(super) hypotheses: Vec<Hypothesis>,
    prior: Vec<f64>,
    /// Those in the model.
    pub(super) current: Members,
    ln_level: f64,
}

impl Competition {
    /// The hypotheses of a linearisation.
    pub fn new(linearised: &Linearised, known: &Prices, settings: &Settings<'_>) -> Self {
        let hypotheses = hypothesis::all(linearised, known, settings);
        let mut current = Members::default();
        for taken in &linearised.taken {
            let Some(h) = hypotheses.iter().position(|hypothesis| hypothesis.set == taken.set) else { continue };
            current = match hypotheses[h].random {
                true => current.with_random(h, taken.variance),
                false => current.with_law(h),
            };
        }
        let ln_level = linearised.ln_level(settings.significance);
        Self { hypotheses, prior: linearised.prior_of_columns(), current, ln_level }
    }

    /// Adds the prices here to those that are known.
    pub(super) fn note_prices(&self, known: &mut Prices) {
        for hypothesis in &self.hypotheses {
            let lowest = known.entry(hypothesis.id.clone()).or_insert(hypothesis.price);
            *lowest = lowest.min(hypothesis.price);
        }
    }

    /// Their objective.
    pub fn objective<'a>(&'a self, linearised: &Linearised) -> Objective<'a> {
        self.objective_under(linearised, &self.prior)
    }

    /// Their objective with other priors of the columns.
    pub fn objective_under<'a>(&'a self, linearised: &Linearised, prior: &[f64]) -> Objective<'a> {
        let (system, survey) = (&linearised.system, linearised.survey);
        Objective::new(system, survey, prior, &self.hypotheses, &self.current, self.ln_level)
    }

    /// Sets with each law of the lens in the place of those that join with some members, and with each alone. A
    /// distortion that the model lacks drives the camera far away from where it belongs, and there the first order does
    /// not say which of them it is: refits do. None where no law of the lens joins.
    pub(super) fn with_other_lens_laws(&self, members: &Members) -> Vec<Members> {
        let current = &self.current;
        let joins: Vec<usize> =
            members.laws.iter().copied().filter(|h| self.hypotheses[*h].lens && !current.has(*h)).collect();
        if joins.is_empty() {
            return Vec::new();
        }
        let less = joins.iter().fold(members.clone(), |less, h| less.without(*h));
        let lens_laws = || (0..self.hypotheses.len()).filter(|h| self.hypotheses[*h].lens);
        let has_key = |set: &Members, h: usize| set.all().any(|own| self.hypotheses[own].key == self.hypotheses[h].key);
        let mut sets: Vec<Members> = Vec::new();
        for start in [&less, current] {
            let open = lens_laws().filter(|h| !has_key(start, *h)).map(|h| start.with_law(h));
            sets.extend(open.filter(|set| !set.same(members)));
        }
        if less.same(current) {
            sets.truncate(sets.len() / 2);
        }
        sets
    }

    /// Sets with another variant of a searched place in the place of one that joins with some members. Where a sharp
    /// flaw lies the first order says to a cell of its grid, in which a smooth one of another size fits better: refits
    /// move both to their places.
    pub(super) fn with_other_variants(&self, members: &Members) -> Vec<Members> {
        let joins = members.laws.iter().copied().filter(|h| self.hypotheses[*h].placed && !self.current.has(*h));
        let others = |h: usize| {
            let own = &self.hypotheses[h];
            let is_other = move |other: &usize| *other != h && self.hypotheses[*other].id == own.id;
            (0..self.hypotheses.len()).filter(is_other).map(move |other| members.without(h).with_law(other))
        };
        joins.flat_map(others).collect()
    }

    /// The model as it stands without each of its members.
    pub(super) fn with_one_less(&self) -> Vec<Members> {
        self.current.all().map(|h| self.current.without(h)).collect()
    }

    /// Ids of members that are not among others.
    pub(super) fn ids_beyond(&self, members: &Members, others: &Members) -> Vec<String> {
        let id = |h: usize| self.hypotheses[h].id.clone();
        let others: Vec<String> = others.all().map(id).collect();
        members.all().map(id).filter(|id| !others.contains(id)).collect()
    }
}

/// What a change of members brings to first order.
pub(super) struct Expected {
    /// Drop of `v'Pv`.
    pub drop: f64,
    /// Degrees of freedom that it adds.
    pub dof: f64,
}

impl Expected {
    pub fn of(objective: &Objective<'_>, before: &Members, after: &Members) -> Self {
        let of_law = |law: &usize| objective.hypotheses[*law].columns.len() as f64;
        let dof = |members: &Members| members.laws.iter().map(of_law).sum::<f64>() + members.random.len() as f64;
        Self { drop: objective.chi_square(before) - objective.chi_square(after), dof: dof(after) - dof(before) }
    }
}

/// What the objective asks for next, to first order.
#[derive(Debug, Clone, PartialEq)]
pub enum Next {
    /// Take an effect in.
    Add(String),
    /// Take an effect out.
    Remove(String),
}

/// The first move towards the set that the search prefers to the model as it stands; `None`: it prefers none.
pub fn next(linearised: &Linearised, known: &Prices, settings: &Settings<'_>) -> Option<Next> {
    let competition = Competition::new(linearised, known, settings);
    let objective = competition.objective(linearised);
    let current = &competition.current;
    let best = search(&objective, current).into_iter().next()?;
    if best.value > objective.value(current) - SAME {
        return None;
    }
    // Of several that join the one that is worth most alone.
    let alone = |h: usize| match competition.hypotheses[h].random {
        true => objective.value(&objective.with_likeliest(current, h)),
        false => objective.value(&current.with_law(h)),
    };
    let joins = best.members.all().filter(|h| !current.has(*h)).map(|h| (alone(h), h));
    let first = joins.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, h)| Next::Add(competition.hypotheses[h].id.clone()));
    first.or_else(|| competition.ids_beyond(current, &best.members).into_iter().next().map(Next::Remove))
}

/// Alternatives of each member, by id: hypotheses in whose place it is no better than chance would make it. What is
/// left with such an alternative is as little as with the member itself.
pub fn alternatives(linearised: &Linearised, known: &Prices, settings: &Settings<'_>) -> BTreeMap<String, Vec<String>> {
    let competition = Competition::new(linearised, known, settings);
    let objective = competition.objective(linearised);
    let (current, hypotheses) = (&competition.current, &competition.hypotheses);
    let margin = objective.value(current) + chi_square_quantile(1.0 - competition.ln_level.exp(), 1.0);
    let of = |own: usize| {
        let less = current.without(own);
        let open = |h: &usize| {
            let id = &hypotheses[*h].id;
            hypotheses[*h].physical && !current.all().any(|member| hypotheses[member].id == *id)
        };
        let value = |h: usize| match hypotheses[h].random {
            true => objective.value(&objective.with_likeliest(&less, h)),
            false => objective.value(&less.with_law(h)),
        };
        let mut near: Vec<(f64, String)> = (0..hypotheses.len())
            .filter(open)
            .map(|h| (value(h), hypotheses[h].id.clone()))
            .filter(|(value, _)| *value < margin)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut ids: Vec<String> = Vec::new();
        for (_, id) in near {
            if !ids.contains(&id) {
                ids.push(id);
            }
        }
        (hypotheses[own].id.clone(), ids)
    };
    let members = current.all().filter(|own| hypotheses[*own].physical);
    members.map(of).collect()
}
