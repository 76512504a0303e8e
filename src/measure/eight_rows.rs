//! Derivatives of eight measurements: all at once, or those of one.

use super::lanes::THETA;
use super::through::Derivatives;
use crate::math::Wide;
use crate::math::lane::Lane;
use pulp::Simd;

/// Derivatives of eight measurements.
pub(super) struct Rows<'a, S> {
    simd: S,
    rows: [&'a mut [Lane]; 2],
}

impl<'a, S: Simd> Rows<'a, S> {
    #[inline(always)]
    pub(super) fn new(simd: S, rows: &'a mut [Vec<Lane>; 2]) -> Self {
        let rows = rows.each_mut().map(|row| row.as_mut_slice());
        // Asked once, not at each of the many places below it.
        assert!(rows[0].len() >= THETA && rows[1].len() >= THETA);
        Self { simd, rows }
    }
}

impl<S: Simd> Derivatives for Rows<'_, S> {
    type Number = Wide<S>;

    #[inline(always)]
    fn get(&self, i: usize, place: usize) -> Wide<S> {
        Wide { simd: self.simd, lane: self.rows[i][place] }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, place: usize, value: Wide<S>) {
        self.rows[i][place] = value.lane;
    }
}

/// One measurement of eight.
pub(super) struct One<'a> {
    pub(super) lane: usize,
    pub(super) rows: &'a mut [Vec<Lane>; 2],
}

impl Derivatives for One<'_> {
    type Number = f64;

    #[inline(always)]
    fn get(&self, i: usize, place: usize) -> f64 {
        self.rows[i][place][self.lane]
    }

    #[inline(always)]
    fn set(&mut self, i: usize, place: usize, value: f64) {
        self.rows[i][place][self.lane] = value;
    }
}
