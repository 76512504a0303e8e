//! Object points from their image measurements, the images held: space intersection.
//!
//! [`Method::Image`] minimises `sum |(observed - projected) / sigma|^2` from the intersection of the rays.
//! [`Method::Rays`] minimises the sum of squared distances to the rays in space, as the control-point tools of MicMac do: it
//! gives far images more weight than their precision deserves, and is here to follow published figures.

use super::ImageModel;
use crate::block::{Block, ImageId, Measurement, PointId};
use crate::math::intersect::{ImagePoint, Intersected, NoIntersection, intersect_in_images, intersect_rays};
use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;

/// What is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Weighted image residuals.
    #[default]
    Image,
    /// Distances to the rays in space, unweighted.
    Rays,
}

/// One image measurement of the point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Image.
    pub image: ImageId,
    /// Measured image point, px.
    pub xy: [f64; 2],
    /// Standard deviation of each coordinate, px.
    pub sigma: f64,
}

/// An intersected point.
#[derive(Debug, Clone, PartialEq)]
pub struct Intersection {
    /// Which point.
    pub point: PointId,
    /// Its coordinates, m.
    pub position: Vector3<f64>,
    /// Covariance (m^2) from the a-priori sigma of the measurements alone, the images taken as free of error.
    pub covariance: Matrix3<f64>,
    /// Index of each of its measurements in the list they came from.
    pub measurements: Vec<usize>,
    /// Observed minus projected (px), in the order of `measurements`.
    pub residuals: Vec<Vector2<f64>>,
    /// Gauss-Newton iterations, none for [`Method::Rays`].
    pub iterations: usize,
}

/// Why a point has no intersection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// Fewer than two measurements.
    #[error("{0} image measurement(s), an intersection needs 2")]
    TooFewMarks(usize),
    /// The camera cannot be inverted at a measured image point.
    #[error("no viewing ray: a measurement lies outside the domain of the distortion")]
    NoRay,
    /// Rays (nearly) parallel, or all from one place.
    #[error("the rays are parallel")]
    Parallel,
    /// The intersection lies behind an image.
    #[error("the point lies behind an image that measured it")]
    Behind,
    /// Gauss-Newton found no minimum.
    #[error("the intersection diverged")]
    Diverged,
}

impl From<NoIntersection> for Failure {
    fn from(reason: NoIntersection) -> Self {
        match reason {
            NoIntersection::Unseen => Failure::Behind,
            NoIntersection::Parallel => Failure::Parallel,
            NoIntersection::Diverged => Failure::Diverged,
        }
    }
}

/// A point without intersection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FailedIntersection {
    /// Which point.
    pub point: PointId,
    /// Why.
    pub reason: Failure,
}

/// All points of a list: each is in one of the two.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Intersections {
    /// Intersected, in the order of the points.
    pub points: Vec<Intersection>,
    /// Not intersected, in the order of the points.
    pub failed: Vec<FailedIntersection>,
}

/// Intersects every surveyed point of the block from its marks.
pub fn intersect_surveyed(model: &impl ImageModel, block: &Block, method: Method) -> Intersections {
    intersect_all(model, &block.marks, block.surveyed.len(), block.sigma.mark_px, method)
}

