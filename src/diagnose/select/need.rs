//! What is in must stay significant beside everything else that is in, by the rule that let it in. What keeps another effect within its
//! plausible range stays: without it, that one would not name a cause any more.

use super::super::probability::probability;
use super::{Event, Situation, Taken};

/// The least sure of what is in and not significant any more leaves.
pub fn rule(situation: &Situation<'_>) -> Option<Event> {
    let mut least: Option<(f64, String)> = None;
    for taken in situation.taken.iter().filter(|taken| taken.removable) {
        let id = &situation.sets[taken.set].id;
        let without = situation.without(id);
        let judged = without.judge(taken.set, &without.beside());
        let ln_p = judged.map_or(0.0, |judged| judged.ln_p);
        if ln_p > situation.ln_level
            && !implausible_without(situation, &without)
            && least.as_ref().is_none_or(|(other, _)| ln_p > *other)
        {
            least = Some((ln_p, id.clone()));
        }
    }
    least.map(|(ln_p, id)| {
        let why = format!("not significant beside the others any more ({})", probability(ln_p));
        Event::Removed { id, why }
    })
}

/// Does an effect leave its plausible range when another leaves?
fn implausible_without(situation: &Situation<'_>, without: &Situation<'_>) -> bool {
    let implausible = |situation: &Situation<'_>, taken: &Taken| {
        let others = situation.without(&situation.sets[taken.set].id);
        others.judge(taken.set, &others.beside()).is_some_and(|judged| judged.implausible)
    };
    without.taken.iter().any(|taken| implausible(without, taken) && !implausible(situation, taken))
}
