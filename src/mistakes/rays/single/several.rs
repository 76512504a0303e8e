//! Two cameras under one name, by the shifts of their images' measurements. Few such images are cropped.

use super::super::scene::Scene;
use super::shifted::Shifted;
use crate::mistakes::Mistake;
use crate::mistakes::several_cameras::{Images, Own, POINTS_APART_PX, judge};

/// Images with a second principal point under the name of one camera.
pub fn cameras(scene: &Scene, shifted: &[Shifted<'_>], alpha: f64) -> Vec<Mistake> {
    let of_camera = |camera: usize| -> Option<Mistake> {
        let is_own = |s: &&Shifted<'_>| scene.views[s.view].camera == camera && s.worst_sigma() < POINTS_APART_PX;
        let own: Vec<&Shifted<'_>> = shifted.iter().filter(is_own).collect();
        let images = Images {
            camera: &scene.cameras[camera].id,
            cameras: scene.cameras.iter().map(|camera| camera.id.as_str()).collect(),
            names: own.iter().map(|shifted| scene.views[shifted.view].name.as_str()).collect(),
            values: own.iter().map(|shifted| shifted.shift).collect(),
            covariances: own.iter().map(|shifted| shifted.covariance).collect(),
            flights: Vec::new(),
            are_all: own.len() == scene.views.iter().filter(|view| view.camera == camera).count(),
        };
        judge(&images, Own::PrincipalPoint, alpha)
    };
    (0..scene.cameras.len()).filter_map(of_camera).collect()
}
