//! A small block for tests: three strips above rolling ground, with tilts of some degrees and noise of a third of a
//! pixel that repeats.

use super::scene::{Scene, Sight, View};
use crate::block::Pose;
use crate::camera::{Camera, fraser};
use nalgebra::{UnitQuaternion, Vector3};

/// A lens with distortion; its principal point lies beside the centre of the sensor.
pub fn camera() -> Camera {
    Camera {
        id: "cam".into(),
        width_px: 4000,
        height_px: 3000,
        pixel_um: Some(4.0),
        interior: [3000.0, 2010.0, 1490.0, 2010.0, 1490.0, -1e-8, 1e-16, 0.0, 1e-7, -1e-7, 0.0, 0.0],
    }
}

/// Images at 60 m height.
pub fn views() -> Vec<View> {
    let mut views = Vec::new();
    for strip in 0..3 {
        for along in 0..6 {
            let k = f64::from(6 * strip + along);
            // Looks down, y of the image to the south; every other strip turns back; tilts of up to six degrees.
            let down = UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI);
            let heading = if strip % 2 == 0 { 0.1 } else { std::f64::consts::PI - 0.2 };
            let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * (heading + 0.05 * (1.3 * k).sin()));
            let tilt = Vector3::new((2.1 * k).sin(), (3.7 * k).cos(), 0.0) * 0.1;
            let rotation = UnitQuaternion::from_scaled_axis(tilt) * turn * down;
            let wave = Vector3::new((1.7 * k).cos(), (2.9 * k).sin(), 3.0 * (4.1 * k).sin());
            let centre = Vector3::new(15.0 * f64::from(along), 20.0 * f64::from(strip), 60.0) + wave;
            views.push(View { name: format!("i{k}"), camera: 0, pose: Pose { rotation, centre } });
        }
    }
    views
}

/// Points on the ground.
pub fn ground() -> Vec<Vector3<f64>> {
    (0..240)
        .map(|k| {
            let k = f64::from(k);
            let (x, y) = ((37.0 * k) % 115.0 - 20.0, (53.3 * k) % 80.0 - 20.0);
            Vector3::new(x, y, 5.0 * (0.11 * x).sin() * (0.07 * y).cos())
        })
        .collect()
}

/// Measurements of all points that at least three images see.
pub fn scene() -> Scene {
    let (camera, views) = (camera(), views());
    let mut points = Vec::new();
    for (p, place) in ground().iter().enumerate() {
        let mut sights = Vec::new();
        for (v, view) in views.iter().enumerate() {
            let Some([x, y]) = fraser::project(&camera.interior, view.pose.cam_from_world(place).into()) else {
                continue;
            };
            if (0.0..4000.0).contains(&x) && (0.0..3000.0).contains(&y) {
                let k = (31 * p + 7 * v) as f64;
                sights.push(Sight { view: v, xy: [x + 0.3 * (1.1 * k).sin(), y + 0.3 * (2.3 * k).cos()] });
            }
        }
        points.extend((sights.len() >= 3).then_some(sights));
    }
    Scene { cameras: vec![camera], views, points, origin: Vector3::new(1000.0, 2000.0, 0.0) }
}

/// The same with poses that are off by some degrees and metres.
pub fn approximate(degrees: f64, metres: f64) -> Scene {
    let mut scene = scene();
    for (k, view) in scene.views.iter_mut().enumerate() {
        let k = k as f64;
        let turn = Vector3::new((5.1 * k).sin(), (7.3 * k).cos(), (2.7 * k).sin()) * degrees.to_radians();
        view.pose.rotation = UnitQuaternion::from_scaled_axis(turn) * view.pose.rotation;
        view.pose.centre += Vector3::new((3.3 * k).cos(), (6.1 * k).sin(), (1.9 * k).cos()) * metres;
    }
    scene
}
