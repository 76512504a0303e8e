//! Points intersected from the approximate orientation.

use super::{ImageObservation, PointSource};
use crate::block::Block;
use crate::camera::{Interior, undistort::viewing_ray};
use crate::math::intersect::intersect_rays;
use nalgebra::Vector3;

/// Start coordinates: surveyed, given, or intersected from the approximate orientation where none are given or a camera
/// that measures the point has them behind it; `None` where the rays do not meet.
pub(super) fn start_position(
    block: &Block,
    interiors: &[Interior],
    source: PointSource,
    observations: &[ImageObservation],
) -> Option<Vector3<f64>> {
    match source {
        PointSource::Control(id) => Some(block.surveyed[id.index()].position),
        PointSource::Tie(id) => {
            let given = block.tie_points[id.index()].position;
            let in_front = |point: &Vector3<f64>| is_in_front(block, observations, point);
            given.filter(in_front).or_else(|| intersect(block, interiors, observations))
        }
    }
}

/// Least-squares intersection of the rays of the measurements, in front of every camera.
pub(super) fn intersect(
    block: &Block,
    interiors: &[Interior],
    observations: &[ImageObservation],
) -> Option<Vector3<f64>> {
    let mut origins = Vec::with_capacity(observations.len());
    let mut directions = Vec::with_capacity(observations.len());
    for observation in observations {
        let image = &block.images[observation.image as usize];
        let ray = viewing_ray(&interiors[image.camera.index()], [observation.x, observation.y])?;
        origins.push(image.pose.centre);
        directions.push(image.pose.rotation.inverse() * ray);
    }
    let point = intersect_rays(&origins, &directions)?;
    is_in_front(block, observations, &point).then_some(point)
}

/// Does a point lie in front of every camera that measures it?
fn is_in_front(block: &Block, observations: &[ImageObservation], point: &Vector3<f64>) -> bool {
    observations.iter().all(|row| block.images[row.image as usize].pose.cam_from_world(point).z > 0.0)
}
