//! One step of the descent: sets that the search prefers are fitted, and the fit of the lowest objective is taken.

use super::competition::{Competition, Expected};
use super::heldout::held_out_px;
use super::improvement::{Improvement, Weights};
use super::ledger::{Change, Confirmation};
use super::linearised::Linearised;
use super::objective::{Members, Objective};
use super::refit::{Refits, Refitted};
use super::search::{Ranked, SAME, search};
use super::settings::Settings;
use crate::block::Block;
use crate::run::RunError;

/// Sets of the search that are refitted: to first order the best of them is not always the first.
const REFITS: usize = 3;
/// Share of the largest gain within which another set is refitted, too: what the first order commonly misses.
const NEAR: f64 = 0.1;

/// A set and its refit.
struct Tried {
    set: Ranked,
    refitted: Refitted,
}

impl Improvement {
    /// Goes on with the refit of the lowest objective among the sets that the search prefers. Did one lower it?
    ///
    /// # Errors
    /// A wish to stop.
    pub fn descend(
        &mut self,
        block: &Block,
        linearised: &Linearised,
        settings: &Settings<'_>,
    ) -> Result<bool, RunError> {
        let competition = Competition::new(linearised, &self.prices, settings);
        self.note_prices(&competition);
        let objective = competition.objective(linearised);
        let current = &competition.current;
        let (fit, added) = (&self.fit.clone(), &self.parts.clone());
        let refits = Refits { block, fit, added, linearised, objective: &objective, current, settings };
        let ranked = |sets: Vec<Members>| -> Vec<Ranked> {
            let allowed = sets.into_iter().filter(|members| objective.allows(members));
            allowed.map(|members| Ranked { value: objective.value(&members), members }).collect()
        };
        let preferred = preferred(&competition, search(&objective, current), &objective);
        let mut best = self.best_of(preferred, None, &competition, &refits)?;
        best = match best {
            Some(tried) => {
                let mut others = competition.with_other_lens_laws(&tried.set.members);
                others.extend(competition.with_other_variants(&tried.set.members));
                let others = ranked(others);
                self.best_of(others, Some(tried), &competition, &refits)?
            }
            // What joined where the first order said little is not kept for what it says of a removal.
            None => self.best_of(ranked(competition.with_one_less()), None, &competition, &refits)?,
        };
        let Some(Tried { set, refitted }) = best else { return Ok(false) };
        let added = competition.ids_beyond(&set.members, current);
        let removed = competition.ids_beyond(current, &set.members);
        let expected = Expected::of(&objective, current, &set.members);
        let gain = refitted.value - refits.value_of_current();
        let change = Change::Exchanged { added, removed };
        self.accept(block, refitted, change, (expected, gain), Weights::Estimated, settings)?;
        Ok(true)
    }

    /// The set whose refit has the lowest objective, `best` among them; `None` where none is lower than that of the
    /// model as it stands.
    fn best_of(
        &mut self,
        sets: Vec<Ranked>,
        mut best: Option<Tried>,
        competition: &Competition,
        refits: &Refits<'_>,
    ) -> Result<Option<Tried>, RunError> {
        let settings = refits.settings;
        for set in sets {
            let name = words(competition, &set.members);
            (settings.tell)(&format!("adjusting: {name}"));
            let refitted = match refits.refit(&set.members) {
                Ok(refitted) => refitted,
                Err(error) if settings.options.stop.is_raised() => return Err(error),
                Err(error) => {
                    (settings.tell)(&format!("{name}: the refit failed: {error}"));
                    continue;
                }
            };
            let kept = refitted.value < refits.value_of_current() - SAME;
            self.confirm(competition, &set, refits, &refitted, kept)?;
            if kept && best.as_ref().is_none_or(|best| refitted.value < best.refitted.value) {
                best = Some(Tried { set, refitted });
            }
        }
        Ok(best)
    }

    /// Notes what became of a refit.
    fn confirm(
        &mut self,
        competition: &Competition,
        set: &Ranked,
        refits: &Refits<'_>,
        refitted: &Refitted,
        kept: bool,
    ) -> Result<(), RunError> {
        let reason = match &refitted.carrier {
            _ if kept => String::new(),
            Some(point) => format!("it rests on point {point} alone, and a blunder there explains the misfit as well"),
            None => "its refit does not lower the objective".to_string(),
        };
        let drop = self.fit.chi_square() - refitted.fit.chi_square();
        let predicted = refits.objective.chi_square(&competition.current) - refits.objective.chi_square(&set.members);
        // The held-out error of a refit that is not kept is of no use.
        let after_px = match kept {
            true => held_out_px(&refitted.fit, refits.settings.options.threads)?,
            false => f64::NAN,
        };
        for id in competition.ids_beyond(&set.members, &competition.current) {
            let (before_px, reason) = (self.heldout_px, reason.clone());
            self.confirmations.push(Confirmation { id, predicted, drop, before_px, after_px, kept, reason });
        }
        Ok(())
    }
}

/// Of the sets that a search found those that are worth a refit. What adds to a better one waits for the next step.
fn preferred(competition: &Competition, found: Vec<Ranked>, objective: &Objective<'_>) -> Vec<Ranked> {
    let now = objective.value(&competition.current);
    let gain = |set: &Ranked| now - set.value;
    let most = found.first().map_or(0.0, gain);
    let near = |set: &Ranked| gain(set) > SAME && gain(set) > (1.0 - NEAR) * most;
    let mut sets: Vec<Ranked> = Vec::new();
    for set in found.into_iter().filter(near) {
        if sets.len() < REFITS && !sets.iter().any(|better| set.members.contains(&better.members)) {
            sets.push(set);
        }
    }
    sets
}

/// What a set changes, in words.
fn words(competition: &Competition, members: &Members) -> String {
    let joins = competition.ids_beyond(members, &competition.current);
    let leaves = competition.ids_beyond(&competition.current, members);
    let words = |ids: Vec<String>, word: &str| (!ids.is_empty()).then(|| format!("{word} {}", ids.join(" and ")));
    let all: Vec<String> = [words(joins, "with"), words(leaves, "without")].into_iter().flatten().collect();
    if all.is_empty() { "the same effects with other parameters".into() } else { all.join(", ") }
}
