//! What is examined: cameras, images with their approximate poses, and image measurements by point.

use crate::block::Pose;
use crate::camera::Camera;
use nalgebra::Vector3;

/// An image.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Name.
    pub name: String,
    /// Its camera, in [`Scene::cameras`].
    pub camera: usize,
    /// Its pose, world to camera.
    pub pose: Pose,
}

/// An image measurement of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Its image, in [`Scene::views`].
    pub view: usize,
    /// Measured, px.
    pub xy: [f64; 2],
}

/// Images and the measurements of some points.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// Images.
    pub views: Vec<View>,
    /// Measurements of each point.
    pub points: Vec<Vec<Sight>>,
    /// Where the zero of the coordinates lies in the system of the files, m.
    pub origin: Vector3<f64>,
}

impl Scene {
    /// Camera of a measurement.
    pub fn camera_of(&self, sight: &Sight) -> &Camera {
        &self.cameras[self.views[sight.view].camera]
    }

    /// Length of the sensor's diagonal, px: no error in an image is larger.
    pub fn diagonal(&self, sight: &Sight) -> f64 {
        2.0 * self.camera_of(sight).half_diagonal_px()
    }

    /// All measurements.
    pub fn sights(&self) -> impl Iterator<Item = &Sight> {
        self.points.iter().flatten()
    }

    /// The measurements of one camera alone, of points that it sees twice.
    pub fn of_camera(&self, camera: usize) -> Self {
        let of = |sights: &Vec<Sight>| -> Vec<Sight> {
            sights.iter().filter(|sight| self.views[sight.view].camera == camera).copied().collect()
        };
        let points = self.points.iter().map(of).filter(|sights| sights.len() > 1).collect();
        Self { cameras: self.cameras.clone(), views: self.views.clone(), points, origin: self.origin }
    }
}

/// Which images a mistake concerns.
#[derive(Debug, Clone, Copy)]
pub struct Scope<'a> {
    /// The images.
    pub scene: &'a Scene,
    /// Those of one camera alone; `None`: all.
    pub camera: Option<usize>,
}

impl Scope<'_> {
    /// Cameras concerned, by number.
    pub fn cameras(&self) -> Vec<usize> {
        let used = |camera: &usize| self.scene.views.iter().any(|view| view.camera == *camera);
        (0..self.scene.cameras.len())
            .filter(|camera| self.camera.is_none_or(|one| one == *camera))
            .filter(used)
            .collect()
    }

    /// Names of the images of a camera.
    pub fn images(&self, camera: usize) -> Vec<String> {
        let of = self.scene.views.iter().filter(|view| view.camera == camera);
        of.map(|view| view.name.clone()).collect()
    }

    /// Are these the images of every camera?
    pub fn is_everything(&self) -> bool {
        self.camera.is_none() || self.cameras().len() == self.scene.cameras.len()
    }
}
