//! Intersection of a point: linear, from rays in space ([`intersect_rays`]), and from there iterated, from image points
//! of whatever projection ([`intersect_in_images`]).

use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};

/// Gauss-Newton has converged at a step below this, in standard deviations of the point. Convergence is fast (the rays
/// start it within a few sigma), so the step after would be smaller by orders of magnitude still.
const CONVERGED_SIGMA: f64 = 1e-7;
/// A step of this many roundings of the coordinates cannot be improved on, whatever the precision asks for; image
/// coordinates are as inexact.
const ROUNDINGS: f64 = 8.0;
/// Iterations; three to five are needed.
const MAX_ITERATIONS: usize = 50;
/// Times that a step which does not lower the cost is halved.
const MAX_HALVINGS: usize = 20;

/// Smallest root mean square angle (rad) between the rays and their best common direction: below it they count as
/// parallel. Two rays that meet at 2e-5 rad turn an error of 0.1 px (f = 5000 px) into the whole distance, so nothing
/// real is lost.
pub const PARALLEL_LIMIT_RAD: f64 = 1e-5;

/// The point (m) with the least sum of squared distances to the rays `origins[i] + s directions[i]` (directions of any
/// length, taken as whole lines: a point behind an origin is for the caller to refuse).
///
/// `None` for fewer than two rays, lists of different lengths, a direction of length zero, a value that is not finite,
/// and rays that are parallel to within [`PARALLEL_LIMIT_RAD`].
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

/// A measured image point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePoint {
    /// Measured, px.
    pub xy: [f64; 2],
    /// Standard deviation of each coordinate, px.
    pub sigma: f64,
}

/// A point intersected in images.
#[derive(Debug, Clone, PartialEq)]
pub struct Intersected {
    /// Its coordinates, m.
    pub position: Vector3<f64>,
    /// Covariance (m^2) from the sigma of the measurements alone, the images taken as free of error.
    pub covariance: Matrix3<f64>,
    /// Observed minus projected, px.
    pub residuals: Vec<Vector2<f64>>,
    /// Gauss-Newton iterations.
    pub iterations: usize,
}

/// Why image points have no intersection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoIntersection {
    /// The point lies where an image cannot see it.
    Unseen,
    /// The images do not fix the point.
    Parallel,
    /// No minimum was found.
    Diverged,
}

/// The point (m) with the least `sum |(observed - projected) / sigma|^2`, by Gauss-Newton from `start`.
/// `project(point)` gives, in the order of `measured`, the image points (px) of a trial point, and their derivatives by
/// the point (px/m); `None` where an image does not see it.
///
/// # Errors
/// [`NoIntersection`].
pub fn intersect_in_images(
    measured: &[ImagePoint],
    start: Vector3<f64>,
    project: impl Fn(&Vector3<f64>) -> Option<Vec<([f64; 2], Matrix2x3<f64>)>>,
) -> Result<Intersected, NoIntersection> {
    let mut position = start;
    let mut normal = Normal::at(measured, &position, &project).ok_or(NoIntersection::Unseen)?;
    for iterations in 1..=MAX_ITERATIONS {
        let mut step = normal.system.step().ok_or(NoIntersection::Parallel)?;
        let size_in_sigma = step.dot(&normal.system.right).max(0.0).sqrt();
        let converged = size_in_sigma < CONVERGED_SIGMA || step.amax() <= ROUNDINGS * f64::EPSILON * position.amax();
        let allowed = normal.cost + normal.cost_rounding;
        let mut next = None;
        for _ in 0..=MAX_HALVINGS {
            next = Normal::at(measured, &(position + step), &project).filter(|trial| trial.cost <= allowed);
            if next.is_some() {
                break;
            }
            step *= 0.5;
        }
        match next {
            Some(better) => {
                position += step;
                normal = better;
            }
            // At the minimum rounding alone may make every step look worse.
            None if converged => {}
            None => return Err(NoIntersection::Diverged),
        }
        if converged {
            let covariance = normal.system.matrix.cholesky().ok_or(NoIntersection::Parallel)?.inverse();
            return Ok(Intersected { position, covariance, residuals: normal.residuals, iterations });
        }
    }
    Err(NoIntersection::Diverged)
}

