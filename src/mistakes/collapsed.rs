//! Positions that stand for several places: zeros for missing values, one line copied down a list.

use super::align::align;
use super::survey::{Group, Member, Survey};
use super::words;
use super::{BEYOND, Mistake};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Equal positions that are no coincidence: two names may be given to one nail. Zeros in all coordinates say by
/// themselves that values are missing.
const FEWEST: usize = 3;

/// The group without positions that stand for several places, and those as a mistake.
pub fn without(group: &Group, survey: &Survey) -> (Group, Option<Mistake>) {
    let mut places: BTreeMap<[u64; 3], Vec<usize>> = BTreeMap::new();
    for (k, member) in group.members.iter().enumerate() {
        places.entry([0, 1, 2].map(|axis| (member.recorded[axis] + 0.0).to_bits())).or_default().push(k);
    }
    let are_zero = |same: &[usize]| same.iter().all(|k| group.members[*k].recorded == Vector3::zeros());
    let is_one = |same: &Vec<usize>| same.len() >= FEWEST || are_zero(same);
    let Some(same) = places.into_values().filter(is_one).max_by_key(Vec::len) else {
        return (group.clone(), None);
    };
    let keep = |wanted: bool| -> Vec<Member> {
        let of = |(k, member): (usize, &Member)| (same.contains(&k) == wanted).then(|| member.clone());
        group.members.iter().enumerate().filter_map(of).collect()
    };
    let rest = Group { members: keep(false), ..group.clone() };
    let together = keep(true);
    let few = together.len() < FEWEST;
    if (few && !beside(&together, &rest, survey)) || (!few && !apart(&together, &rest, survey)) {
        return (group.clone(), None);
    }
    let all = rest.members.is_empty();
    let names = if all { Vec::new() } else { together.iter().map(|member| member.name.clone()).collect() };
    let mistake = words::collapsed(group.subject, names, &together[0].recorded, together.len());
    (rest, Some(mistake))
}

/// Are the places apart in the free network? By more than what the rest of the group leaves unexplained, by an order of
/// magnitude; without a rest, by more than the same share of the distance from which they are seen.
fn apart(together: &[Member], rest: &Group, survey: &Survey) -> bool {
    let places: Vec<Vector3<f64>> = together.iter().filter_map(|member| member.computed).collect();
    let Some(first) = places.first() else { return false };
    let extent = places.iter().map(|p| (p - first).norm()).fold(0.0, f64::max);
    let (source, target) = seen(rest);
    match align(&source, &target, rest.sigma) {
        Some(aligned) => {
            let [xy, z] = aligned.deviation();
            extent * aligned.similarity.scale > BEYOND * xy.max(z)
        }
        None => extent * BEYOND > survey.distance,
    }
}

/// Do the images see these members elsewhere than where they are recorded? By more than what the rest of the group
/// leaves unexplained and by more than a pixel, by an order of magnitude: few points may fit by chance.
fn beside(members: &[Member], rest: &Group, survey: &Survey) -> bool {
    let (source, target) = seen(rest);
    let Some(aligned) = align(&source, &target, rest.sigma) else { return false };
    let [xy, z] = aligned.deviation();
    let floor = xy.max(z).max(survey.pixel * aligned.similarity.scale);
    members
        .iter()
        .filter_map(|member| Some((member.computed?, member.recorded)))
        .all(|(computed, recorded)| (aligned.similarity.apply(&computed) - recorded).norm() > BEYOND * floor)
}

/// Members that the images give: where, and as recorded.
fn seen(group: &Group) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    group.members.iter().filter_map(|member| Some((member.computed?, member.recorded))).unzip()
}
