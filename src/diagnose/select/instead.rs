//! What could stand in the place of an effect: a law that is significant there, and beside which that effect is not. Nothing in the measurements then
//! says which of the two it is, however little they look alike: of a weak effect even half may be too little to be missed.

use super::{Nature, Situation};

/// Sets of the laws that could stand in the place of the law `set`, which is not in; surest first.
pub fn of(situation: &Situation<'_>, set: usize) -> Vec<usize> {
    let own = &situation.sets[set];
    if own.nature != Nature::Law {
        return Vec::new();
    }
    let beside = situation.beside();
    let others = situation.judge_all(&beside).into_iter().filter(|other| {
        let set = &situation.sets[other.set];
        set.nature == Nature::Law && set.id != own.id && situation.may_enter(other)
    });
    let takes_all = |columns: &[usize]| {
        let left = situation.judge(set, &beside.and(columns));
        left.is_none_or(|left| left.ln_p > situation.ln_level)
    };
    others.filter(|other| takes_all(&other.pivoted.kept)).map(|other| other.set).collect()
}
