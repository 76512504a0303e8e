//! The place of a measurement, where the chain ends, for effects that read it.
//!
//! A row is exposed at the pose of its own instant, and that pose decides in which row a point appears: `p = h(p, u)`,
//! `h` the chain at a given place, `u` everything else. The place is found from what the chain says without looking at
//! the measurement: with the measured one, whose noise is that of the residual, an effect would be found in noise. With
//! `D = dh/dp` all derivatives follow from those at a held place:
//!
//! ```text
//! p = s + (I - D)^-1 (h(s, u) - s)        dp/du = (I - D)^-1 dh/du
//! ```
//!
//! The first is a step of Newton's from a place `s` near `p`. One text for one measurement and for several.

use super::frame::Stages;
use super::lanes::{CAMERA, MISCLOSURE, THETA};
use super::through::Derivatives;
use crate::math::{Number, Several};

/// A place this near, px, is one step from the end. What the chain does bends over hundreds of pixels or more, so that
/// the step is exact to rounding, and so are derivatives, relative to which this is below 1e-9.
const NEAR_PX: f64 = 1e-7;
/// Answers by values alone before derivatives are asked for, which cost several times as much: from the second on the
/// slope along the last move is known.
pub(super) const ANSWERS_AHEAD: usize = 2;
/// Where column and row are read, values alone tell the slope along their last move only, and come this near, px.
const NEAR_BY_VALUES_PX: f64 = 1e-10;
/// Moves, px, below which their quotient is rounding.
const LEAST_MOVE_PX: f64 = 1e-6;
/// Moves until a place is given up. Each gains the change of the effect from pixel to pixel, a hundredth or less for
/// anything that a sensor does.
pub(super) const MOST_MOVES: usize = 60;

/// Is the place `at`, of which the chain makes `end`, near enough for the last step?
#[inline(always)]
pub(super) fn is_near(stages: &Stages, at: [f64; 2], end: [f64; 2]) -> bool {
    stages.place_axes.iter().all(|axis| (end[*axis] - at[*axis]).abs() <= NEAR_PX)
}

/// From derivatives at the held place `at`, where the chain ends at `end`, to those of the end that is its own place,
/// which it gives. `Err`: the first measurement that several rows (or none) would see.
#[inline(always)]
pub(super) fn follow_place<D: Derivatives>(
    d: &mut D,
    stages: &Stages,
    at: &[D::Number; 2],
    end: &[D::Number; 2],
) -> Result<[D::Number; 2], usize> {
    let seed = at[0];
    let (zero, one) = (seed.like(0.0), seed.like(1.0));
    let mut by_place = [[zero; 2]; 2];
    for (n, axis) in stages.place_axes.iter().enumerate() {
        for i in 0..2 {
            by_place[i][*axis] = d.get(i, THETA + stages.local_len + n);
        }
    }
    let [[a, b], [c, e]] = by_place;
    let determinant = (one - a) * (one - e) - b * c;
    <D::Number as Several>::not_positive(&determinant.keep()).map_or(Ok(()), Err)?;
    let inverse = [[(one - e) / determinant, b / determinant], [c / determinant, (one - a) / determinant]];
    if !(a.abs() + b.abs() + c.abs() + e.abs()).is_zero() {
        for place in (CAMERA..MISCLOSURE).chain(THETA..THETA + stages.local_len) {
            let (x, y) = (d.get(0, place), d.get(1, place));
            for i in 0..2 {
                d.set(i, place, inverse[i][0] * x + inverse[i][1] * y);
            }
        }
    }
    // An axis that is not read has no place to be off from.
    let mut off = [zero; 2];
    for axis in &stages.place_axes {
        off[*axis] = end[*axis] - at[*axis];
    }
    let mut own = *end;
    for i in 0..2 {
        own[i] = end[i] + (inverse[i][0] * off[0] + inverse[i][1] * off[1] - off[i]);
    }
    Ok(own)
}

/// The search by values alone.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search {
    /// The place that is asked about.
    pub at: [f64; 2],
    before: Option<([f64; 2], [f64; 2])>,
    /// The end that is its own place, once it is found.
    pub found: Option<[f64; 2]>,
}

impl Search {
    /// The best place so far.
    pub fn place(&self) -> [f64; 2] {
        self.found.unwrap_or(self.at)
    }

    /// Begins at a place.
    pub fn from(at: [f64; 2]) -> Self {
        Self { at, before: None, found: None }
    }

    /// Takes note that the chain ends at `end` from where it was asked. Then it is found, or asked about anew.
    pub fn tell(&mut self, stages: &Stages, end: [f64; 2]) {
        if self.found.is_some() {
            return;
        }
        let along = |a: [f64; 2], b: [f64; 2]| -> f64 { stages.place_axes.iter().map(|k| a[*k] * b[*k]).sum() };
        let minus = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        let off = minus(end, self.at);
        let mut own = end;
        if let Some((at, end_before)) = self.before {
            // The slope along the last move, as that of the whole.
            let (moved, answered) = (minus(self.at, at), minus(end, end_before));
            let square = along(moved, moved);
            if square > LEAST_MOVE_PX * LEAST_MOVE_PX {
                let share = along(moved, off) / (square - along(moved, answered));
                own = [end[0] + answered[0] * share, end[1] + answered[1] * share];
            }
        }
        let near = if stages.place_axes.len() == 1 { NEAR_PX } else { NEAR_BY_VALUES_PX };
        // The first answer has nothing to be compared with.
        if self.before.is_some() && along(off, off) <= near * near {
            self.found = Some(own);
        } else {
            self.before = Some((self.at, end));
            self.at = own;
        }
    }
}
