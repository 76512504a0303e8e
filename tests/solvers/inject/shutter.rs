//! While the image is taken: rolling shutter, open shutter, vibration, and the trajectory under them.

use crate::inject::fixture::{HEIGHT, distance, inject, pairs, truth};
use misclosure::block::{Block, Pose};
use misclosure::camera::fraser;
use misclosure::inject::Trajectory;
use nalgebra::{UnitQuaternion, Vector3};

fn seen(truth: &Block, pose: &Pose, point: &Vector3<f64>) -> [f64; 2] {
    fraser::project(&truth.cameras[0].interior, pose.cam_from_world(point).into()).unwrap()
}

#[test]
fn each_row_is_exposed_from_where_the_camera_is_then() {
    let truth = truth();
    let readout = 0.03;
    let injected = inject(&truth, &[&format!("rolling-shutter:readout={readout}")]);
    for (image, point, before, after) in pairs(&truth, &injected.block) {
        // Straight and even flight: the camera of the row that was read.
        let mut pose = truth.images[image].pose;
        pose.centre += truth.images[image].velocity.unwrap() * (readout * (after[1] / HEIGHT - 0.5));
        assert!(distance(after, seen(&truth, &pose, &point)) < 1e-8);
        // First order, with the row of the undisturbed point: the rest is (image motion over readout / height) of the
        // shift.
        let mut first_order = truth.images[image].pose;
        first_order.centre += truth.images[image].velocity.unwrap() * (readout * (before[1] / HEIGHT - 0.5));
        let shift = distance(after, before);
        let rest = distance(after, seen(&truth, &first_order, &point));
        assert!(rest < 0.01 * shift + 1e-9, "{rest} of {shift}");
    }
    assert!((4.0..12.0).contains(&injected.report.change_max_px), "{}", injected.report.change_max_px);
    // Read from the bottom, everything is the other way round to first order.
    let reverse = inject(&truth, &[&format!("rolling-shutter:readout={}", -readout)]).block;
    let down: Vec<_> = pairs(&truth, &injected.block);
    for (_, _, before, up) in pairs(&truth, &reverse) {
        if let Some((_, _, _, after)) = down.iter().find(|(_, _, other, _)| *other == before) {
            let sum = [up[0] + after[0] - 2.0 * before[0], up[1] + after[1] - 2.0 * before[1]];
            assert!(sum[0].hypot(sum[1]) < 0.02 * distance(*after, before) + 1e-6);
        }
    }
}

#[test]
fn rows_of_a_turning_camera_are_sheared() {
    // A camera at rest that yaws clockwise as seen from above (its z axis points down): features move the other way
    // across the image.
    let mut truth = truth();
    for image in &mut truth.images {
        image.velocity = Some(Vector3::zeros());
        image.angular_velocity = Some(Vector3::new(0.0, 0.0, 0.2));
    }
    let readout = 0.05;
    let block = inject(&truth, &[&format!("rolling-shutter:readout={readout}")]).block;
    for (image, point, _, after) in pairs(&truth, &block) {
        let angle = 0.2 * readout * (after[1] / HEIGHT - 0.5);
        // Camera axes turned by the angle about z: components of a fixed vector turn back by it.
        let p = truth.images[image].pose.cam_from_world(&point);
        let (sin, cos) = angle.sin_cos();
        let turned = [cos * p.x + sin * p.y, -sin * p.x + cos * p.y, p.z];
        let expected = fraser::project(&truth.cameras[0].interior, turned).unwrap();
        assert!(distance(after, expected) < 1e-8);
    }
}

#[test]
fn centroid_of_the_trail_lies_half_way() {
    let truth = truth();
    let rest = |exposure: f64| {
        let block = inject(&truth, &[&format!("forward-motion:exposure={exposure}")]).block;
        let mut largest = (0.0_f64, 0.0_f64);
        for (image, point, before, after) in pairs(&truth, &block) {
            let mut pose = truth.images[image].pose;
            pose.centre += truth.images[image].velocity.unwrap() * (0.5 * exposure);
            let rest = distance(after, seen(&truth, &pose, &point));
            largest = (largest.0.max(distance(after, before)), largest.1.max(rest));
        }
        largest
    };
    let (shift, rest_1) = rest(0.02);
    let (_, rest_2) = rest(0.04);
    assert!(shift > 3.0, "{shift}");
    // The path across the image bends a little: second order in the exposure.
    assert!(rest_1 < 1e-3 * shift, "{rest_1} of {shift}");
    assert!((3.0..5.0).contains(&(rest_2 / rest_1)), "{}", rest_2 / rest_1);
}

#[test]
fn exposure_times_of_the_images_are_used() {
    let mut truth = truth();
    let given = inject(&truth, &["forward-motion:exposure=0.01"]).block;
    for image in &mut truth.images {
        image.exposure_s = Some(0.01);
    }
    assert_eq!(inject(&truth, &["forward-motion"]).block.ties, given.ties);
}

