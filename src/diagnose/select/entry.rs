//! What enters: the surest of what is significant among all candidates beside what is in. Where that is a law of a size that physics does not
//! allow, what it is comes first: whatever enters beside it would take a part of it.

use super::{Event, Nature, Situation, chance};

/// The surest candidate that names a cause, is significant, was not refused, predicts images that its estimate did not see, and is no chance
/// where a law says as much.
pub fn rule(situation: &Situation<'_>) -> Option<Event> {
    let beside = situation.beside();
    let judged = situation.judge_all(&beside);
    let first = judged.iter().find(|judged| situation.may_enter(judged) || situation.resembles(judged))?;
    if first.implausible {
        return Some(Event::Resembled { set: first.set });
    }
    let set = match situation.sets[first.set].nature {
        Nature::Law => chance::instead_of_law(situation, &beside, &judged, first).unwrap_or(first.set),
        Nature::Chance => {
            let values = chance::likeliest(situation, &beside, &judged).unwrap_or(first);
            chance::law_instead(situation, &beside, &judged, values).unwrap_or(values.set)
        }
    };
    Some(Event::Added { set })
}
