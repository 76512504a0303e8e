//! What a shape on the sensor may be instead.

use super::super::linearised::Linearised;
use super::super::select::{Beside, Situation};
use super::super::test::separability::{INSEPARABLE, seen_by};

/// Laws of the whole image that are to be refitted beside `set`, significant or not: a distortion that is missing drives the camera far away, where
/// its own first order says little of it, and another shape takes a part of it. All of them where `set` is the best of many places on the sensor;
/// those that a law of the image could take for its own where it is such a law. Which of them it is, only their refits tell.
pub(super) fn laws_of_the_lens(
    linearised: &Linearised,
    situation: &Situation<'_>,
    set: usize,
    beside: &Beside,
) -> Vec<usize> {
    let is_placed = linearised.is_placed(set);
    if !is_placed && !linearised.is_of_lens(set) {
        return Vec::new();
    }
    let Some(own) = situation.judge(set, beside) else { return Vec::new() };
    let laws = situation.judge_all(beside).into_iter().filter(|judged| {
        let other = &situation.sets[judged.set];
        let may_be = other.physical && !judged.implausible && !situation.refused.contains(&other.id);
        may_be
            && !linearised.is_placed(judged.set)
            && linearised.is_of_lens(judged.set)
            && other.id != situation.sets[set].id
    });
    let taken = laws.filter(|judged| is_placed || seen_by(beside, &judged.pivoted, &own.pivoted) > INSEPARABLE);
    taken.map(|judged| judged.set).collect()
}