/// Intersects the points `0..count` from their measurements, `sigma_px` where a measurement gives none. Runs in
/// parallel; the result does not depend on the number of threads.
fn intersect_all(
    model: &impl ImageModel,
    measurements: &[Measurement],
    count: usize,
    sigma_px: f64,
    method: Method,
) -> Intersections {
    let mut of_point = vec![Vec::new(); count];
    for (index, measurement) in measurements.iter().enumerate() {
        of_point[measurement.point.index()].push(index);
    }
    let outcomes: Vec<_> = of_point
        .into_par_iter()
        .enumerate()
        .map(|(point, indices)| {
            let observations: Vec<_> = indices
                .iter()
                .map(|&index| {
                    let Measurement { image, x, y, sigma, .. } = measurements[index];
                    Observation { image, xy: [x, y], sigma: sigma.unwrap_or(sigma_px) }
                })
                .collect();
            let point = PointId::from(point);
            match intersect_point(model, &observations, method) {
                Ok(Intersected { position, covariance, residuals, iterations }) => {
                    Ok(Intersection { point, position, covariance, measurements: indices, residuals, iterations })
                }
                Err(reason) => Err(FailedIntersection { point, reason }),
            }
        })
        .collect();
    let mut result = Intersections::default();
    for outcome in outcomes {
        match outcome {
            Ok(intersection) => result.points.push(intersection),
            Err(failed) => result.failed.push(failed),
        }
    }
    result
}

/// Intersects one point: coordinates (m), their covariance, residuals (px) and iterations.
///
/// # Errors
/// [`Failure`].
pub fn intersect_point(
    model: &impl ImageModel,
    observations: &[Observation],
    method: Method,
) -> Result<Intersected, Failure> {
    if observations.len() < 2 {
        return Err(Failure::TooFewMarks(observations.len()));
    }
    let rays: Vec<_> = observations.iter().map(|o| model.ray(o.image, o.xy)).collect();
    // An effect may leave one image without an inverse; two rays are enough to start from, but not for a fit of rays.
    let usable: Vec<_> =
        rays.iter().zip(observations).filter_map(|(ray, o)| Some((model.centre(o.image), (*ray)?))).collect();
    if usable.len() < 2 || (method == Method::Rays && usable.len() < observations.len()) {
        return Err(Failure::NoRay);
    }
    let (centres, directions): (Vec<_>, Vec<_>) = usable.into_iter().unzip();
    let start = intersect_rays(&centres, &directions).ok_or(Failure::Parallel)?;
    match method {
        Method::Image => {
            let measured: Vec<ImagePoint> =
                observations.iter().map(|o| ImagePoint { xy: o.xy, sigma: o.sigma }).collect();
            Ok(intersect_in_images(&measured, start, |point| model.project_each(observations, point))?)
        }
        Method::Rays => {
            let covariance = covariance_of_rays(model, observations, &start, &directions)?;
            let residual = |o: &Observation| {
                let (projected, _) = model.project(o.image, &start).ok_or(Failure::Behind)?;
                Ok(Vector2::from(o.xy) - Vector2::from(projected))
            };
            let residuals = observations.iter().map(residual).collect::<Result<_, Failure>>()?;
            Ok(Intersected { position: start, covariance, residuals, iterations: 0 })
        }
    }
}

/// Law of propagation for the intersection of rays: an image error `e` shifts a ray at the point by `J^+ e` across
/// itself (`J` has the ray as null space), and the point by `N^-1` times the sum of the shifts, `N` the sum of `I - d
/// d'`.
fn covariance_of_rays(
    model: &impl ImageModel,
    observations: &[Observation],
    point: &Vector3<f64>,
    directions: &[Vector3<f64>],
) -> Result<Matrix3<f64>, Failure> {
    let mut across = Matrix3::zeros();
    let mut shifts = Matrix3::zeros();
    for (o, direction) in observations.iter().zip(directions) {
        let (_, jacobian) = model.project(o.image, point).ok_or(Failure::Behind)?;
        let square = (jacobian * jacobian.transpose()).try_inverse().ok_or(Failure::Diverged)?;
        let pseudo_inverse = jacobian.transpose() * square;
        across += Matrix3::identity() - direction * direction.transpose();
        shifts += pseudo_inverse * pseudo_inverse.transpose() * (o.sigma * o.sigma);
    }
    let inverse = across.try_inverse().ok_or(Failure::Parallel)?;
    Ok(inverse * shifts * inverse)
}

#[cfg(test)]
#[path = "intersection_tests.rs"]
mod tests;
