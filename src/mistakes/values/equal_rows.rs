//! Rows that agree to the last digit.

use std::collections::BTreeMap;
use std::hash::BuildHasher;

/// What a row is compared by.
pub type Key = [u64; 3];

/// Slots of the filter for each row: one row in eight is kept in vain.
const SLOTS: usize = 8;

/// Bits of hash values that were seen.
struct Seen {
    bits: Vec<u64>,
}

impl Seen {
    fn of(rows: usize) -> Self {
        Self { bits: vec![0; (SLOTS * rows).div_ceil(64).max(1)] }
    }

    fn place(&self, hash: u64) -> (usize, u64) {
        ((hash / 64) as usize % self.bits.len(), 1 << (hash % 64))
    }

    fn has(&self, hash: u64) -> bool {
        let (word, bit) = self.place(hash);
        self.bits[word] & bit != 0
    }

    /// Was it seen before?
    fn insert(&mut self, hash: u64) -> bool {
        let (word, bit) = self.place(hash);
        let before = self.bits[word] & bit != 0;
        self.bits[word] |= bit;
        before
    }
}

/// Pairs of names whose rows have equal keys, with the number of these rows; the lesser name first. Of more than two
/// equal rows each is paired with the first name. `rows` gives key and name of a row; a filter keeps memory small where
/// hardly any row has its like.
pub fn pairs(count: usize, row: impl Fn(usize) -> (Key, usize)) -> BTreeMap<(usize, usize), usize> {
    let hasher = foldhash::fast::FixedState::default();
    let hash = |k: usize| hasher.hash_one(row(k).0);
    let (mut once, mut twice) = (Seen::of(count), Seen::of(count));
    for hash in (0..count).map(hash) {
        if once.insert(hash) {
            twice.insert(hash);
        }
    }
    let mut kept: Vec<(Key, usize)> = (0..count).filter(|k| twice.has(hash(*k))).map(&row).collect();
    kept.sort_unstable();
    kept.dedup();
    let mut pairs = BTreeMap::new();
    for equal in kept.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, first), others @ ..] = equal {
            others.iter().for_each(|(_, other)| *pairs.entry((*first, *other)).or_default() += 1);
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_rows_pair_their_names() {
        let rows = [([1, 2, 3], 7), ([1, 2, 4], 7), ([1, 2, 3], 5), ([1, 2, 4], 5), ([9, 9, 9], 1), ([1, 2, 3], 8)];
        let found = pairs(rows.len(), |k| rows[k]);
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [((5, 7), 2), ((5, 8), 1)]);
    }

    #[test]
    fn rows_without_their_like_have_no_pair() {
        assert!(pairs(1000, |k| ([k as u64, 0, 1], k)).is_empty());
        assert!(pairs(0, |_| ([0; 3], 0)).is_empty());
    }
}