#[test]
fn velocities_follow_from_times_and_positions() {
    let truth = truth();
    let mut without = truth.clone();
    for image in &mut without.images {
        image.velocity = None;
    }
    let trajectory = Trajectory::new(&without.images);
    for (index, image) in truth.images.iter().enumerate() {
        let derived = trajectory.velocity(index).unwrap();
        assert!((derived - image.velocity.unwrap()).norm() < 1e-12, "{} {derived}", image.name);
    }
    let with = inject(&truth, &["rolling-shutter"]).block.ties;
    for (a, b) in with.iter().zip(inject(&without, &["rolling-shutter"]).block.ties) {
        assert!(distance([a.x, a.y], [b.x, b.y]) < 1e-9);
    }
}

#[test]
fn trajectory_meets_its_images_on_a_curve() {
    // A circle of 50 m at 10 m/s, an image each second.
    let mut images: Vec<_> = truth().images.into_iter().take(8).collect();
    let at = |t: f64| Vector3::new(50.0 * (0.2 * t).cos(), 50.0 * (0.2 * t).sin(), 60.0);
    for (n, image) in images.iter_mut().enumerate() {
        let t = n as f64;
        image.time_s = Some(t);
        image.flight = 0_usize.into();
        image.pose.centre = at(t);
        image.velocity = Some(Vector3::new(-10.0 * (0.2 * t).sin(), 10.0 * (0.2 * t).cos(), 0.0));
    }
    let trajectory = Trajectory::new(&images);
    for dt in [-0.7, -0.1, 0.0, 0.3, 1.0] {
        let error = (trajectory.pose(3, dt).centre - at(3.0 + dt)).norm();
        // Cubic interpolation: fourth derivative 0.08 m/s^4 over 384.
        assert!(error < 2.5e-4, "{dt}: {error}");
    }
    assert_eq!(trajectory.pose(3, 0.0), images[3].pose);
}

#[test]
fn vibration_shakes_the_rows() {
    let truth = truth();
    let angle = 2e-4;
    // Slow against the readout and without motion of rows: each image turns as a whole.
    let still = inject(&truth, &["vibration:frequency=3.7,angle=2e-4,readout=0"]).block;
    for (image, point, before, after) in pairs(&truth, &still) {
        let scale = 5510.0 * angle;
        // sqrt(2) for two axes, 1.6 for the slope of the ray at the corner.
        assert!(distance(before, after) < scale * 2.0_f64.sqrt() * 1.6);
        assert!(distance(after, seen(&truth, &truth.images[image].pose, &point)) > 1e-4 * scale);
    }
    // Read by rows, the same image is bent: compare with a single turn of each image, the mean of its points.
    let rolled = inject(&truth, &["vibration:frequency=80,angle=2e-4,readout=0.02"]);
    let plain = inject(&truth, &["rolling-shutter:readout=0.02"]).block;
    let first: Vec<_> = pairs(&plain, &rolled.block)
        .into_iter()
        .filter(|pair| pair.0 == 0)
        .map(|(_, _, a, b)| (a[1], b[1] - a[1]))
        .collect();
    let mean = first.iter().map(|(_, dy)| dy).sum::<f64>() / first.len() as f64;
    let spread = (first.iter().map(|(_, dy)| (dy - mean).powi(2)).sum::<f64>() / first.len() as f64).sqrt();
    assert!(spread > 0.3 * 5510.0 * angle, "{spread}");
    // 80 Hz over a readout of 0.02 s: the wave repeats after 1/1.6 of the height. What one turn does differs over the
    // image by y^2/f^2 = 0.12 and xy/f^2 = 0.16 of it, twice, and 30 rows are 0.08 of its phase.
    for (row, dy) in &first {
        for (other, dy_other) in &first {
            if (other - row - HEIGHT / 1.6).abs() < 30.0 {
                assert!((dy - dy_other).abs() < 0.5 * 5510.0 * angle, "{row} {other}: {dy} {dy_other}");
            }
        }
    }
}

#[test]
fn rotation_of_the_trajectory_is_the_cameras() {
    let mut images: Vec<_> = truth().images.into_iter().take(1).collect();
    images[0].angular_velocity = Some(Vector3::new(0.1, -0.2, 0.3));
    let pose = Trajectory::new(&images).pose(0, 0.5);
    // World axes of the camera's z axis move with omega x z.
    let before = images[0].pose.rotation.inverse();
    let turn = UnitQuaternion::from_scaled_axis(before * Vector3::new(0.1, -0.2, 0.3) * 0.5);
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        assert!((pose.rotation.inverse() * axis - turn * (before * axis)).norm() < 1e-14);
    }
}
