//! Numbers that begin where a cache line does: a vector register then fills from one line instead of two.

use std::hint::black_box;
use std::ops::{Deref, DerefMut};

/// Bytes of a cache line, and of the widest vector register.
const LINE_BYTES: usize = 64;
/// Numbers of a cache line.
pub const LINE: usize = LINE_BYTES / size_of::<f64>();

/// Zeros to sum in. Sums are read before they are written, and a page of zeros that is read first is set up twice, the
/// second time with an interrupt of every processor that the program runs on: so each is written here.
pub fn zeros(length: usize) -> Vec<f64> {
    let mut numbers = vec![0.0; length];
    black_box(&mut *numbers).fill(0.0);
    numbers
}

/// A fixed number of numbers.
#[derive(Debug)]
pub struct Aligned {
    storage: Vec<f64>,
    first: usize,
    length: usize,
}

impl Aligned {
    /// Zeros.
    pub fn zeros(length: usize) -> Self {
        let storage = zeros(length + LINE);
        let first = storage.as_ptr().align_offset(LINE_BYTES).min(LINE);
        Self { storage, first, length }
    }

    /// Becomes zeros, in the memory that it has as long as that suffices.
    pub fn restart(&mut self, length: usize) {
        if self.first + length > self.storage.len() {
            *self = Self::zeros(length);
        } else {
            self.length = length;
            self.fill(0.0);
        }
    }
}

impl Clone for Aligned {
    fn clone(&self) -> Self {
        let mut copy = Self::zeros(self.length);
        copy.copy_from_slice(self);
        copy
    }
}

impl Deref for Aligned {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        &self.storage[self.first..self.first + self.length]
    }
}

impl DerefMut for Aligned {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.storage[self.first..self.first + self.length]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_restart_leaves_nothing_of_before() {
        let mut numbers = Aligned::zeros(10);
        numbers.fill(1.0);
        for length in [3, 10, 40, 20] {
            numbers.restart(length);
            assert_eq!(*numbers, vec![0.0; length]);
            numbers.fill(1.0);
        }
    }

    #[test]
    fn numbers_begin_with_a_line_and_copies_too() {
        for length in [0, 1, 7, 8, 1000] {
            let mut numbers = Aligned::zeros(length);
            numbers.iter_mut().enumerate().for_each(|(k, number)| *number = k as f64);
            let copy = numbers.clone();
            assert_eq!((numbers.len(), &*copy), (length, &*numbers));
            assert_eq!((numbers.as_ptr() as usize % LINE_BYTES, copy.as_ptr() as usize % LINE_BYTES), (0, 0));
        }
    }
}