/// Normal equations of a point, the images held: one Gauss-Newton step of its coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PointSystem {
    /// Sum of `J'PJ`, in m^-2.
    pub matrix: Matrix3<f64>,
    /// Sum of `J'Pv`, in m^-1.
    pub right: Vector3<f64>,
}

impl PointSystem {
    /// Adds an image point: observed minus projected (px), its derivatives by the point (px/m), its weight (px^-2).
    pub fn add(&mut self, residual: Vector2<f64>, by_point: Matrix2x3<f64>, weight: f64) {
        self.matrix += by_point.transpose() * by_point * weight;
        self.right += by_point.transpose() * residual * weight;
    }

    /// The step, m; `None` where the images do not fix the point.
    pub fn step(&self) -> Option<Vector3<f64>> {
        let step = self.matrix.cholesky()?.solve(&self.right);
        step.iter().all(|value| value.is_finite()).then_some(step)
    }
}

/// Normal equations of the image residuals at a point.
struct Normal {
    system: PointSystem,
    cost: f64,
    /// What rounding may change of the cost: a residual is a difference of image coordinates of thousands of px.
    cost_rounding: f64,
    residuals: Vec<Vector2<f64>>,
}

impl Normal {
    /// `None` when an image does not see the point.
    fn at(
        measured: &[ImagePoint],
        point: &Vector3<f64>,
        project: impl Fn(&Vector3<f64>) -> Option<Vec<([f64; 2], Matrix2x3<f64>)>>,
    ) -> Option<Self> {
        let mut normal = Normal {
            system: PointSystem::default(),
            cost: 0.0,
            cost_rounding: 0.0,
            residuals: Vec::with_capacity(measured.len()),
        };
        for (ImagePoint { xy, sigma }, (projected, jacobian)) in measured.iter().zip(project(point)?) {
            let residual = Vector2::from(*xy) - Vector2::from(projected);
            let weight = 1.0 / (sigma * sigma);
            normal.system.add(residual, jacobian, weight);
            normal.cost += residual.norm_squared() * weight;
            let rounding = ROUNDINGS * f64::EPSILON * Vector2::from(*xy).norm();
            normal.cost_rounding += (2.0 * residual.norm() + rounding) * rounding * weight;
            normal.residuals.push(residual);
        }
        normal.cost.is_finite().then_some(normal)
    }
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

    /// Image point of a camera at `origin` that looks along z, f = 1000 px.
    fn pinhole(origin: &Vector3<f64>, point: &Vector3<f64>) -> Option<([f64; 2], Matrix2x3<f64>)> {
        let d = point - origin;
        let (u, v, s) = (1000.0 * d.x / d.z, 1000.0 * d.y / d.z, 1000.0 / d.z);
        (d.z > 0.0).then(|| ([u, v], Matrix2x3::new(s, 0.0, -u / d.z, 0.0, s, -v / d.z)))
    }

    #[test]
    fn image_points_meet_in_their_point() {
        let point = Vector3::new(3.0, -2.0, 40.0);
        let origins = [Vector3::zeros(), Vector3::x() * 10.0, Vector3::y() * 8.0];
        let measured = origins.map(|origin| ImagePoint { xy: pinhole(&origin, &point).unwrap().0, sigma: 0.5 });
        let project = |trial: &Vector3<f64>| origins.iter().map(|origin| pinhole(origin, trial)).collect();
        let found = intersect_in_images(&measured, point + Vector3::new(1.0, -1.0, 7.0), project).unwrap();
        assert_relative_eq!(found.position, point, epsilon = 1e-12);
        assert!(found.residuals.iter().all(|residual| residual.norm() < 1e-10));
        // Straight ahead of one image the depth moves nothing.
        let ahead = [ImagePoint { xy: [0.0; 2], sigma: 0.5 }; 3];
        let alone = |trial: &Vector3<f64>| ahead.iter().map(|_| pinhole(&origins[0], trial)).collect();
        assert_eq!(intersect_in_images(&ahead, Vector3::z() * 40.0, alone), Err(NoIntersection::Parallel));
        let behind = Vector3::new(0.0, 0.0, -1.0);
        assert_eq!(intersect_in_images(&measured, behind, project), Err(NoIntersection::Unseen));
    }
}
