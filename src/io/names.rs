//! Names to numbers, for millions of names: one arena of bytes and a table of numbers, no allocation per name.

use foldhash::fast::RandomState;
use std::hash::BuildHasher;

/// Mark of a free slot; so many names do not fit into memory.
const FREE: u32 = u32::MAX;

/// Bytes of a name that stand in its slot. Most names are no longer: looking one up reads one place in memory and not
/// three, of which each is far from the one before it.
const HEAD_BYTES: usize = 8;

/// Distinct names, numbered from 0 in the order in which they came.
#[derive(Default)]
pub(super) struct Names {
    bytes: Vec<u8>,
    /// End of each name in `bytes`.
    ends: Vec<usize>,
    /// Open addressing with linear probing, a power of two long, at most half full.
    slots: Vec<Slot>,
    hasher: RandomState,
}

/// A name's number, and as much of the name as tells it from most others.
#[derive(Clone, Copy)]
struct Slot {
    head: [u8; HEAD_BYTES],
    /// Length of the name, or the largest one that there is room for.
    length: u32,
    number: u32,
}

impl Slot {
    fn new(name: &[u8], number: u32) -> Self {
        let mut head = [0; HEAD_BYTES];
        let known = name.len().min(HEAD_BYTES);
        head[..known].copy_from_slice(&name[..known]);
        Self { head, length: u32::try_from(name.len()).unwrap_or(u32::MAX), number }
    }

    fn is_free(&self) -> bool {
        self.number == FREE
    }
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
        let slot = self.slots[self.place(name)];
        (!slot.is_free()).then_some(slot.number)
    }

    /// Numbers a name: its number, and whether it is new.
    pub(super) fn insert(&mut self, name: &[u8]) -> (u32, bool) {
        if 2 * (self.len() + 1) > self.slots.len() {
            self.grow();
        }
        let place = self.place(name);
        if !self.slots[place].is_free() {
            return (self.slots[place].number, false);
        }
        let number = self.ends.len() as u32;
        self.bytes.extend_from_slice(name);
        self.ends.push(self.bytes.len());
        self.slots[place] = Slot::new(name, number);
        (number, true)
    }

    /// Where the slot of a name is, or the free one where it belongs.
    fn place(&self, name: &[u8]) -> usize {
        let wanted = Slot::new(name, FREE);
        let mask = self.slots.len() - 1;
        let mut place = self.hasher.hash_one(name) as usize & mask;
        loop {
            let slot = &self.slots[place];
            if slot.is_free() {
                return place;
            }
            let begins_alike = slot.head == wanted.head && slot.length == wanted.length;
            if begins_alike && (name.len() <= HEAD_BYTES || self.get(slot.number as usize) == name) {
                return place;
            }
            place = (place + 1) & mask;
        }
    }

    fn grow(&mut self) {
        self.slots = vec![Slot::new(b"", FREE); (2 * self.slots.len()).max(16)];
        for number in 0..self.len() {
            let name = self.get(number);
            let (place, slot) = (self.place(name), Slot::new(name, number as u32));
            self.slots[place] = slot;
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

    #[test]
    fn names_with_the_same_beginning_are_told_apart() {
        let mut names = Names::default();
        let all: [&[u8]; 6] = [b"", b"\0", b"DSC00001", b"DSC00001.JPG", b"DSC00001.jpg", b"DSC00001\0"];
        for (number, name) in all.iter().enumerate() {
            assert_eq!(names.insert(name), (number as u32, true));
        }
        for (number, name) in all.iter().enumerate() {
            assert_eq!(names.find(name), Some(number as u32));
        }
        assert_eq!(names.find(b"DSC00001.JPGs"), None);
    }
}
