//! A block whose tie points all have coordinates, as other programs ask for.

use super::Note;
use crate::block::{Block, Measurement, PointId, TiePoint};
use crate::camera::fraser::project;
use crate::camera::undistort::viewing_ray;
use crate::math::intersect::intersect_rays;
use nalgebra::Vector3;

/// A block with coordinates of every tie point.
pub struct Positioned {
    /// The block, without the points that have none.
    pub block: Block,
    /// By tie point: mean distance of measured and predicted image points, px.
    pub errors: Vec<f64>,
}

impl Positioned {
    /// Intersects what has no coordinates; a point whose rays do not meet in front of its images is left out, which is
    /// said.
    pub fn of(block: &Block, notes: &mut Vec<Note>) -> Self {
        let mut rays = vec![(Vec::new(), Vec::new()); block.tie_points.len()];
        for tie in block.ties.iter().filter(|tie| block.tie_points[tie.point.index()].position.is_none()) {
            let pose = &block.images[tie.image.index()].pose;
            if let Some(ray) = viewing_ray(&block.camera_of(tie.image).interior, [tie.x, tie.y]) {
                let (origins, directions) = &mut rays[tie.point.index()];
                origins.push(pose.centre);
                directions.push(pose.rotation.inverse() * ray);
            }
        }
        let known = block.tie_points.iter().zip(&rays);
        let positions: Vec<Option<Vector3<f64>>> = known
            .map(|(point, (origins, directions))| point.position.or_else(|| intersect_rays(origins, directions)))
            .collect();
        let mut distances = vec![Some((0.0, 0)); positions.len()];
        for tie in &block.ties {
            let point = tie.point.index();
            let seen = positions[point].map(|point| block.images[tie.image.index()].pose.cam_from_world(&point));
            let predicted = seen.and_then(|seen| project(&block.camera_of(tie.image).interior, seen.into()));
            distances[point] = distances[point]
                .zip(predicted)
                .map(|((sum, count), [x, y])| (sum + (tie.x - x).hypot(tie.y - y), count + 1));
        }
        let (mut tie_points, mut errors) = (Vec::new(), Vec::new());
        let mut numbers = vec![None; positions.len()];
        for (k, distance) in distances.iter().enumerate() {
            if let Some((sum, count)) = distance.filter(|(_, count)| *count > 0) {
                numbers[k] = Some(PointId::from(tie_points.len()));
                tie_points.push(TiePoint { position: positions[k], ..block.tie_points[k].clone() });
                errors.push(sum / f64::from(count));
            }
        }
        let kept = |tie: &Measurement| numbers[tie.point.index()].map(|point| Measurement { point, ..*tie });
        let ties = block.ties.iter().filter_map(kept).collect();
        let lost = positions.len() - errors.len();
        if lost > 0 {
            notes.push(Note::loss(format!(
                "{lost} tie points are left out: their rays do not meet in front of all images"
            )));
        }
        Self { block: Block { tie_points, ties, ..block.clone() }, errors }
    }
}
