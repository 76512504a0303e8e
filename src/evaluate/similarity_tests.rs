use super::*;
use crate::math::rotation::log;
use approx::assert_relative_eq;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Round-off of coordinates of some hundred metres, a few operations long.
const EXACT: f64 = 1e-12;

fn random_vector(rng: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * (2.0 * rng.random::<f64>() - 1.0))
}

fn random_similarity(rng: &mut ChaCha8Rng) -> Similarity {
    let q = Quaternion::new(
        rng.sample(StandardNormal),
        rng.sample(StandardNormal),
        rng.sample(StandardNormal),
        rng.sample::<f64, _>(StandardNormal),
    );
    Similarity {
        scale: 10f64.powf(2.0 * rng.random::<f64>() - 1.0),
        rotation: UnitQuaternion::from_quaternion(q),
        translation: random_vector(rng, 100.0),
    }
}

fn assert_same(found: &Similarity, truth: &Similarity, tolerance: f64) {
    assert_relative_eq!(found.scale, truth.scale, max_relative = tolerance);
    assert!(found.rotation.angle_to(&truth.rotation) < tolerance, "{}", found.rotation.angle_to(&truth.rotation));
    assert_relative_eq!(found.translation, truth.translation, epsilon = tolerance * 100.0 * truth.scale.max(1.0));
}

#[test]
fn random_similarities_are_recovered() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for trial in 0..200 {
        let truth = random_similarity(&mut rng);
        // Three points are coplanar by nature; every fourth larger set is made so.
        let mut source: Vec<_> = (0..3 + trial % 10).map(|_| random_vector(&mut rng, 1.0)).collect();
        if trial % 4 == 0 {
            source.iter_mut().for_each(|p| p.z = 0.25);
        }
        let target: Vec<_> = source.iter().map(|p| truth.apply(p)).collect();
        let weights: Vec<_> = source.iter().map(|_| 0.1 + rng.random::<f64>()).collect();
        // The smallest triangles among the random ones magnify rounding.
        assert_same(&target_from_source(&source, &target, Some(&weights)).unwrap().similarity, &truth, 50.0 * EXACT);
    }
}

#[test]
fn well_spread_sets_are_recovered_to_rounding() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let source: Vec<_> = (0..12).map(|_| random_vector(&mut rng, 100.0)).collect();
    for _ in 0..50 {
        let truth = random_similarity(&mut rng);
        let target: Vec<_> = source.iter().map(|p| truth.apply(p)).collect();
        let fit = target_from_source(&source, &target, None).unwrap();
        assert_same(&fit.similarity, &truth, EXACT);
        for (p, q) in source.iter().zip(&target) {
            assert_relative_eq!(fit.similarity.apply(p), q, epsilon = EXACT * 1000.0);
            assert_relative_eq!(fit.similarity.inverse().apply(q), p, epsilon = EXACT * 1000.0);
        }
    }
}

#[test]
fn half_turns_and_mirrored_quaternions() {
    let source = [Vector3::new(0.0, 0.0, 0.0), Vector3::new(5.0, 0.0, 0.0), Vector3::new(0.0, 3.0, 1.0)];
    for axis in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()] {
        let rotation = UnitQuaternion::from_axis_angle(&axis, std::f64::consts::PI);
        let truth = Similarity { scale: 1.0, rotation, translation: Vector3::zeros() };
        let target: Vec<_> = source.iter().map(|p| truth.apply(p)).collect();
        let found = target_from_source(&source, &target, None).unwrap().similarity;
        assert_same(&found, &truth, EXACT);
        assert!(found.quaternion()[0] >= 0.0);
    }
}

