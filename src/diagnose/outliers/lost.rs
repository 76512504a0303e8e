//! Points that data snooping left with fewer than two rays. Such a point takes no part in an adjustment, so that nothing would ever speak for it
//! again; but a blunder elsewhere may have bent the cameras when it was judged. It is judged anew, all its rays at once.

use super::sight::Sight;
use super::{FEWEST_RAYS, Rejected};
use crate::block::{Block, Measurement};
use crate::camera::undistort::viewing_ray;
use crate::math::intersect::{ImagePoint, intersect_in_images, intersect_rays};
use crate::measure::Predictor;
use crate::problem::{MeasurementKind, State};
use nalgebra::Vector3;

/// Tie points that the search has lost, by position in the block. Those whose rays do not meet at the block's approximations are none of them:
/// no adjustment could start with them.
pub(super) fn lost_by_snooping(block: &Block, left: &[bool], rejected: &[Rejected]) -> Vec<bool> {
    let mut lost = vec![false; block.tie_points.len()];
    let ties = || rejected.iter().filter(|rejected| rejected.kind == MeasurementKind::Tie);
    ties().for_each(|rejected| lost[rejected.point.index()] = true);
    ties().filter(|rejected| rejected.normalised.is_infinite()).for_each(|r| lost[r.point.index()] = false);
    let mut rays = vec![0; block.tie_points.len()];
    block.ties.iter().zip(left).for_each(|(row, left)| rays[row.point.index()] += usize::from(*left));
    lost.iter_mut().zip(rays).for_each(|(lost, rays)| *lost &= rays < FEWEST_RAYS);
    lost
}

/// Where the rays of all `rows` meet at a solution; `None` where they do not, or an image does not see the place.
pub(super) fn meeting(
    block: &Block,
    state: &State,
    predictor: &Predictor<'_>,
    rows: &[&Measurement],
) -> Option<Vector3<f64>> {
    let (mut origins, mut directions) = (Vec::with_capacity(rows.len()), Vec::with_capacity(rows.len()));
    for row in rows {
        let pose = &state.poses[row.image.index()];
        let interior = &state.interiors[block.images[row.image.index()].camera.index()];
        origins.push(pose.centre);
        directions.push(pose.rotation.inverse() * viewing_ray(interior, [row.x, row.y])?);
    }
    // Straight rays to begin with, then as the model has them.
    let start = intersect_rays(&origins, &directions)?;
    let sigma = |row: &Measurement| row.sigma.unwrap_or(block.sigma.tie_px);
    let measured: Vec<ImagePoint> =
        rows.iter().map(|row| ImagePoint { xy: [row.x, row.y], sigma: sigma(row) }).collect();
    let project = |k: usize, point: &Vector3<f64>| predictor.image_point(rows[k].image.index(), measured[k].xy, point);
    Some(intersect_in_images(&measured, start, project).ok()?.position)
}

/// What a point that was lost came to.
#[derive(Default)]
pub(super) struct Revived {
    /// Measurements that came back.
    pub(super) returned: usize,
    /// One that had been kept and does not agree with them: its position in [`Sight::seen`] and its residual in standard deviations.
    pub(super) rejected: Vec<(usize, f64)>,
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
            if was_in(worst) {
                revived.rejected.push((worst, normalised));
            }
        }
        if all.clone().filter(|k| self.seen[*k].active).count() < FEWEST_RAYS {
            all.clone().for_each(|k| self.seen[k].active = was_in(k));
            return Revived::default();
        }
        revived.returned = all.clone().filter(|k| self.seen[*k].active && !was_in(*k)).count();
        revived
    }
}
