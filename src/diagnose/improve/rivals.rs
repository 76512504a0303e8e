//! What a shape with a place on the sensor may be instead.

use super::super::linearised::Linearised;
use super::super::select::{Beside, Situation};
use crate::effects::Stage;

/// Laws of the whole image, where a shape with a place on the sensor is to enter, significant or not: a distortion that is missing drives the
/// camera far away, where its own first order says little of it, and a shape of the best of many places takes a part of it. Which of them it
/// is, only their refits tell.
pub(super) fn laws_of_the_lens(
    linearised: &Linearised,
    situation: &Situation<'_>,
    set: usize,
    beside: &Beside,
) -> Vec<usize> {
    if !linearised.is_placed(set) {
        return Vec::new();
    }
    let of_image = |set: usize| {
        let term = linearised.candidates[set].as_ref().and_then(|candidate| candidate.term());
        term.is_some_and(|term| term.effect.descriptor().stage == Stage::Image)
    };
    let laws = situation.judge_all(beside).into_iter().filter(|judged| !judged.implausible).map(|judged| judged.set);
    let may_be = laws.filter(|other| {
        let own = &situation.sets[*other];
        own.physical && !situation.refused.contains(&own.id) && !linearised.is_placed(*other) && of_image(*other)
    });
    may_be.collect()
}