#[test]
fn a_narrow_corridor_in_projected_coordinates_keeps_its_roll() {
    // 1 km long, 0.5 m wide, coordinates of a national grid: 1e-9 m of rounding over 0.25 m is 4e-9 rad.
    let origin = Vector3::new(652_000.0, 6_862_000.0, 40.0);
    let source: Vec<_> =
        (0..40).map(|i| Vector3::new(f64::from(i % 2) * 0.5, f64::from(i) * 25.0, 0.2 * f64::from(i % 3))).collect();
    let rotation = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.0);
    let truth = Similarity { scale: 1.0003, rotation, translation: origin };
    let target: Vec<_> = source.iter().map(|p| truth.apply(p)).collect();
    let fit = target_from_source(&source, &target, None).unwrap();
    assert!(fit.similarity.rotation.angle_to(&rotation) < 1e-8);
    assert!(fit.residuals.iter().all(|v| v.norm() < 1e-8));
    assert!(fit.sigma0 < 1e-8);
}

#[test]
fn covariance_matches_monte_carlo() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    // Off the origin, so that scale and rotation correlate with the translation.
    let source: Vec<_> = (0..8).map(|_| random_vector(&mut rng, 50.0) + Vector3::new(300.0, -200.0, 20.0)).collect();
    let sigma: Vec<f64> = (0..8).map(|i| 0.01 * (1.0 + f64::from(i % 4))).collect();
    let weights: Vec<_> = sigma.iter().map(|s| 1.0 / (s * s)).collect();
    let rotation = UnitQuaternion::from_euler_angles(0.4, 0.1, -2.0);
    let truth = Similarity { scale: 1.7, rotation, translation: Vector3::new(10.0, 20.0, 30.0) };
    let trials = 4000;
    let mut found = Matrix7::zeros();
    let (mut variance, mut cofactors) = (0.0, Matrix7::zeros());
    for _ in 0..trials {
        let target: Vec<_> = source
            .iter()
            .zip(&sigma)
            .map(|(p, s)| truth.apply(p) + Vector3::from_fn(|_, _| s * rng.sample::<f64, _>(StandardNormal)))
            .collect();
        let fit = target_from_source(&source, &target, Some(&weights)).unwrap();
        let turn = (fit.similarity.rotation * truth.rotation.inverse()).to_rotation_matrix();
        let mut error = SVector::<f64, 7>::zeros();
        error[0] = fit.similarity.scale - truth.scale;
        error.fixed_rows_mut::<3>(1).copy_from(&log(turn.matrix()));
        error.fixed_rows_mut::<3>(4).copy_from(&(fit.similarity.translation - truth.translation));
        found += error * error.transpose() / f64::from(trials);
        variance += fit.sigma0 * fit.sigma0 / f64::from(trials);
        cofactors = fit.cofactors;
        assert_relative_eq!(fit.covariance(), fit.cofactors * fit.sigma0.powi(2));
    }
    // A sample variance of 4000 has a relative sigma of 2.2 %; 28 entries are compared, so four of them.
    let tolerance = 4.0 * (2.0 / f64::from(trials)).sqrt();
    for i in 0..7 {
        for j in 0..7 {
            let unit = (cofactors[(i, i)] * cofactors[(j, j)]).sqrt();
            assert_relative_eq!(found[(i, j)] / unit, cofactors[(i, j)] / unit, epsilon = tolerance);
        }
    }
    assert_relative_eq!(variance, 1.0, epsilon = 4.0 * (2.0 / (17.0 * f64::from(trials))).sqrt());
}

#[test]
fn the_fit_is_the_minimum() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let source: Vec<_> = (0..6).map(|_| random_vector(&mut rng, 1.0)).collect();
    let target: Vec<_> = source.iter().map(|p| p * 2.0 + random_vector(&mut rng, 0.2)).collect();
    let fit = target_from_source(&source, &target, None).unwrap();
    let cost =
        |s: &Similarity| -> f64 { source.iter().zip(&target).map(|(p, q)| (s.apply(p) - q).norm_squared()).sum() };
    let least = cost(&fit.similarity);
    assert_relative_eq!(least, fit.sigma0.powi(2) * fit.redundancy as f64, max_relative = 1e-10);
    for _ in 0..200 {
        let mut near = fit.similarity;
        near.scale *= 1.0 + 1e-4 * (rng.random::<f64>() - 0.5);
        near.rotation = UnitQuaternion::from_scaled_axis(random_vector(&mut rng, 1e-4)) * near.rotation;
        near.translation += random_vector(&mut rng, 1e-4);
        assert!(cost(&near) > least);
    }
}

