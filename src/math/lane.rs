//! One number of each of eight measurements that are computed side by side.

use pulp::Simd;
use std::ops::{Deref, DerefMut};

/// Measurements side by side.
pub const LANES: usize = 8;

/// One number of each, in a cache line.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Lane(pub [f64; LANES]);

impl Deref for Lane {
    type Target = [f64; LANES];
    #[inline(always)]
    fn deref(&self) -> &[f64; LANES] {
        &self.0
    }
}

impl DerefMut for Lane {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64; LANES] {
        &mut self.0
    }
}

impl Lane {
    /// The same number for each.
    pub const fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    /// Of so many registers as eight take, number `piece`.
    #[inline(always)]
    pub fn get<S: Simd>(&self, piece: usize) -> S::f64s {
        S::as_simd_f64s(&self.0).0[piece]
    }

    /// Replaces what [`Self::get`] gives.
    #[inline(always)]
    pub fn set<S: Simd>(&mut self, piece: usize, value: S::f64s) {
        S::as_mut_simd_f64s(&mut self.0).0[piece] = value;
    }
}
