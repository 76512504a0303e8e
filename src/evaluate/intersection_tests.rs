use super::*;
use crate::block::{CameraId, Pose};
use crate::evaluate::PlainModel;
use approx::assert_relative_eq;
use nalgebra::UnitQuaternion;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// The study's camera with distortion of some 100 px in the corners.
const CAMERA: [f64; 12] =
    [5510.09, 2539.75, 1945.80, 2537.97, 1955.92, 3.0e-9, -1.0e-16, 1.0e-24, 2.0e-7, -1.0e-7, 1.0e-4, -5.0e-5];

/// Camera axes of an image that looks straight down, x east.
fn nadir() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&nalgebra::Vector3::x_axis(), std::f64::consts::PI)
}

fn model(interior: [f64; 12], poses: Vec<Pose>) -> PlainModel {
    PlainModel { cameras: vec![interior], camera_of: vec![CameraId(0); poses.len()], poses }
}

/// Six images over the origin at two heights, some tilted.
fn six_images() -> PlainModel {
    let pose = |i: u32| {
        let i = f64::from(i);
        let tilt = UnitQuaternion::from_euler_angles(0.05 * i - 0.1, 0.2 - 0.07 * i, 0.3 * i);
        Pose {
            rotation: tilt * nadir(),
            centre: Vector3::new(8.0 * i - 20.0, 3.0 * (i % 2.0), 50.0 + 10.0 * (i % 3.0)),
        }
    };
    model(CAMERA, (0..6).map(pose).collect())
}

fn observations(model: &PlainModel, point: &Vector3<f64>) -> Vec<Observation> {
    (0..model.poses.len())
        .map(|i| {
            let image = ImageId::from(i);
            let xy = model.project(image, point).unwrap().0;
            Observation { image, xy, sigma: 0.2 + 0.1 * i as f64 }
        })
        .collect()
}

#[test]
fn exact_measurements_meet_in_the_point() {
    let model = six_images();
    for point in [Vector3::new(0.0, 0.0, 0.0), Vector3::new(5.0, -8.0, 3.0), Vector3::new(-6.0, 4.0, -2.0)] {
        let observations = observations(&model, &point);
        for method in [Method::Image, Method::Rays] {
            let Intersected { position: found, residuals, .. } =
                intersect_point(&model, &observations, method).unwrap();
            // 1e-11 px of the inverse distortion at 0.01 m/px, some roundings of 50 m.
            assert_relative_eq!(found, point, epsilon = 1e-11);
            assert!(residuals.iter().all(|v| v.norm() < 1e-8));
        }
    }
}

#[test]
fn precision_of_the_normal_case_of_stereo() {
    // Two nadir images, base b, height h: sigma_z = h^2 / (b f) sqrt(2) sigma; sigma_x at the middle: h / f sigma /
    // sqrt(2).
    let (b, h, sigma) = (20.0, 60.0, 0.4);
    let mut plain = [0.0; 12];
    plain[0] = 5000.0;
    let at = |x: f64| Pose { rotation: nadir(), centre: Vector3::new(x, 0.0, h) };
    let model = model(plain, vec![at(-0.5 * b), at(0.5 * b)]);
    let mut observations = observations(&model, &Vector3::zeros());
    observations.iter_mut().for_each(|o| o.sigma = sigma);
    for method in [Method::Image, Method::Rays] {
        let Intersected { covariance, .. } = intersect_point(&model, &observations, method).unwrap();
        assert_relative_eq!(covariance[(2, 2)].sqrt(), h * h / (b * 5000.0) * 2f64.sqrt() * sigma, max_relative = 1e-9);
        assert_relative_eq!(covariance[(0, 0)].sqrt(), h / 5000.0 * sigma / 2f64.sqrt(), max_relative = 1e-9);
        assert_relative_eq!(covariance[(1, 1)].sqrt(), h / 5000.0 * sigma / 2f64.sqrt(), max_relative = 1e-9);
    }
}

#[test]
fn covariance_matches_monte_carlo() {
    let model = six_images();
    let point = Vector3::new(4.0, -3.0, 1.0);
    let exact = observations(&model, &point);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let trials = 3000;
    for method in [Method::Image, Method::Rays] {
        let Intersected { covariance, .. } = intersect_point(&model, &exact, method).unwrap();
        let mut found = Matrix3::zeros();
        for _ in 0..trials {
            let mut noisy = exact.clone();
            for o in &mut noisy {
                let sigma = o.sigma;
                o.xy = o.xy.map(|x| x + sigma * rng.sample::<f64, _>(StandardNormal));
            }
            let error = intersect_point(&model, &noisy, method).unwrap().position - point;
            found += error * error.transpose() / f64::from(trials);
        }
        let tolerance = 4.0 * (2.0 / f64::from(trials)).sqrt();
        for i in 0..3 {
            for j in 0..3 {
                let unit = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
                assert_relative_eq!(found[(i, j)] / unit, covariance[(i, j)] / unit, epsilon = tolerance);
            }
        }
    }
}

