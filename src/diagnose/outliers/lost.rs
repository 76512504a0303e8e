//! Points that were left with fewer than two rays, or set aside whole because their rays do not meet. Such a point takes no part in an adjustment, so
//! that nothing would ever speak for it again; but a blunder elsewhere may have bent the cameras when it was judged, and of rays that do not meet one
//! alone may be wrong. It is judged anew, all its rays at once.

use super::sight::Sight;
use super::{FEWEST_RAYS, Rejected};
use crate::block::Block;
use crate::problem::MeasurementKind;

/// Tie points that the search has lost, by position in the block, without those that are `barred`.
pub(super) fn lost_points(block: &Block, left: &[bool], rejected: &[Rejected], barred: &[bool]) -> Vec<bool> {
    let mut lost = vec![false; block.tie_points.len()];
    let ties = rejected.iter().filter(|rejected| rejected.kind == MeasurementKind::Tie);
    ties.for_each(|rejected| lost[rejected.point.index()] = !barred[rejected.point.index()]);
    let mut rays = vec![0; block.tie_points.len()];
    block.ties.iter().zip(left).for_each(|(row, left)| rays[row.point.index()] += usize::from(*left));
    lost.iter_mut().zip(rays).for_each(|(lost, rays)| *lost &= rays < FEWEST_RAYS);
    lost
}

/// What a point that was lost came to.
#[derive(Default)]
pub(super) struct Revived {
    /// Measurements that came back.
    pub(super) returned: usize,
    /// One that had been kept and does not agree with them: its position in [`Sight::seen`] and its residual in standard deviations.
    pub(super) rejected: Vec<(usize, f64)>,
    /// The same of those that stay out.
    pub(super) still_out: Vec<(usize, f64)>,
}

impl Sight {
    /// Takes the rays of point `j` in again that agree with each other, where it was lost. `beyond` gives the worst that does not, and its residual in
    /// standard deviations.
    pub(super) fn revive(&mut self, j: usize, beyond: impl Fn(&Self, usize) -> Option<(usize, f64)>) -> Revived {
        let all = self.measurements_of(j);
        let before: Vec<bool> = all.clone().map(|k| self.seen[k].active).collect();
        let was_in = |k: usize| before[k - all.start];
        all.clone().for_each(|k| self.seen[k].active = true);
        let mut revived = Revived::default();
        while let Some((worst, normalised)) = beyond(self, j) {
            self.seen[worst].active = false;
            let of = if was_in(worst) { &mut revived.rejected } else { &mut revived.still_out };
            of.push((worst, normalised));
        }
        if all.clone().filter(|k| self.seen[*k].active).count() < FEWEST_RAYS {
            all.clone().for_each(|k| self.seen[k].active = was_in(k));
            return Revived::default();
        }
        revived.returned = all.clone().filter(|k| self.seen[*k].active && !was_in(*k)).count();
        revived
    }
}
