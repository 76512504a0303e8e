//! Conventions of images, cameras and orientations, and units in the tables.

use super::made::{BLOCKS, block, expect, named};
use misclosure::block::{Block, Measurement};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Rewrites every image measurement; the size of its image stands with it.
fn measurements(block: &mut Block, rewrite: impl Fn([f64; 2], [f64; 2]) -> [f64; 2]) {
    let (images, cameras) = (&block.images, &block.cameras);
    let all = block.ties.iter_mut().chain(&mut block.marks);
    all.for_each(|row: &mut Measurement| {
        let camera = &cameras[images[row.image.index()].camera.index()];
        [row.x, row.y] = rewrite([row.x, row.y], [f64::from(camera.width_px), f64::from(camera.height_px)]);
    });
}

#[test]
fn of_measurements() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let with = |rewrite: &dyn Fn([f64; 2], [f64; 2]) -> [f64; 2]| {
            let mut block = block(preset, seed);
            measurements(&mut block, rewrite);
            named(&block)
        };
        expect(&with(&|[x, y], [_, height]| [x, height - y]), "y-up", "ties", &what);
        expect(&with(&|[x, y], [width, _]| [width - x, y]), "mirrored", "ties", &what);
        expect(&with(&|[x, y], _| [x / 2.0, y / 2.0]), "image-scale", "ties", &what);
    }
}

#[test]
fn of_orientations() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let with = |turn: &dyn Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>| {
            let mut block = block(preset, seed);
            block.images.iter_mut().for_each(|image| image.pose.rotation = turn(image.pose.rotation));
            named(&block)
        };
        expect(&with(&|own| own.inverse()), "inverse-rotation", "images", &what);
        let last = |own: UnitQuaternion<f64>| {
            let [x, y, z, w]: [f64; 4] = own.coords.into();
            UnitQuaternion::new_normalize(Quaternion::new(x, y, z, w))
        };
        expect(&with(&last), "quaternion-order", "images", &what);
        let backwards = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        expect(&with(&|own| backwards * own), "camera-axes", "images", &what);
        let mut exchanged = block(preset, seed);
        exchanged.images.iter_mut().for_each(|image| image.pose.centre.swap_rows(0, 1));
        expect(&named(&exchanged), "position-axes", "images", &what);
    }
}

#[test]
fn of_cameras_and_records() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let with = |change: &dyn Fn(&mut Block)| {
            let mut block = block(preset, seed);
            change(&mut block);
            named(&block)
        };
        let millimetres = |block: &mut Block| block.cameras[0].interior[0] *= 0.0064;
        expect(&with(&millimetres), "focal-unit", "camera", &what);
        let velocities = |by: f64| {
            move |block: &mut Block| {
                block.images.iter_mut().for_each(|image| image.velocity = image.velocity.map(|v| v * by))
            }
        };
        expect(&with(&velocities(3.6)), "velocity-unit", "images", &what);
        expect(&with(&velocities(-1.0)), "velocity-unit", "images", &what);
        let kelvin = |block: &mut Block| {
            block.images.iter_mut().for_each(|image| image.temperature_c = image.temperature_c.map(|own| own + 273.15));
        };
        expect(&with(&kelvin), "temperature-unit", "images", &what);
    }
}
