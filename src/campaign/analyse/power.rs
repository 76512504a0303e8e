//! Power: how often what is there is named, by the levels of all factors but the repetitions.

use super::super::gather::Row;
use super::{REPEATED, Share, finished};
use std::collections::BTreeMap;

/// Cases of one combination of levels.
#[derive(Debug, Clone, PartialEq)]
pub struct Power {
    /// Names of the levels, by factor.
    pub levels: BTreeMap<String, String>,
    /// What a diagnosis should name.
    pub expected: Vec<String>,
    /// Cases in which something is named.
    pub seen: Share,
    /// Cases in which all that is expected is named, whatever beside it.
    pub named: Share,
    /// Cases in which that alone is named.
    pub right: Share,
}

/// The cases with something to find, by levels, in the order of the plan.
pub fn power(rows: &[Row]) -> Vec<Power> {
    let mut all: Vec<Power> = Vec::new();
    let mut places: BTreeMap<(BTreeMap<String, String>, Vec<String>), usize> = BTreeMap::new();
    for (row, outcome) in finished(rows).filter(|(row, _)| !row.expected.is_empty()) {
        let mut levels = row.factors.clone();
        levels.remove(REPEATED);
        let expected = row.expected.clone();
        let place = *places.entry((levels.clone(), expected.clone())).or_insert(all.len());
        if place == all.len() {
            let none = Share { hits: 0, of: 0 };
            all.push(Power { levels, expected, seen: none, named: none, right: none });
        }
        let said = outcome.said();
        let own = &mut all[place];
        let is_named = own.expected.iter().all(|one| said.contains(&one.as_str()));
        let counts = [(&mut own.seen, !said.is_empty()), (&mut own.named, is_named), (&mut own.right, outcome.right)];
        for (share, counts) in counts {
            share.of += 1;
            share.hits += usize::from(counts);
        }
    }
    all
}
