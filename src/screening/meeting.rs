//! Where the marks of surveyed points meet at the approximate poses, without any adjustment.

use crate::block::{Block, ByPoint};
use crate::camera::undistort::viewing_ray;
use crate::math::intersect::intersect_rays;
use nalgebra::Vector3;

/// Of each surveyed point the place where its rays meet, m; `None` of one that fewer than two images mark.
pub fn meeting_places(block: &Block) -> Vec<Option<Vector3<f64>>> {
    let by_point = ByPoint::new(&block.marks, block.surveyed.len());
    let place = |point: usize| {
        let ray = |row: usize| {
            let mark = &block.marks[row];
            let pose = &block.images[mark.image.index()].pose;
            let ray = viewing_ray(&block.camera_of(mark.image).interior, [mark.x, mark.y])?;
            Some((pose.centre, pose.rotation.inverse() * ray))
        };
        let (centres, directions): (Vec<_>, Vec<_>) = by_point.of(point.into()).filter_map(ray).unzip();
        intersect_rays(&centres, &directions)
    };
    (0..block.surveyed.len()).map(place).collect()
}
