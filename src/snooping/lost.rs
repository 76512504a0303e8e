//! Points that were left with fewer than two rays, or set aside whole because their rays do not meet, and control
//! points without marks. Such a point takes no part in an adjustment, so that nothing would ever speak for it again;
//! but a blunder elsewhere may have bent the cameras when it was judged, and of rays that do not meet one alone may be
//! wrong. It is judged anew, all its rays at once.

use super::point::SeenPoint;
use super::{FEWEST_RAYS, Rejected, Solved};
use crate::adjust::AdjustError;
use crate::block::{Block, PointId};
use crate::measure::Predictor;
use crate::problem::{MeasurementKind, PointSource};
use nalgebra::Vector3;
use std::collections::HashSet;

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

/// A control point without marks.
pub(super) struct LostControl {
    pub(super) point: PointId,
    /// Where it was surveyed, m.
    pub(super) place: Vector3<f64>,
    /// Weight of its coordinates as stated, m^-2.
    pub(super) weight: Vector3<f64>,
}

/// Control points that the search has lost with all their marks, at their surveyed places.
///
/// They were set aside where the rest of the survey contradicted them; a cause that has entered the model since may
/// have ended that.
pub(super) fn lost_control(
    block: &Block,
    rejected: &[Rejected],
    fit: Solved<'_>,
) -> Result<Vec<LostControl>, AdjustError> {
    let Solved { problem, state } = fit;
    let takes_part: HashSet<PointSource> = problem.point_sources.iter().copied().collect();
    let marks = rejected.iter().filter(|rejected| rejected.kind == MeasurementKind::Mark);
    let mut points: Vec<PointId> = marks.map(|rejected| rejected.point).collect();
    points.sort_unstable();
    points.dedup();
    points.retain(|point| !takes_part.contains(&PointSource::Control(*point)));
    let predictor = Predictor::new(problem, state)?;
    let lost = |point: PointId| {
        let surveyed = &block.surveyed[point.index()];
        // An effect on surveyed coordinates changes little over what it moves them by.
        let moved = predictor.surveyed(&surveyed.position)? - surveyed.position;
        let xy = surveyed.sigma_xy.unwrap_or(block.sigma.control_xy_m);
        let sigma = Vector3::new(xy, xy, surveyed.sigma_z.unwrap_or(block.sigma.control_z_m));
        Some(LostControl { point, place: surveyed.position - moved, weight: sigma.map(|sigma| sigma.powi(-2)) })
    };
    Ok(points.into_iter().filter_map(lost).collect())
}

/// What a point that was lost came to. Measurements are named by their positions among those of the point.
#[derive(Default)]
pub(super) struct Revived {
    /// Number of measurements that came back.
    pub(super) returned: usize,
    /// One that had been kept and does not agree with them, and its residual in standard deviations.
    pub(super) rejected: Vec<(usize, f64)>,
    /// The same of those that stay out.
    pub(super) still_out: Vec<(usize, f64)>,
}

impl SeenPoint {
    /// Takes the rays in again that agree with each other, where the point was lost. `beyond` gives the worst that does
    /// not, and its residual in standard deviations.
    pub(super) fn revive(&mut self, beyond: impl Fn(&Self) -> Option<(usize, f64)>) -> Revived {
        self.seen.iter_mut().for_each(|seen| seen.active = true);
        let mut revived = Revived::default();
        while let Some((worst, normalised)) = beyond(self) {
            let seen = &mut self.seen[worst];
            seen.active = false;
            let of = if seen.was_active { &mut revived.rejected } else { &mut revived.still_out };
            of.push((worst, normalised));
        }
        if self.seen.iter().filter(|seen| seen.active).count() < FEWEST_RAYS {
            self.seen.iter_mut().for_each(|seen| seen.active = seen.was_active);
            return Revived::default();
        }
        revived.returned = self.seen.iter().filter(|seen| seen.active && !seen.was_active).count();
        revived
    }
}
