use super::*;
use crate::math::statistics::kolmogorov_smirnov;
use approx::assert_relative_eq;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Points along a north-south dike of 200 m, 12 m wide.
fn dike(n: usize, rng: &mut ChaCha8Rng) -> Vec<Vector3<f64>> {
    (0..n)
        .map(|i| Vector3::new(12.0 * rng.random::<f64>(), 200.0 * i as f64 / (n - 1) as f64, 5.0 * rng.random::<f64>()))
        .collect()
}

fn turned(points: &[Vector3<f64>], angle: f64) -> Vec<Vector3<f64>> {
    let (sin, cos) = angle.sin_cos();
    points.iter().map(|p| Vector3::new(7e5 + cos * p.x - sin * p.y, 6e6 + sin * p.x + cos * p.y, p.z)).collect()
}

#[test]
fn a_bowl_along_the_dike_is_measured() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let points = dike(500, &mut rng);
    // Ends 3 mm up against the middle, on a tilt, with 1 mm of noise.
    let noise: Vec<f64> = points.iter().map(|_| 0.001 * rng.sample::<f64, _>(StandardNormal)).collect();
    let bend = |y: f64| 0.003 * ((y - 100.0) / 100.0).powi(2) + 1e-4 * y;
    for angle in [0.0, 0.5, -1.2, 2.0] {
        let heights: Vec<_> = points.iter().zip(&noise).map(|(p, e)| bend(p.y) + e).collect();
        let bowl = fit(&turned(&points, angle), &heights, BowlShape::Corridor).unwrap();
        let tolerance = 4.0 * bowl.sigma_per_m * 1e4;
        assert!(tolerance < 6e-4);
        assert_relative_eq!(bowl.height_m, 0.003, epsilon = tolerance);
        assert!(bowl.coefficient_per_m > 0.0 && bowl.p_value < 1e-6);
        // The principal axis is that of the points, which is the dike's to within its width.
        let along = [-angle.sin(), angle.cos()];
        assert!((bowl.axis[0] * along[1] - bowl.axis[1] * along[0]).abs() < 0.01);
        assert_relative_eq!(bowl.extent_m, 200.0, epsilon = 1.0);
        let dome = fit(&points, &heights.iter().map(|dz| -dz).collect::<Vec<_>>(), BowlShape::Corridor).unwrap();
        assert!(dome.height_m < 0.0);
    }
}

#[test]
fn exact_shapes_are_exact() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let points: Vec<_> =
        (0..300).map(|_| Vector3::new(300.0 * rng.random::<f64>(), 200.0 * rng.random::<f64>(), 0.0)).collect();
    let dome: Vec<_> =
        points.iter().map(|p| -2e-7 * ((p.x - 140.0).powi(2) + (p.y - 90.0).powi(2)) + 1e-5 * p.x + 0.01).collect();
    let found = fit(&points, &dome, BowlShape::Dome).unwrap();
    assert_relative_eq!(found.coefficient_per_m, -2e-7, max_relative = 1e-9);
    assert!(found.explained > 1.0 - 1e-9);
    let bent: Vec<_> = points.iter().map(|p| 1e-4 * p.x - 3e-5 * p.y).collect();
    // A plane has no bowl: what is left is rounding.
    assert!(fit(&points, &bent, BowlShape::Dome).unwrap().height_m.abs() < 1e-14);
    assert!(fit(&points, &bent, BowlShape::CorridorWithTilt).unwrap().height_m.abs() < 1e-14);
    let flat = fit(&points, &vec![0.0; 300], BowlShape::Corridor).unwrap();
    assert_eq!((flat.height_m, flat.statistic, flat.p_value, flat.explained), (0.0, 0.0, 1.0, 0.0));
}

#[test]
fn statistic_is_that_of_two_separate_fits() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let points = dike(60, &mut rng);
    let heights: Vec<f64> =
        points.iter().map(|p| 1e-6 * p.y * p.y + 0.002 * rng.sample::<f64, _>(StandardNormal)).collect();
    for (shape, terms) in [(BowlShape::Corridor, 3), (BowlShape::CorridorWithTilt, 4)] {
        let bowl = fit(&points, &heights, shape).unwrap();
        let along = Vector2::from(bowl.axis);
        let s = |p: &Vector3<f64>| along.dot(&(p.xy() - Vector2::from(bowl.middle_m)));
        let t = |p: &Vector3<f64>| along.x * p.y - along.y * p.x;
        // Sum of squares of the residuals of least squares with the first columns of (1, s, t, s^2), by singular
        // values.
        let scatter = |columns: &[usize]| -> f64 {
            let design = DMatrix::from_fn(points.len(), columns.len(), |i, j| {
                let p = &points[i];
                [1.0, s(p) / 100.0, t(p) / 100.0, (s(p) / 100.0).powi(2)][columns[j]]
            });
            let z = DVector::from_column_slice(&heights);
            let x = design.clone().svd(true, true).solve(&z, 1e-14).unwrap();
            (z - design * x).norm_squared()
        };
        let (without, with) = if terms == 3 {
            (scatter(&[0, 1]), scatter(&[0, 1, 3]))
        } else {
            (scatter(&[0, 1, 2]), scatter(&[0, 1, 2, 3]))
        };
        let dof = points.len() - terms;
        assert_eq!(bowl.dof, dof);
        assert_relative_eq!(bowl.statistic, (without - with) / (with / dof as f64), max_relative = 1e-9);
        assert_relative_eq!(bowl.explained, 1.0 - with / without, max_relative = 1e-9);
        assert_relative_eq!((bowl.coefficient_per_m / bowl.sigma_per_m).powi(2), bowl.statistic, max_relative = 1e-9);
    }
}

#[test]
fn p_values_are_uniform_without_a_bowl() {
    for shape in [BowlShape::Corridor, BowlShape::Dome] {
        let p: Vec<f64> = (0..400)
            .map(|seed| {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                let points = dike(15, &mut rng);
                let heights: Vec<f64> =
                    points.iter().map(|p| 1e-3 * p.y + rng.sample::<f64, _>(StandardNormal)).collect();
                fit(&points, &heights, shape).unwrap().p_value
            })
            .collect();
        let (_, uniform) = kolmogorov_smirnov(&p, |x| x);
        assert!(uniform > 0.001, "{shape:?}: {uniform}");
    }
}

#[test]
fn degenerate_points_are_named() {
    let line: Vec<_> = (0..10).map(|i| Vector3::new(0.0, f64::from(i), 0.0)).collect();
    let dz = vec![0.1; 10];
    assert_eq!(fit(&line[..3], &dz[..3], BowlShape::Corridor).unwrap_err(), BowlError::TooFew { points: 3, terms: 3 });
    assert_eq!(fit(&line, &dz, BowlShape::Dome).unwrap_err(), BowlError::Degenerate);
    let two_places: Vec<_> = (0..10).map(|i| Vector3::new(0.0, f64::from(i % 2) * 50.0, 0.0)).collect();
    assert_eq!(fit(&two_places, &dz, BowlShape::Corridor).unwrap_err(), BowlError::Degenerate);
    assert_eq!(fit(&[Vector3::zeros(); 10], &dz, BowlShape::Corridor).unwrap_err(), BowlError::Degenerate);
    let mut bad = dz.clone();
    bad[4] = f64::INFINITY;
    assert_eq!(fit(&line, &bad, BowlShape::Corridor).unwrap_err(), BowlError::NotFinite(4));
    assert_eq!(fit(&line, &dz[..4], BowlShape::Corridor).unwrap_err(), BowlError::Counts { positions: 10, heights: 4 });
}
