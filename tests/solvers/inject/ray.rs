//! Between the object and the lens.

use crate::inject::fixture::{distance, inject, pairs, plain_interior, truth_with};
use misclosure::block::Block;
use misclosure::camera::fraser;
use nalgebra::Vector3;

/// Where the plain camera sees a point.
fn seen(truth: &Block, image: usize, point: &Vector3<f64>) -> [f64; 2] {
    fraser::project(&plain_interior(), truth.images[image].pose.cam_from_world(point).into()).unwrap()
}

/// World direction of an image point of the plain camera.
fn direction(truth: &Block, image: usize, [x, y]: [f64; 2]) -> Vector3<f64> {
    let ray = Vector3::new((x - 2560.0) / 5500.0, (y - 1920.0) / 5500.0, 1.0).normalize();
    truth.images[image].pose.rotation.inverse() * ray
}

#[test]
fn refraction_of_the_standard_atmosphere() {
    // Near the ground the horizontal displacement is kappa H (1 + tan^2 z) of the offset, with kappa = 1.3e-8 /m.
    let truth = truth_with(plain_interior());
    let block = inject(&truth, &["refraction"]).block;
    let mut checked = 0;
    for (image, point, before, after) in pairs(&truth, &block) {
        let centre = truth.images[image].pose.centre;
        let away = point - centre;
        let tan2 = away.xy().norm_squared() / (away.z * away.z);
        let stretch = 1.3e-8 * -away.z * (1.0 + tan2);
        let apparent = Vector3::new(point.x + stretch * away.x, point.y + stretch * away.y, point.z);
        let expected = distance(seen(&truth, image, &apparent), before);
        if expected > 5e-4 {
            // 1.3e-8 has two digits.
            let ratio = distance(after, before) / expected;
            assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
            assert!(distance(after, seen(&truth, image, &apparent)) < 0.05 * expected, "outwards");
            checked += 1;
        }
    }
    assert!(checked > 500, "{checked}");
}

#[test]
fn refracted_ray_integrated_the_other_way_meets_the_point() {
    // The ray equation d/ds (n dr/ds) = grad n, stepped from the camera in the apparent direction: no layers, no Snell.
    let truth = truth_with(plain_interior());
    let strength = 300.0;
    let block = inject(&truth, &[&format!("refraction:strength={strength}")]).block;
    let n = |z: f64| 1.0 + strength * 2.77e-4 * (-z / 10_400.0).exp();
    let mut bent = 0.0_f64;
    for (image, point, before, after) in pairs(&truth, &block).into_iter().step_by(97) {
        let mut position = truth.images[image].pose.centre;
        let mut momentum = direction(&truth, image, after) * n(position.z);
        let steps = 2000;
        let dz = (point.z - position.z) / f64::from(steps);
        for _ in 0..steps {
            // Midpoint rule with the height as the independent variable: ds = n dz / momentum_z.
            let rate = |position: Vector3<f64>, momentum: Vector3<f64>| {
                let index = n(position.z);
                let slope = -(index - 1.0) / 10_400.0;
                (momentum / momentum.z, Vector3::new(0.0, 0.0, slope * index / momentum.z))
            };
            let (v, g) = rate(position, momentum);
            let (v, g) = rate(position + v * (0.5 * dz), momentum + g * (0.5 * dz));
            position += v * dz;
            momentum += g * dz;
        }
        let straight = distance(after, before);
        bent = bent.max(straight);
        let miss_px = (position - point).norm() / (truth.images[image].pose.centre.z - point.z) * 5500.0;
        // Layers of finite thickness: error far below the bending itself.
        assert!(miss_px < 1e-4 + 1e-3 * straight, "{miss_px} of {straight}");
    }
    assert!(bent > 0.5, "{bent}");
}

#[test]
fn window_shifts_rays_sideways() {
    let truth = truth_with(plain_interior());
    let (thickness, index) = (0.02_f64, 1.5_f64);
    let block = inject(&truth, &["flat-port:thickness=0.02,index=1.5"]).block;
    for (image, point, before, after) in pairs(&truth, &block) {
        // The lateral shift of a plane-parallel plate for the angle of incidence that was seen.
        let d = direction(&truth, image, after);
        let cos_a = (truth.images[image].pose.rotation * d).z;
        let sin_a = (1.0 - cos_a * cos_a).sqrt();
        let cos_b = (1.0 - (sin_a / index).powi(2)).sqrt();
        let expected = thickness * sin_a * (1.0 - cos_a / (index * cos_b));
        let away = point - truth.images[image].pose.centre;
        let lateral = (away - d * away.dot(&d)).norm();
        assert!((lateral - expected).abs() < 1e-11, "{lateral} {expected}");
        let centre = [2560.0, 1920.0];
        assert!(distance(after, centre) >= distance(before, centre), "outwards, as through thicker air");
    }
    // The place of the window does not matter.
    let elsewhere = inject(&truth, &["flat-port:thickness=0.02,index=1.5,distance=1.5"]).block;
    for (_, _, a, b) in pairs(&block, &elsewhere) {
        assert!(distance(a, b) < 1e-9);
    }
}
