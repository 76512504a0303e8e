//! Covariances and the reduced system against dense algebra.

use super::effects::turning;
use super::*;
use crate::effects::{Scope, Stage};

/// Shared, pose and point covariance against the inverse of the whole normal matrix.
#[test]
fn covariance_is_the_inverse_of_the_normal_matrix() {
    let mut problem = full_problem();
    problem.pose_free[4][3] = true;
    // A flaw that is not there has no place: nothing to invert.
    problem.theta[2..7].iter_mut().for_each(|entry| entry.free = false);
    add_effect(&mut problem, turning(Stage::Interior, Scope::Image), &[0.0]);
    let from = problem.theta.len() - IMAGES;
    problem.theta[from..].iter_mut().for_each(|entry| {
        entry.prior_sigma = Some(1e-3);
        entry.scale = 1e-3;
    });
    let solution = solve(&problem).unwrap();
    let jacobian = dense(&problem, &Ceres.evaluate(&problem, &solution.state).unwrap());
    let free: Vec<usize> = (0..problem.layout().total()).filter(|k| problem.free()[*k]).collect();
    let jacobian = jacobian.select_columns(&free);
    // Scaled columns keep the inversion exact.
    let scale: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let scaled = DMatrix::from_fn(jacobian.nrows(), free.len(), |i, k| jacobian[(i, k)] / scale[k]);
    let inverse = (scaled.transpose() * &scaled).cholesky().expect("regular").inverse();
    let place = |unknown: usize| free.binary_search(&unknown).ok();
    let expected = |a: usize, b: usize| match (place(a), place(b)) {
        (Some(a), Some(b)) => inverse[(a, b)] / (scale[a] * scale[b]),
        _ => 0.0,
    };
    let layout = problem.layout();
    let close = |found: f64, a: usize, b: usize| {
        let size = (expected(a, a) * expected(b, b)).sqrt();
        assert!((found - expected(a, b)).abs() <= 1e-6 * size, "{found} instead of {}", expected(a, b));
    };
    let covariance = solution.covariance.unwrap();
    for (row, &a) in covariance.shared_unknowns.iter().enumerate() {
        for (column, &b) in covariance.shared_unknowns.iter().enumerate() {
            close(covariance.shared[(row, column)], a, b);
        }
    }
    for t in 0..layout.theta {
        close(covariance.theta_variances[t], layout.theta(t), layout.theta(t));
        assert!(!problem.theta[t].free || covariance.theta_variances[t] > 0.0);
    }
    for i in 0..layout.images {
        for (row, column) in (0..36).map(|k| (k / 6, k % 6)) {
            close(covariance.poses[i][(row, column)], layout.pose(i, row), layout.pose(i, column));
        }
    }
    for j in 0..layout.points {
        for (row, column) in (0..9).map(|k| (k / 3, k % 3)) {
            close(covariance.points[j][(row, column)], layout.point(j, row), layout.point(j, column));
        }
    }
    // Shared alone is the same.
    let options = Options { covariance: CovarianceOf::Shared, ..options() };
    let shared = solve_with(&problem, &options).unwrap().covariance.unwrap();
    assert!(shared.poses.is_empty() && shared.points.is_empty());
    for t in 0..layout.theta {
        close(shared.theta_variances[t], layout.theta(t), layout.theta(t));
    }
}

/// The reduced system is the Schur complement of the dense normal matrix.
#[test]
fn reduced_system_is_the_schur_complement() {
    let problem = full_problem();
    let evaluation = Ceres.evaluate(&problem, &problem.start).unwrap();
    let system = Ceres.reduced_system(&problem, &problem.start).unwrap();
    let jacobian = dense(&problem, &evaluation);
    let layout = problem.layout();
    let keep: Vec<usize> = (0..layout.point(0, 0)).filter(|k| problem.free()[*k]).collect();
    assert_eq!(system.unknowns, keep);
    let a = jacobian.select_columns(&keep);
    let b = jacobian.columns(layout.point(0, 0), 3 * layout.points).into_owned();
    let residuals = nalgebra::DVector::from_vec(evaluation.residuals);
    let inverse = (b.transpose() * &b).cholesky().expect("regular").inverse();
    let project = |x: &DMatrix<f64>| x - &b * (&inverse * (b.transpose() * x));
    let expected = a.transpose() * project(&a);
    let gradient = a.transpose() * project(&DMatrix::from_column_slice(residuals.len(), 1, residuals.as_slice()));
    let full = a.transpose() * &a;
    for i in 0..keep.len() {
        for k in 0..keep.len() {
            let size = (full[(i, i)] * full[(k, k)]).sqrt();
            assert!((system.matrix[(i, k)] - expected[(i, k)]).abs() <= 1e-11 * size);
        }
        let size = full[(i, i)].sqrt() * residuals.norm();
        assert!((system.gradient[i] - gradient[i]).abs() <= 1e-11 * size);
    }
}

#[test]
fn too_many_unknowns_for_pose_covariances_are_refused() {
    let (_, mut problem) = problem();
    problem.pose_free = vec![[true; 6]; 1001];
    let error = solve(&problem).unwrap_err();
    assert!(matches!(error, AdjustError::Unsupported { .. }), "{error}");
}
