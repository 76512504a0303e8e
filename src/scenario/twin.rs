//! The error-free twin of a real block, as the study made its data: the measured points are intersected with the given
//! orientation (pseudo-intersection) and reprojected, so that the new measurements meet exactly.

use super::overlap::{Dropped, OverlapReport};
use super::simulate::{MIN_TIES, truth_of};
use super::visibility::Lens;
use super::{Result, ScenarioError, Simulation};
use crate::block::{Block, Gnss, Measurement, PointId, SurveyedPoint, TiePoint};
use crate::camera::fraser::project_with_derivatives;
use crate::camera::undistort::viewing_ray;
use crate::math::intersect::{ImagePoint, intersect_in_images, intersect_rays};
use nalgebra::{Matrix2x3, Vector3};
use rayon::prelude::*;

/// Makes the error-free twin of a real block: cameras and poses are taken as true; tie points, control and check points
/// are intersected from their measurements and reprojected into the same images. Antenna positions, where there are
/// any, become the projection centres. Points that cannot be so treated are left out and counted in the report.
///
/// # Errors
/// A block of which no tie point remains.
pub fn twin_of(block: &Block) -> Result<Simulation> {
    let lenses: Vec<_> = block.cameras.iter().map(Lens::new).collect();
    let mut dropped = Dropped::default();
    let mut twin = truth_of(block);
    twin.tie_points.clear();
    twin.surveyed.clear();
    twin.extra_image_columns = block.extra_image_columns.clone();
    for image in &mut twin.images {
        image.gnss = image.gnss.map(|gnss| Gnss { position: image.pose.centre, ..gnss });
    }
    let ties = retake(block, &lenses, &block.ties, block.tie_points.len());
    for (point, result) in block.tie_points.iter().zip(ties) {
        if let Some((position, rays)) = dropped.count(result) {
            push(&mut twin.ties, rays, twin.tie_points.len());
            twin.tie_points.push(TiePoint { position: Some(position), ..point.clone() });
        }
    }
    let marks = retake(block, &lenses, &block.marks, block.surveyed.len());
    for (point, result) in block.surveyed.iter().zip(marks) {
        if let Some((position, rays)) = dropped.count(result) {
            push(&mut twin.marks, rays, twin.surveyed.len());
            twin.surveyed.push(SurveyedPoint { position, ..point.clone() });
        }
    }
    if twin.tie_points.is_empty() {
        let message = "no tie point intersects in front of its cameras: is the orientation given?".into();
        return Err(ScenarioError::Twin { block: block.name.clone(), message });
    }
    let report = OverlapReport::of_block(&twin, dropped);
    Ok(Simulation { truth: Block { extra_image_columns: Vec::new(), ..truth_of(&twin) }, block: twin, report })
}

/// Why a point is left out.
enum Fault {
    TooFewRays,
    NoIntersection,
    Behind,
    Outside,
}

type Retaken = std::result::Result<(Vector3<f64>, Vec<Measurement>), Fault>;

impl Dropped {
    fn count(&mut self, result: Retaken) -> Option<(Vector3<f64>, Vec<Measurement>)> {
        match result {
            Ok(point) => return Some(point),
            Err(Fault::TooFewRays) => self.too_few_rays += 1,
            Err(Fault::NoIntersection) => self.no_intersection += 1,
            Err(Fault::Behind) => self.behind += 1,
            Err(Fault::Outside) => self.outside += 1,
        }
        None
    }
}

fn push(list: &mut Vec<Measurement>, rays: Vec<Measurement>, point: usize) {
    list.extend(rays.into_iter().map(|ray| Measurement { point: PointId::from(point), ..ray }));
}

/// Every point of a table, intersected and reprojected.
fn retake(block: &Block, lenses: &[Lens], table: &[Measurement], points: usize) -> Vec<Retaken> {
    let mut rays: Vec<Vec<Measurement>> = vec![Vec::new(); points];
    for measurement in table {
        rays[measurement.point.index()].push(*measurement);
    }
    rays.into_par_iter().map(|rays| retake_point(block, lenses, rays)).collect()
}

fn retake_point(block: &Block, lenses: &[Lens], mut rays: Vec<Measurement>) -> Retaken {
    if rays.len() < MIN_TIES {
        return Err(Fault::TooFewRays);
    }
    let start = intersect(block, &rays).ok_or(Fault::NoIntersection)?;
    let in_front = |position: &Vector3<f64>| {
        rays.iter().all(|ray| block.images[ray.image.index()].pose.cam_from_world(position).z > 0.0)
    };
    if !in_front(&start) {
        return Err(Fault::Behind);
    }
    let position = refine(block, &rays, start).ok_or(Fault::NoIntersection)?;
    if !in_front(&position) {
        return Err(Fault::Behind);
    }
    for ray in &mut rays {
        let image = &block.images[ray.image.index()];
        let lens = &lenses[image.camera.index()];
        [ray.x, ray.y] = lens.image_of(image.pose.cam_from_world(&position), 0.0).ok_or(Fault::Outside)?;
    }
    Ok((position, rays))
}

/// Intersects the straight rays of the measurements.
fn intersect(block: &Block, rays: &[Measurement]) -> Option<Vector3<f64>> {
    let mut origins = Vec::with_capacity(rays.len());
    let mut directions = Vec::with_capacity(rays.len());
    for ray in rays {
        let pose = &block.images[ray.image.index()].pose;
        origins.push(pose.centre);
        directions.push(pose.rotation.inverse() * viewing_ray(&block.camera_of(ray.image).interior, [ray.x, ray.y])?);
    }
    intersect_rays(&origins, &directions)
}

/// Least squares of the reprojection, every ray of the same weight; `None` when it does not converge or leaves the
/// front.
fn refine(block: &Block, rays: &[Measurement], start: Vector3<f64>) -> Option<Vector3<f64>> {
    let measured: Vec<ImagePoint> = rays.iter().map(|ray| ImagePoint { xy: [ray.x, ray.y], sigma: 1.0 }).collect();
    let project_one = |ray: &Measurement, point: &Vector3<f64>| {
        let pose = &block.images[ray.image.index()].pose;
        let interior = &block.camera_of(ray.image).interior;
        let projection = project_with_derivatives(interior, pose.cam_from_world(point).into())?;
        let by_camera_point = Matrix2x3::from_fn(|i, j| projection.d_camera_point[i][j]);
        Some((projection.point, by_camera_point * pose.rotation.to_rotation_matrix().into_inner()))
    };
    let project = |point: &Vector3<f64>| rays.iter().map(|ray| project_one(ray, point)).collect();
    intersect_in_images(&measured, start, project).ok().map(|found| found.position)
}
