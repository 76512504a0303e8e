//! Images without effects: the Fraser camera alone, also for blocks of other programs.

use super::{ImageModel, ProjectedPoint};
use crate::block::{Block, CameraId, ImageId, Pose};
use crate::camera::{Interior, fraser, undistort::viewing_ray};
use nalgebra::{Matrix2x3, Vector3};

/// Fraser cameras and poses.
#[derive(Debug, Clone, PartialEq)]
pub struct PlainModel {
    /// Interior orientation of each camera.
    pub cameras: Vec<Interior>,
    /// Camera of each image.
    pub camera_of: Vec<CameraId>,
    /// Exterior orientation of each image.
    pub poses: Vec<Pose>,
}

impl PlainModel {
    /// The approximate orientation that a block carries.
    pub fn of_block(block: &Block) -> Self {
        Self {
            cameras: block.cameras.iter().map(|camera| camera.interior).collect(),
            camera_of: block.images.iter().map(|image| image.camera).collect(),
            poses: block.images.iter().map(|image| image.pose).collect(),
        }
    }

    fn interior(&self, image: ImageId) -> &Interior {
        &self.cameras[self.camera_of[image.index()].index()]
    }
}

impl ImageModel for PlainModel {
    fn project(&self, image: ImageId, point: &Vector3<f64>) -> Option<ProjectedPoint> {
        let pose = &self.poses[image.index()];
        let camera_point = pose.cam_from_world(point);
        let projection = fraser::project_with_derivatives(self.interior(image), camera_point.into())?;
        let by_camera_point = Matrix2x3::from_fn(|i, j| projection.d_camera_point[i][j]);
        Some((projection.point, by_camera_point * pose.rotation.to_rotation_matrix().matrix()))
    }

    fn surveyed(&self, point: &Vector3<f64>) -> Vector3<f64> {
        *point
    }

    fn centre(&self, image: ImageId) -> Vector3<f64> {
        self.poses[image.index()].centre
    }

    fn ray(&self, image: ImageId, observed: [f64; 2]) -> Option<Vector3<f64>> {
        Some(self.poses[image.index()].rotation.inverse() * viewing_ray(self.interior(image), observed)?)
    }
}
