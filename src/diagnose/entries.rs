//! What a linearisation says of each candidate, and of each effect that is in, as entries of `diagnosis.json`.

use super::competition::alternatives;
use super::hypothesis::{self, Hypothesis, Prices};
use super::impact;
use super::improvement::Improvement;
use super::ledger::Confirmation;
use super::linearised::Linearised;
use super::select::{Beside, Judged};
use super::settings::Settings;
use super::verdict::{CandidateEntry, ConfirmedEntry, DetectableEntry, EstimateEntry, FoundEntry, LeftEntry};
use crate::block::Block;
use crate::effects::{Need, Parameter, Role, Scope, Words};
use crate::problem::Problem;
use crate::problem::velocities::derived;
use crate::score::separability::{self, INSEPARABLE};
use crate::score::{power, random};
use std::collections::BTreeMap;

/// Typical standard deviation of the image measurements, px.
fn pixel(problem: &Problem) -> f64 {
    let sum: f64 = problem.observations.iter().map(|o| 1.0 / o.inverse_sigma).sum();
    sum / problem.observations.len() as f64
}

/// RMS over all image coordinates of what a drop of `v'Pv` takes away, px.
fn size_px(problem: &Problem, drop: f64) -> f64 {
    pixel(problem) * (drop.max(0.0) / (2.0 * problem.observations.len() as f64)).sqrt()
}

/// The effects that the diagnosis took in, at the final model.
pub(super) fn found(
    block: &Block,
    last: &Linearised,
    improvement: &Improvement,
    settings: &Settings<'_>,
) -> Vec<FoundEntry> {
    let alternatives = alternatives(last, &improvement.prices, settings);
    let situation = last.situation(settings);
    let impacts = impact::of_taken(block, last, &situation);
    let entry = |(id, impact): (String, Option<impact::Impact>)| {
        let without = situation.without(&id);
        let set = last.sets.iter().position(|set| set.id == id)?;
        let judged = without.judge(set, &without.beside())?;
        let inseparable_from = alternatives.get(&id).cloned().unwrap_or_default();
        Some(FoundEntry {
            estimate: estimates(last, &judged),
            drop: drop_of_all(last, &judged),
            p_value: judged.ln_p.exp(),
            ln_p_value: judged.ln_p,
            size_px: size_px(last.null.problem(), drop_of_all(last, &judged)),
            impact,
            inseparable_from,
            plausible: !judged.implausible,
            options: options(&improvement.fit.problem, &id),
            inputs: inputs(block, &improvement.fit.problem, &id),
            words: words(&improvement.fit.problem, &id),
            effect: id,
        })
    };
    let physical = |id: &String| last.sets.iter().any(|set| set.id == *id && set.physical);
    impacts.into_iter().filter(|(id, _)| physical(id)).filter_map(entry).collect()
}

/// Drop of `v'Pv` by all values of a set of which columns are a sample.
fn drop_of_all(linearised: &Linearised, judged: &Judged) -> f64 {
    judged.drop * linearised.values_per_column(judged.set)
}

/// Options of an effect in the model that are not the default, by name.
fn options(problem: &Problem, id: &str) -> BTreeMap<String, String> {
    let Some(instance) = problem.effects.iter().find(|instance| instance.effect.descriptor().id == id) else {
        return BTreeMap::new();
    };
    let named = |(parameter, (_, place)): (&Parameter, &(Scope, u32))| {
        let Role::Given(values) = &parameter.role else { return None };
        let value = problem.start.theta[*place as usize];
        let (name, _) = values.iter().find(|(_, number)| *number == value && value != parameter.nominal)?;
        Some((parameter.name.to_string(), name.to_string()))
    };
    instance.effect.descriptor().parameters.iter().zip(&instance.slots).filter_map(named).collect()
}

/// Where the velocities come from that an effect needs.
fn inputs(block: &Block, problem: &Problem, id: &str) -> Option<String> {
    let term = problem.effects.iter().find(|term| term.effect.descriptor().id == id)?;
    if !term.effect.descriptor().needs.contains(&Need::Velocity) {
        return None;
    }
    let centres: Vec<_> = problem.start.poses.iter().map(|pose| pose.centre).collect();
    let mut sigmas: Vec<f64> = derived(block, &centres).into_iter().flatten().map(|own| own.sigma).collect();
    if sigmas.is_empty() {
        return Some("velocities: measured".into());
    }
    sigmas.sort_by(f64::total_cmp);
    let median = sigmas[sigmas.len() / 2];
    let by = if median.is_finite() { format!(", +- {median:.2} m/s") } else { String::new() };
    Some(format!("velocities: derived from adjusted positions and times{by}"))
}

