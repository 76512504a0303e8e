//! The true world behind a block, in the block's order.

use super::Trajectory;
use crate::block::{Block, Gnss, Image, Measurement, Pose, Sigma, SurveyedPoint};
use crate::camera::{Camera, fraser};
use anyhow::{Context, Result, ensure};
use nalgebra::Vector3;
use std::collections::HashMap;

/// What is true: every list runs parallel to the block's, with true values in the place of measured or approximate
/// ones.
pub struct World {
    /// Cameras with their true interior orientation.
    pub cameras: Vec<Camera>,
    /// Names of the flights.
    pub flights: Vec<String>,
    /// Images: true poses, and true antenna positions where the block has GNSS (the projection centre, if the truth has
    /// none).
    pub images: Vec<Image>,
    /// Tie points, m.
    pub tie_points: Vec<Vector3<f64>>,
    /// Names of the tie points.
    pub tie_point_names: Vec<String>,
    /// Surveyed points with their true coordinates.
    pub surveyed: Vec<SurveyedPoint>,
    /// The block's a-priori precision.
    pub sigma: Sigma,
    /// Tie-point measurements of the block: which pairs are measured.
    pub ties: Vec<Measurement>,
    /// Marks of the block.
    pub marks: Vec<Measurement>,
    /// Motion of the platform.
    pub trajectory: Trajectory,
}

impl World {
    /// Aligns the truth with the block by name. Times, temperatures and velocities that the truth does not state are
    /// the block's.
    ///
    /// # Errors
    /// A camera, image or point of the block that the truth does not have, or has without coordinates.
    pub fn new(block: &Block, truth: &Block) -> Result<Self> {
        let cameras = align(&block.cameras, &truth.cameras, |camera| &camera.id, "camera")?;
        let true_images = align(&block.images, &truth.images, |image| &image.name, "image")?;
        let images: Vec<Image> = block
            .images
            .iter()
            .zip(true_images)
            .map(|(image, true_image)| Image {
                pose: true_image.pose,
                gnss: image.gnss.map(|gnss| Gnss {
                    position: true_image.gnss.map_or(true_image.pose.centre, |true_gnss| true_gnss.position),
                    ..gnss
                }),
                time_s: true_image.time_s.or(image.time_s),
                temperature_c: true_image.temperature_c.or(image.temperature_c),
                velocity: true_image.velocity.or(image.velocity),
                angular_velocity: true_image.angular_velocity.or(image.angular_velocity),
                exposure_s: true_image.exposure_s.or(image.exposure_s),
                ..image.clone()
            })
            .collect();
        let tie_points = align(&block.tie_points, &truth.tie_points, |point| &point.name, "tie point")?
            .into_iter()
            .map(|point| point.position.with_context(|| format!("the truth has no coordinates of `{}`", point.name)))
            .collect::<Result<_>>()?;
        let surveyed = block
            .surveyed
            .iter()
            .zip(align(&block.surveyed, &truth.surveyed, |point| &point.name, "surveyed point")?)
            .map(|(point, true_point)| SurveyedPoint { position: true_point.position, ..point.clone() })
            .collect();
        Ok(Self {
            cameras: cameras.into_iter().cloned().collect(),
            flights: block.flights.clone(),
            trajectory: Trajectory::new(&images),
            images,
            tie_points,
            tie_point_names: block.tie_points.iter().map(|point| point.name.clone()).collect(),
            surveyed,
            sigma: block.sigma,
            ties: block.ties.clone(),
            marks: block.marks.clone(),
        })
    }

    /// True camera of an image.
    pub fn camera_of(&self, image: usize) -> &Camera {
        &self.cameras[self.images[image].camera.index()]
    }

    /// Image point of a world point without any error; `None` behind the camera.
    pub fn exact(&self, image: usize, point: &Vector3<f64>) -> Option<[f64; 2]> {
        project(&self.camera_of(image).interior, &self.images[image].pose, point)
    }

    /// Exposure times of all images, s.
    ///
    /// # Errors
    /// An image without a time.
    pub(super) fn times(&self) -> Result<Vec<f64>> {
        let time = |image: &Image| image.time_s.with_context(|| format!("image `{}` has no time", image.name));
        self.images.iter().map(time).collect()
    }

    /// # Errors
    /// A block without any GNSS position.
    pub(super) fn need_gnss(&self) -> Result<()> {
        ensure!(self.images.iter().any(|image| image.gnss.is_some()), "the block has no GNSS positions");
        Ok(())
    }
}

/// The plain camera.
pub(super) fn project(interior: &crate::camera::Interior, pose: &Pose, point: &Vector3<f64>) -> Option<[f64; 2]> {
    fraser::project(interior, pose.cam_from_world(point).into())
}

/// For each element of `ours` the one of `theirs` that has the same name.
fn align<'a, T>(ours: &[T], theirs: &'a [T], name: impl Fn(&T) -> &str, what: &str) -> Result<Vec<&'a T>> {
    let by_name: HashMap<&str, &T> = theirs.iter().map(|element| (name(element), element)).collect();
    ours.iter()
        .map(|element| {
            let found = by_name.get(name(element)).copied();
            found.with_context(|| format!("the truth has no {what} `{}`", name(element)))
        })
        .collect()
}