#[test]
fn a_transformed_pose_sees_the_transformed_point_where_it_was() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..20 {
        let similarity = random_similarity(&mut rng);
        let rotation = random_similarity(&mut rng).rotation;
        let pose = Pose { rotation, centre: random_vector(&mut rng, 10.0) };
        let point = random_vector(&mut rng, 30.0);
        let seen = similarity.apply_to_pose(&pose).cam_from_world(&similarity.apply(&point));
        assert_relative_eq!(seen, pose.cam_from_world(&point) * similarity.scale, epsilon = 1e-11);
        let other = random_similarity(&mut rng);
        assert_relative_eq!(
            similarity.after(&other).apply(&point),
            similarity.apply(&other.apply(&point)),
            max_relative = 1e-12,
            epsilon = 1e-10
        );
    }
}

#[test]
fn degenerate_sets_are_named() {
    let spread = [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(1.0, 1.0, 0.0)];
    let line: Vec<_> =
        (0..4).map(|i| Vector3::new(7e5, 6e6, 30.0) + Vector3::new(1.0, 2.0, -0.5) * f64::from(i)).collect();
    let place = [Vector3::new(3.0, 4.0, 5.0); 4];
    let fit = |source: &[Vector3<f64>], target: &[Vector3<f64>]| target_from_source(source, target, None).unwrap_err();
    assert_eq!(fit(&spread[..2], &spread[..2]), SimilarityError::TooFew(2));
    assert_eq!(fit(&[], &[]), SimilarityError::TooFew(0));
    assert_eq!(fit(&line, &spread), SimilarityError::Collinear("source"));
    assert_eq!(fit(&spread, &line), SimilarityError::Collinear("target"));
    assert_eq!(fit(&place, &spread), SimilarityError::Collinear("source"));
    assert_eq!(fit(&spread, &spread[..3]), SimilarityError::Counts { source_points: 4, target_points: 3, weights: 4 });
    let mut bad = spread;
    bad[2].y = f64::NAN;
    assert_eq!(fit(&spread, &bad), SimilarityError::BadPoint(2));
    let weights = [1.0, 0.0, 1.0, 1.0];
    assert_eq!(target_from_source(&spread, &spread, Some(&weights)).unwrap_err(), SimilarityError::BadPoint(1));
    // The tetrahedron's mirror image: all half turns about the axes fit it equally well.
    let tetrahedron = [
        Vector3::new(1.0, 1.0, 1.0),
        Vector3::new(1.0, -1.0, -1.0),
        Vector3::new(-1.0, 1.0, -1.0),
        Vector3::new(-1.0, -1.0, 1.0),
    ];
    assert_eq!(fit(&tetrahedron, &tetrahedron.map(|p| -p)), SimilarityError::Ambiguous);
}

#[test]
fn the_newton_step_restores_the_roll_that_the_eigenvector_loses() {
    // 1 km long, 1 m wide, local coordinates: the ratio of the eigenvalues (1e6) costs the eigenvector 2.5e-11 rad.
    let source: Vec<_> =
        (0..40).map(|i| Vector3::new(f64::from(i % 2), f64::from(i) * 25.0 - 500.0, 0.2 * f64::from(i % 3))).collect();
    let rotation = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.0);
    let truth = Similarity { scale: 1.0003, rotation, translation: Vector3::zeros() };
    let target: Vec<_> = source.iter().map(|p| truth.apply(p)).collect();
    let found = target_from_source(&source, &target, None).unwrap().similarity.rotation;
    assert!((found * rotation.inverse()).scaled_axis().norm() < 1e-12);
}