/// An effect's words, for a report that does not know the plug-in.
fn words(problem: &Problem, id: &str) -> Option<Words> {
    let term = problem.effects.iter().find(|term| term.effect.descriptor().id == id)?;
    term.effect.descriptor().words.clone()
}

/// The empirical fields in the model: the shape of the unexplained pattern, its size, and what it does to the points.
pub(super) fn left(block: &Block, last: &Linearised, settings: &Settings<'_>) -> Vec<LeftEntry> {
    let situation = last.situation(settings);
    let impacts = impact::of_taken(block, last, &situation);
    let entry = |(id, impact): (String, Option<impact::Impact>)| {
        let set = last.sets.iter().position(|set| set.id == id && !set.physical)?;
        let without = situation.without(&id);
        let judged = without.judge(set, &without.beside())?;
        Some(LeftEntry { field: id, size_px: size_px(last.null.problem(), judged.drop), impact })
    };
    impacts.into_iter().filter_map(entry).collect()
}

/// Every candidate at the base model.
pub(super) fn candidates(
    block: &Block,
    improvement: &Improvement,
    first: &Linearised,
    settings: &Settings<'_>,
) -> Vec<CandidateEntry> {
    let situation = first.situation(settings);
    let beside = situation.beside();
    let judged = situation.judge_all(&beside);
    let level = first.ln_level(settings.significance);
    let hypotheses = hypothesis::all(first, &Prices::new(), settings);
    let impacts = impact::of_candidates(block, first, &situation, &judged);
    let confirmed = |id: &str| -> Option<ConfirmedEntry> {
        improvement.confirmations.iter().rfind(|confirmation| confirmation.id == id).map(confirmed_entry)
    };
    let seen = |a: &Judged, b: &Judged| -> f64 {
        if a.component.is_some() || b.component.is_some() {
            return 0.0;
        }
        let one = separability::seen_by(&beside, &a.pivoted, &b.pivoted);
        one.max(separability::seen_by(&beside, &b.pivoted, &a.pivoted))
    };
    let physical = |judged: &Judged| first.sets[judged.set].physical;
    let id = |judged: &Judged| first.sets[judged.set].id.clone();
    let mut entries: Vec<CandidateEntry> = Vec::new();
    for (position, one) in judged.iter().enumerate() {
        let partners = judged.iter().enumerate();
        let partners = partners.filter(|(other, b)| *other != position && physical(b) && seen(one, b) > INSEPARABLE);
        let inseparable_from = partners.map(|(_, b)| id(b)).collect();
        let estimate = estimates(first, one);
        let change = impacts[position].as_ref().filter(|impact| impact.surveyed).map(|impact| impact.rms_m);
        entries.push(CandidateEntry {
            effect: id(one),
            rank: position + 1,
            kind: kind(physical(one)),
            statistic: one.statistic,
            test: if one.component.is_some() { "z" } else { "F" }.into(),
            dof: one.dof,
            p_value: one.ln_p.exp(),
            ln_p_value: one.ln_p,
            family_p_value: Some(sidak(one.ln_p, first.family())),
            significant: one.ln_p < level,
            predicted_drop: drop_of_all(first, one),
            detectable: detectable(first, &beside, one, hypotheses.iter().find(|own| own.set == one.set), change),
            estimate,
            predicted_check_change_m: change,
            size_px: size_px(first.null.problem(), drop_of_all(first, one)),
            plausible: !one.implausible,
            impact: impacts[position].clone(),
            inseparable_from,
            design_effect: one.design_effect,
            needs: Vec::new(),
            tested: true,
            confirmed: confirmed(&id(one)),
        });
    }
    let tested: Vec<String> = entries.iter().map(|entry| entry.effect.clone()).collect();
    let absorbed = first
        .sets
        .iter()
        .zip(&first.candidates)
        .filter(|(set, candidate)| candidate.is_some() && !tested.contains(&set.id));
    let mut untested: Vec<(String, bool, Vec<String>)> = Vec::new();
    for (set, _) in absorbed {
        if !untested.iter().any(|(id, ..)| *id == set.id) {
            let needs =
                vec!["a block that does not absorb it: its size would not be known to its plausible range".into()];
            untested.push((set.id.clone(), set.physical, needs));
        }
    }
    untested.extend(first.untested.iter().map(|c| (c.id.clone(), c.physical, c.needs.clone())));
    for (effect, physical, needs) in untested {
        entries.push(CandidateEntry {
            rank: entries.len() + 1,
            kind: kind(physical),
            statistic: 0.0,
            test: String::new(),
            dof: 0.0,
            p_value: 1.0,
            ln_p_value: 0.0,
            family_p_value: None,
            significant: false,
            predicted_drop: 0.0,
            estimate: BTreeMap::new(),
            predicted_check_change_m: None,
            size_px: 0.0,
            plausible: true,
            impact: None,
            inseparable_from: Vec::new(),
            design_effect: 1.0,
            detectable: None,
            needs,
            tested: false,
            confirmed: confirmed(&effect),
            effect,
        });
    }
    entries
}