#[test]
fn image_method_is_the_minimum_of_the_weighted_residuals() {
    let model = six_images();
    let mut noisy = observations(&model, &Vector3::new(4.0, -3.0, 1.0));
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    // Large errors: far from the linear.
    noisy.iter_mut().for_each(|o| o.xy = o.xy.map(|x| x + 40.0 * (rng.random::<f64>() - 0.5)));
    let cost = |p: &Vector3<f64>| -> f64 {
        let of = |o: &Observation| {
            let xy = model.project(o.image, p).unwrap().0;
            ((xy[0] - o.xy[0]).powi(2) + (xy[1] - o.xy[1]).powi(2)) / (o.sigma * o.sigma)
        };
        noisy.iter().map(of).sum()
    };
    let Intersected { position: found, residuals, .. } = intersect_point(&model, &noisy, Method::Image).unwrap();
    let rays = intersect_point(&model, &noisy, Method::Rays).unwrap().position;
    assert!(cost(&found) < cost(&rays));
    let sum: f64 = residuals.iter().zip(&noisy).map(|(v, o)| v.norm_squared() / (o.sigma * o.sigma)).sum();
    assert_relative_eq!(sum, cost(&found), max_relative = 1e-12);
    for axis in 0..3 {
        for step in [-1e-4, 1e-4] {
            let mut near = found;
            near[axis] += step;
            assert!(cost(&near) > cost(&found));
        }
    }
}

/// Residuals of half a pixel and sigma as large: the last steps lower the cost by less than its rounding. With an
/// allowance for rounding that ignored the size of the residuals, 5 of these 40 000 points counted as diverged.
#[test]
fn rounding_of_the_cost_is_no_divergence() {
    let model = six_images();
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    for _ in 0..40_000 {
        let place = Vector3::from_fn(|_, _| 10.0 * (rng.random::<f64>() - 0.5));
        let mut noisy = observations(&model, &place);
        for o in &mut noisy {
            (o.xy, o.sigma) = (o.xy.map(|x| x + 0.5 * (rng.random::<f64>() - 0.5)), 0.5);
        }
        let Intersected { iterations, .. } = intersect_point(&model, &noisy, Method::Image).unwrap();
        assert!(iterations <= 5, "{iterations} iterations");
    }
}

#[test]
fn failures_are_named() {
    let model = six_images();
    let exact = observations(&model, &Vector3::zeros());
    let fail = |observations: &[Observation]| intersect_point(&model, observations, Method::Image).unwrap_err();
    assert_eq!(fail(&[]), Failure::TooFewMarks(0));
    assert_eq!(fail(&exact[..1]), Failure::TooFewMarks(1));
    assert_eq!(fail(&[exact[2], exact[2]]), Failure::Parallel);
    // Beyond the fold of a strong barrel distortion there is no ray.
    let mut folded = six_images();
    folded.cameras[0][5] = -1.0e-7;
    assert_eq!(intersect_point(&folded, &corners(), Method::Image).unwrap_err(), Failure::NoRay);
    // Rays that diverge meet behind the images.
    let at = |x: f64| Pose { rotation: nadir(), centre: Vector3::new(x, 0.0, 10.0) };
    let pair = self::model(CAMERA, vec![at(-5.0), at(5.0)]);
    let apart: Vec<_> = [1000.0, 4000.0]
        .iter()
        .enumerate()
        .map(|(i, &x)| Observation { image: ImageId::from(i), xy: [x, 1900.0], sigma: 1.0 })
        .collect();
    assert_eq!(intersect_point(&pair, &apart, Method::Image).unwrap_err(), Failure::Behind);
    assert_eq!(intersect_point(&pair, &apart, Method::Rays).unwrap_err(), Failure::Behind);
}

fn corners() -> Vec<Observation> {
    (0..3).map(|i| Observation { image: ImageId(i), xy: [10.0, 10.0], sigma: 1.0 }).collect()
}

#[test]
fn every_point_is_accounted_for_whatever_the_threads() {
    let model = six_images();
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut measurements = Vec::new();
    for point in 0..200u32 {
        let place = Vector3::from_fn(|_, _| 10.0 * (rng.random::<f64>() - 0.5));
        // Points 0, 7, 14 ... have one measurement, point 5 none.
        let images = if point == 5 {
            0
        } else if point % 7 == 0 {
            1
        } else {
            2 + point as usize % 5
        };
        for o in &observations(&model, &place)[..images] {
            let [x, y] = o.xy.map(|x| x + 0.3 * rng.sample::<f64, _>(StandardNormal));
            measurements.push(Measurement { image: o.image, point: PointId(point), x, y, sigma: None });
        }
    }
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| intersect_all(&model, &measurements, 200, 0.3, Method::Image))
    };
    let one = run(1);
    assert_eq!(one, run(4));
    assert_eq!(one.points.len() + one.failed.len(), 200);
    assert_eq!(one.failed.len(), 30);
    assert_eq!(one.failed[1], FailedIntersection { point: PointId(5), reason: Failure::TooFewMarks(0) });
    let used: usize = one.points.iter().map(|p| p.measurements.len()).sum();
    assert_eq!(used, measurements.len() - 29);
    assert!(one.points.iter().all(|p| p.measurements.iter().all(|&m| measurements[m].point == p.point)));
}
