//! Names to numbers, for millions of names: one arena of bytes and a table of numbers, no allocation per name.

use std::hash::{BuildHasher, RandomState};

/// Mark of a free slot; so many names do not fit into memory.
const FREE: u32 = u32::MAX;

/// Distinct names, numbered from 0 in the order in which they came.
#[derive(Default)]
pub(super) struct Names {
    bytes: Vec<u8>,
    /// End of each name in `bytes`.
    ends: Vec<usize>,
    /// Open addressing with linear probing, a power of two long, at most half full.
    slots: Vec<u32>,
    hasher: RandomState,
}

impl Names {
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// The name of a number.
    pub(super) fn get(&self, number: usize) -> &[u8] {
        let start = if number == 0 { 0 } else { self.ends[number - 1] };
        &self.bytes[start..self.ends[number]]
    }

    /// The number of a name, if it has one.
    pub(super) fn find(&self, name: &[u8]) -> Option<u32> {
        if self.slots.is_empty() {
            return None;
        }
        let number = self.slots[self.slot(name)];
        (number != FREE).then_some(number)
    }

    /// Numbers a name: its number, and whether it is new.
    pub(super) fn insert(&mut self, name: &[u8]) -> (u32, bool) {
        if 2 * (self.len() + 1) > self.slots.len() {
            self.grow();
        }
        let slot = self.slot(name);
        if self.slots[slot] != FREE {
            return (self.slots[slot], false);
        }
        let number = self.ends.len() as u32;
        self.bytes.extend_from_slice(name);
        self.ends.push(self.bytes.len());
        self.slots[slot] = number;
        (number, true)
    }

    /// The slot that holds a name, or the free one where it belongs.
    fn slot(&self, name: &[u8]) -> usize {
        let mask = self.slots.len() - 1;
        let mut slot = self.hasher.hash_one(name) as usize & mask;
        while self.slots[slot] != FREE && self.get(self.slots[slot] as usize) != name {
            slot = (slot + 1) & mask;
        }
        slot
    }

    fn grow(&mut self) {
        self.slots = vec![FREE; (2 * self.slots.len()).max(16)];
        for number in 0..self.len() {
            let slot = self.slot(self.get(number));
            self.slots[slot] = number as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_follow_the_order_of_arrival() {
        let mut names = Names::default();
        assert_eq!(names.find(b"a"), None);
        for i in 0..1000u32 {
            assert_eq!(names.insert(format!("n{i}").as_bytes()), (i, true));
        }
        assert_eq!(names.insert(b""), (1000, true));
        for i in 0..1000u32 {
            assert_eq!(names.insert(format!("n{i}").as_bytes()), (i, false));
            assert_eq!(names.get(i as usize), format!("n{i}").as_bytes());
        }
        assert_eq!(names.find(b""), Some(1000));
        assert_eq!(names.find(b"n1000"), None);
        assert_eq!(names.len(), 1001);
    }
}