/// Probability that the clearest of `tests` independent tests is at least as clear by chance (Sidak).
fn sidak(ln_p: f64, tests: usize) -> f64 {
    -(tests as f64 * (-ln_p.exp()).ln_1p()).exp_m1()
}

/// Sizes by parameter.
fn estimates(linearised: &Linearised, judged: &Judged) -> BTreeMap<String, EstimateEntry> {
    let problem = linearised.null.problem();
    let set = &linearised.sets[judged.set];
    let theta = problem.layout().theta(0);
    let mut estimates = BTreeMap::new();
    if let Some(component) = &judged.component {
        let unit = linearised.unit(set.columns[0]);
        let entry = &problem.theta[linearised.null.unknown(set.columns[0]) - theta];
        let descriptor = problem.effects[entry.effect as usize].effect.descriptor();
        for parameter in &descriptor.parameters {
            if let Role::Random(name) = parameter.role {
                let unit_name = parameter.unit.to_string();
                let (value, sigma) = (component.deviation * unit, component.sigma * unit);
                estimates.insert(name.to_string(), EstimateEntry { value, sigma, unit: unit_name });
            }
        }
        return estimates;
    }
    let variances = judged.pivoted.variances();
    for (position, (column, value)) in judged.pivoted.kept.iter().zip(judged.pivoted.estimate().iter()).enumerate() {
        let (name, unit) = linearised.parameter(*column);
        let unknown = linearised.null.unknown(*column);
        let scale = linearised.unit(*column);
        // A place or a lag is a column for its change from where it is.
        let searched = |t: &usize| {
            let entry = &problem.theta[*t];
            let parameters = &problem.effects[entry.effect as usize].effect.descriptor().parameters;
            matches!(parameters[entry.parameter as usize].role, Role::Searched(_))
        };
        let from = unknown.checked_sub(theta).filter(searched).map_or(0.0, |t| linearised.null.state().theta[t]);
        let sigma = (variances[position] * judged.inflation).sqrt() * scale;
        estimates.insert(name, EstimateEntry { value: from + value * scale, sigma, unit });
    }
    estimates
}

fn kind(physical: bool) -> String {
    if physical { "physical" } else { "empirical" }.into()
}

fn confirmed_entry(confirmation: &Confirmation) -> ConfirmedEntry {
    ConfirmedEntry {
        drop: confirmation.drop,
        heldout_rms_px_before: confirmation.before_px,
        heldout_rms_px_after: Some(confirmation.after_px).filter(|rms| rms.is_finite()),
        kept: confirmation.kept,
        reason: confirmation.reason.clone(),
    }
}

/// Of one size alone. That of a flaw depends on its place and width, which a search chooses where there is none.
fn detectable(
    linearised: &Linearised,
    beside: &Beside,
    judged: &Judged,
    hypothesis: Option<&Hypothesis>,
    change: Option<f64>,
) -> Option<DetectableEntry> {
    let estimate = estimates(linearised, judged).into_values().next()?;
    let columns = &linearised.sets[judged.set].columns;
    let size = match (&judged.component, judged.pivoted.kept.as_slice(), hypothesis?) {
        (Some(_), _, own) => random::smallest_seen(beside, columns, own.price)? * linearised.unit(columns[0]),
        (None, [_], own) if !own.placed => {
            power::noncentrality(own.price / own.design_effect, 1.0).sqrt() * estimate.sigma
        }
        _ => return None,
    };
    // The change is linear in the size of the effect.
    let check_change_m = change.filter(|_| estimate.value != 0.0).map(|change| change * size / estimate.value.abs());
    // The statistic of a variance grows with its square, and with the square root of the number of values.
    let factor_of_sample = hypothesis?.values_per_column.powf(0.25);
    Some(DetectableEntry { size, unit: estimate.unit, check_change_m, factor_of_sample })
}

#[cfg(test)]
mod tests {
    use super::sidak;

    #[test]
    fn a_p_value_among_many_tests_is_that_of_the_clearest() {
        assert!((sidak(0.01_f64.ln(), 1) - 0.01).abs() < 1e-15);
        // One less the probability that none of 20 is as clear.
        assert!((sidak(0.01_f64.ln(), 20) - (1.0 - 0.99_f64.powi(20))).abs() < 1e-14);
        // Far below what 1 - p resolves.
        assert!((sidak(1e-30_f64.ln(), 20) / 2e-29 - 1.0).abs() < 1e-9);
        assert!(sidak(0.0, 20) == 1.0 && sidak(f64::NEG_INFINITY, 20) == 0.0);
    }
}
