//! Points intersected from the approximate orientation.

use super::{ImageObservation, PointSource};
use crate::block::Block;
use crate::camera::fraser::project;
use crate::camera::{F, Interior, undistort::viewing_ray};
use crate::math::intersect::intersect_rays;
use nalgebra::Vector3;

/// A measurement farther than this from a point's projection, in focal lengths, is that of another point: so far off,
/// the linearised projection says nothing of the point, and approximate orientations are far better known.
const ANOTHER_POINT: f64 = 0.25;

/// Start coordinates of a point. Surveyed points start at their survey. Tie points start where they are given, and at
/// the intersection of their rays where no coordinates are given, a camera that measures the point has them behind it,
/// or they belong to another point: most measurements lie far from it, as where a false match lost its own track.
/// `None` where no start is found.
pub(super) fn start_position(
    block: &Block,
    interiors: &[Interior],
    source: PointSource,
    observations: &[ImageObservation],
) -> Option<Vector3<f64>> {
    let id = match source {
        PointSource::Control(id) => return Some(block.surveyed[id.index()].position),
        PointSource::Tie(id) => id,
    };
    let far_rows = |point: &Vector3<f64>| far_rows(block, interiors, observations, point);
    let given = block.tie_points[id.index()].position.and_then(|point| Some((point, far_rows(&point)?)));
    match given {
        Some((point, far)) if 2 * far > observations.len() => {
            let fewer = |met: &Vector3<f64>| far_rows(met).is_some_and(|other| other < far);
            intersect(block, interiors, observations).filter(fewer).or(Some(point))
        }
        Some((point, _)) => Some(point),
        None => intersect(block, interiors, observations),
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

/// Measurements that are those of [`ANOTHER_POINT`]; `None` where a camera has the point behind it.
fn far_rows(
    block: &Block,
    interiors: &[Interior],
    observations: &[ImageObservation],
    point: &Vector3<f64>,
) -> Option<usize> {
    let mut far = 0;
    for row in observations {
        let image = &block.images[row.image as usize];
        let interior = &interiors[image.camera.index()];
        let [x, y] = project(interior, image.pose.cam_from_world(point).into())?;
        far += usize::from((x - row.x).hypot(y - row.y) > ANOTHER_POINT * interior[F]);
    }
    Some(far)
}

/// Does a point lie in front of every camera that measures it?
fn is_in_front(block: &Block, observations: &[ImageObservation], point: &Vector3<f64>) -> bool {
    observations.iter().all(|row| block.images[row.image as usize].pose.cam_from_world(point).z > 0.0)
}
