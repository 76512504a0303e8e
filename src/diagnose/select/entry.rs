//! What enters: the surest of what is significant among all candidates beside what is in.

use super::{Event, Judged, Nature, Situation, chance};

/// The surest candidate that names a cause, is significant, was not refused, predicts images that its estimate did not see, and is no chance
/// where a law says as much.
pub fn rule(situation: &Situation<'_>) -> Option<Event> {
    let beside = situation.beside();
    let judged = situation.judge_all(&beside);
    let mut significant = judged.iter().filter(|judged| may_enter(situation, judged));
    let first = significant.next()?;
    let set = match situation.sets[first.set].nature {
        Nature::Law => chance::instead_of_law(situation, &beside, &judged, first).unwrap_or(first.set),
        Nature::Chance => {
            let values = chance::likeliest(situation, &beside, &judged).unwrap_or(first);
            chance::law_instead(situation, &beside, &judged, values).unwrap_or(values.set)
        }
    };
    Some(Event::Added { set })
}

/// Significant, the name of a cause, of a size that physics allows, not refused, and of use where it was not fitted?
pub fn may_enter(situation: &Situation<'_>, judged: &Judged) -> bool {
    let set = &situation.sets[judged.set];
    set.physical
        && judged.ln_p < situation.ln_level
        && !situation.refused.contains(&set.id)
        && !judged.implausible
        && judged.predicted_drop.is_none_or(|drop| drop > 0.0)
}
