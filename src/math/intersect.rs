//! Intersection of rays in space.

use nalgebra::{Matrix3, Vector3};

/// Smallest root mean square angle (rad) between the rays and their best common direction: below it they count as parallel.
/// Two rays that meet at 2e-5 rad turn an error of 0.1 px (f = 5000 px) into the whole distance, so nothing real is lost.
pub const PARALLEL_LIMIT_RAD: f64 = 1e-5;

/// The point (m) with the least sum of squared distances to the rays `origins[i] + s directions[i]` (directions of any
/// length, taken as whole lines: a point behind an origin is for the caller to refuse).
///
/// `None` for fewer than two rays, lists of different lengths, a direction of length zero, a value that is not finite, and
/// rays that are parallel to within [`PARALLEL_LIMIT_RAD`].
pub fn intersect_rays(origins: &[Vector3<f64>], directions: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    if origins.len() < 2 || origins.len() != directions.len() {
        return None;
    }
    let count = origins.len() as f64;
    // Coordinates from the mean origin: the normal equations lose no digits to large coordinates.
    let mean = origins.iter().sum::<Vector3<f64>>() / count;
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for (origin, direction) in origins.iter().zip(directions) {
        let unit = direction.try_normalize(0.0)?;
        let across = Matrix3::identity() - unit * unit.transpose();
        normal += across;
        right += across * (origin - mean);
    }
    if !normal.iter().chain(right.iter()).all(|value| value.is_finite()) {
        return None;
    }
    // The least eigenvalue is the sum over the rays of sin^2 of the angle to the best common direction.
    if normal.symmetric_eigenvalues().min() < count * PARALLEL_LIMIT_RAD * PARALLEL_LIMIT_RAD {
        return None;
    }
    Some(mean + normal.cholesky()?.solve(&right))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn rays_through_a_point_meet_there() {
        let point = Vector3::new(432_100.5, 6_543_210.25, 87.0);
        let origins: Vec<_> =
            (0..5).map(|i| point + Vector3::new(f64::from(i) * 7.0, 3.0 - f64::from(i), 50.0)).collect();
        let directions: Vec<_> = origins.iter().map(|origin| (point - origin) * 0.37).collect();
        assert_relative_eq!(intersect_rays(&origins, &directions).unwrap(), point, epsilon = 1e-8);
    }

    #[test]
    fn skew_rays_meet_half_way() {
        // The common perpendicular of the x axis and a line along y at height 2.
        let origins = [Vector3::new(-3.0, 0.0, 0.0), Vector3::new(1.0, 5.0, 2.0)];
        let directions = [Vector3::x(), Vector3::y()];
        assert_relative_eq!(
            intersect_rays(&origins, &directions).unwrap(),
            Vector3::new(1.0, 0.0, 1.0),
            epsilon = 1e-14
        );
    }

    #[test]
    fn what_has_no_intersection_is_refused() {
        let (o, d) = (Vector3::zeros(), Vector3::z());
        assert!(intersect_rays(&[o], &[d]).is_none());
        assert!(intersect_rays(&[o, Vector3::x()], &[d]).is_none());
        assert!(intersect_rays(&[o, Vector3::x()], &[d, Vector3::zeros()]).is_none());
        assert!(intersect_rays(&[o, Vector3::x()], &[d, Vector3::new(f64::NAN, 0.0, 1.0)]).is_none());
        // The angle between two rays is twice that to their common direction.
        let tilted = |angle: f64| Vector3::new(angle.sin(), 0.0, angle.cos());
        assert!(intersect_rays(&[o, Vector3::x()], &[d, tilted(1.9 * PARALLEL_LIMIT_RAD)]).is_none());
        assert!(intersect_rays(&[o, Vector3::x()], &[d, tilted(2.1 * PARALLEL_LIMIT_RAD)]).is_some());
    }
}
