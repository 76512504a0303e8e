//! What is left may take an effect out only where it could itself be the effect.

use super::{Event, Situation, Taken};
use crate::diagnose::test::{System, separability, variance_factor};
use rayon::prelude::*;

/// A structure overlaps an effect where it could take the larger part of what the effect explains.
const OVERLAP: f64 = 0.5;
/// An effect that explains less than this share of what it and the structure explain together is a part of the structure.
const SHARE: f64 = 0.5;

/// A structure that is left: columns of the same system, significant beside everything that is in. Properties of the noise (neighbours that
/// err together, tails, weights) are none: they take no effect out.
#[derive(Debug, Clone)]
pub struct Shape {
    /// What it is called.
    pub name: String,
    /// Its columns.
    pub columns: Vec<usize>,
}

/// The effect that a structure takes out: one that beside it is not significant any more, or one that it overlaps and that explains less than
/// half of what both explain together.
pub fn rule(situation: &Situation<'_>, structures: &[Shape]) -> Option<Event> {
    let removable = situation.taken.par_iter().filter(|taken| taken.removable);
    removable.find_map_first(|taken| challenged(situation, taken, structures))
}

fn challenged(situation: &Situation<'_>, taken: &Taken, structures: &[Shape]) -> Option<Event> {
    let id = &situation.sets[taken.set].id;
    let without = situation.without(id);
    let beside = without.beside();
    let judged = without.judge(taken.set, &beside)?;
    structures.iter().find_map(|structure| {
        let pattern = beside.pivoted(&structure.columns);
        let overlaps = separability::seen_by(&beside, &judged.pivoted, &pattern).powi(2) > OVERLAP;
        let share = share_beside(&beside, &judged.pivoted.kept, structure, judged.drop);
        // A field of many columns holds every smooth law: that nothing is left beside it says nothing.
        let rich = structure.columns.len() > FIELD_COLUMNS;
        let significant = rich || {
            let with_structure = beside.and(&structure.columns);
            without.judge(taken.set, &with_structure).is_some_and(|judged| judged.ln_p < situation.ln_level)
        };
        let why = format!(
            "explains {:.0} % of what {} and it explain together{}",
            100.0 * share,
            structure.name,
            if significant { "" } else { ", and nothing beside it" }
        );
        ((overlaps && share < SHARE) || !significant).then(|| Event::Removed { id: id.clone(), why })
    })
}

/// Share of the effect in what both explain together, less what chance explains with as many columns.
fn share_beside(beside: &System, effect: &[usize], structure: &Shape, drop: f64) -> f64 {
    let together = beside.pivoted_in_turn(&[effect, &structure.columns]);
    let rest = beside.redundancy - together.kept.len() as f64;
    let variance = variance_factor(beside.chi_square - together.drop(), rest);
    let by_chance = variance * (together.kept.len() - effect.len().min(together.kept.len())) as f64;
    drop / (together.drop() - by_chance).max(drop)
}

/// A structure of more columns than this is a field, not a shape.
const FIELD_COLUMNS: usize = 24;
