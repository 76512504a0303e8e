//! What overlap and multiplicity result.

use super::description::Scenario;
use super::strips::{footprint, strip_count, strip_spacing};
use crate::block::{Block, Image};
use crate::camera::undistort::undistort;
use crate::camera::{Camera, F, fraser};
use nalgebra::Vector3;
use serde::Serialize;
use std::fmt;

/// Places along each side of the sensor whose share in another image is the overlap.
const GRID: usize = 24;

/// One flight as it was flown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlightOverlap {
    /// Name.
    pub flight: String,
    /// Number of images.
    pub images: usize,
    /// Number of strips.
    pub strips: usize,
    /// Nominal nadir footprint on z = 0 across and along the track, m.
    pub footprint_m: [f64; 2],
    /// Nominal distance of the strips, m; `None` for one strip and for rings.
    pub strip_spacing_m: Option<f64>,
    /// Mean distance of successive projection centres of a strip, m; `None` without such a pair.
    pub base_m: Option<f64>,
    /// Ground pixel below the camera, m.
    pub gsd_m: f64,
    /// Mean part of an image, on z = 0, that the next image of its strip sees.
    pub forward_overlap: Option<f64>,
    /// Mean part of an image, on z = 0, that the image of the next strip with the nearest principal ray there sees.
    pub side_overlap: Option<f64>,
}

/// What a twin leaves out of the real block.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Tie and surveyed points with fewer than two measurements.
    pub too_few_rays: usize,
    /// Points whose rays do not intersect: parallel, beyond the domain of the inverse distortion, or without
    /// convergence.
    pub no_intersection: usize,
    /// Points behind one of their cameras.
    pub behind: usize,
    /// Points whose reprojection leaves a sensor.
    pub outside: usize,
}

impl Dropped {
    /// All points left out.
    pub fn total(&self) -> usize {
        self.too_few_rays + self.no_intersection + self.behind + self.outside
    }
}

/// Overlap and multiplicity of a simulated block.
#[derive(Debug, Clone, PartialEq)]
pub struct OverlapReport {
    /// One per flight; empty for a twin, whose strips are not known.
    pub flights: Vec<FlightOverlap>,
    /// Number of tie points measured in `k` images, at index `k`.
    pub multiplicity: Vec<usize>,
    /// Number of tie-point measurements.
    pub ties: usize,
    /// Number of measurements of surveyed points.
    pub marks: usize,
    /// Least number of tie points in an image.
    pub least_ties_per_image: usize,
    /// Points that a twin leaves out.
    pub dropped: Dropped,
}

impl OverlapReport {
    /// Mean number of images of a tie point.
    pub fn mean_multiplicity(&self) -> f64 {
        self.ties as f64 / self.multiplicity.iter().sum::<usize>() as f64
    }

    pub(super) fn of_block(block: &Block, dropped: Dropped) -> Self {
        let mut per_point = vec![0_usize; block.tie_points.len()];
        let mut per_image = vec![0_usize; block.images.len()];
        for tie in &block.ties {
            per_point[tie.point.index()] += 1;
            per_image[tie.image.index()] += 1;
        }
        let mut multiplicity = vec![0; per_point.iter().max().map_or(0, |max| max + 1)];
        per_point.iter().for_each(|count| multiplicity[*count] += 1);
        OverlapReport {
            flights: Vec::new(),
            multiplicity,
            ties: block.ties.len(),
            marks: block.marks.len(),
            least_ties_per_image: per_image.into_iter().min().unwrap_or(0),
            dropped,
        }
    }
}

/// The flights of a scenario, as its images were placed.
pub(super) fn of_flights(scenario: &Scenario, block: &Block, strip: &[usize]) -> Vec<FlightOverlap> {
    let rays: Vec<_> = block.cameras.iter().map(sensor_rays).collect();
    let overlap = |a: usize, b: usize| {
        let (a, b) = (&block.images[a], &block.images[b]);
        shared(a, &rays[a.camera.index()], b, &block.cameras[b.camera.index()])
    };
    let aims: Vec<_> = block.images.iter().map(aim).collect();
    (0..block.flights.len())
        .map(|index| {
            let images: Vec<usize> =
                (0..block.images.len()).filter(|i| block.images[*i].flight.index() == index).collect();
            // Validated: a route, flight or ring has at least one image.
            let first_strip = images.first().map_or(0, |i| strip[*i]);
            let last_strip = images.last().map_or(0, |i| strip[*i]);
            let strips = last_strip - first_strip + 1;
            let distance = |a: usize, b: usize| (block.images[a].pose.centre - block.images[b].pose.centre).norm();
            let successive: Vec<_> =
                images.windows(2).filter(|pair| strip[pair[0]] == strip[pair[1]]).map(|p| (p[0], p[1])).collect();
            // Beside is who looks at the same place: strips of a tilted camera look in opposite directions.
            let beside: Vec<_> = images
                .iter()
                .filter_map(|&a| {
                    let gap = |b: usize| (aims[a] - aims[b]).norm();
                    let next = images.iter().copied().filter(|b| strip[*b] == strip[a] + 1);
                    next.min_by(|b, c| gap(*b).total_cmp(&gap(*c))).map(|b| (a, b))
                })
                .collect();
            let flight = index.checked_sub(scenario.routes.len()).and_then(|own| scenario.flights.get(own));
            let camera = images.first().map(|i| &block.cameras[block.images[*i].camera.index()]);
            let height = images.iter().map(|i| block.images[*i].pose.centre.z).sum::<f64>() / images.len() as f64;
            let gsd_m = camera.map_or(0.0, |camera| height / camera.interior[F]);
            FlightOverlap {
                flight: block.flights[index].clone(),
                images: images.len(),
                strips,
                footprint_m: match (flight, camera) {
                    (Some(flight), _) => footprint(scenario, flight),
                    (None, Some(c)) => [f64::from(c.width_px) * gsd_m, f64::from(c.height_px) * gsd_m],
                    (None, None) => [0.0; 2],
                },
                strip_spacing_m: flight
                    .filter(|flight| strip_count(scenario, flight) > 1)
                    .map(|flight| strip_spacing(scenario, flight)),
                base_m: mean(successive.iter().map(|(a, b)| distance(*a, *b))),
                gsd_m,
                forward_overlap: mean(successive.iter().filter_map(|(a, b)| overlap(*a, *b))),
                side_overlap: mean(beside.iter().filter_map(|(a, b)| overlap(*a, *b))),
            }
        })
        .collect()
}

impl fmt::Display for OverlapReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |value: Option<f64>| value.map_or("-".into(), |value| format!("{:.0}", 100.0 * value));
        let metres = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.1}"));
        if !self.flights.is_empty() {
            writeln!(f, "flight        images strips  base m  spacing m  gsd mm  forward %  side %")?;
        }
        for flight in &self.flights {
            writeln!(
                f,
                "{:<14}{:>6}{:>7}{:>8}{:>11}{:>8.1}{:>11}{:>8}",
                flight.flight,
                flight.images,
                flight.strips,
                metres(flight.base_m),
                metres(flight.strip_spacing_m),
                1e3 * flight.gsd_m,
                percent(flight.forward_overlap),
                percent(flight.side_overlap),
            )?;
        }
        let points: usize = self.multiplicity.iter().sum();
        write!(f, "{points} tie points, {} measurements, {:.2} images each;", self.ties, self.mean_multiplicity())?;
        for (images, count) in self.multiplicity.iter().enumerate().filter(|(_, count)| **count > 0) {
            write!(f, " {images}: {count}")?;
        }
        writeln!(f, "\nat least {} tie points in an image, {} marks", self.least_ties_per_image, self.marks)?;
        let Dropped { too_few_rays, no_intersection, behind, outside } = self.dropped;
        if self.dropped.total() > 0 {
            writeln!(
                f,
                "left out: {too_few_rays} points with one ray, {no_intersection} without intersection, {behind} behind \
                 a camera, {outside} outside a sensor"
            )?;
        }
        Ok(())
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / count as f64)
}

/// Where the optical axis meets z = 0, or the projection centre for an image that looks up.
fn aim(image: &Image) -> Vector3<f64> {
    let centre = image.pose.centre;
    let axis = image.pose.rotation.inverse() * Vector3::z();
    let scale = -centre.z / axis.z;
    if scale.is_finite() && scale > 0.0 { centre + axis * scale } else { centre }
}

/// Rays (camera frame) of a regular grid over the sensor.
fn sensor_rays(camera: &Camera) -> Vec<Vector3<f64>> {
    let [f, ppx, ppy, ..] = camera.interior;
    let cell = |i: usize, size: u32| (i as f64 + 0.5) / GRID as f64 * f64::from(size);
    (0..GRID * GRID)
        .filter_map(|i| {
            undistort(&camera.interior, [cell(i % GRID, camera.width_px), cell(i / GRID, camera.height_px)])
        })
        .map(|[u, v]| Vector3::new((u - ppx) / f, (v - ppy) / f, 1.0))
        .collect()
}

/// Part of image `a`, on the plane z = 0, that image `b` sees too; `None` when `a` does not look at the plane.
fn shared(a: &Image, rays: &[Vector3<f64>], b: &Image, camera: &Camera) -> Option<f64> {
    let to_world = a.pose.rotation.inverse();
    mean(rays.iter().filter_map(|ray| {
        let ray = to_world * ray;
        let scale = -a.pose.centre.z / ray.z;
        if !scale.is_finite() || scale <= 0.0 {
            return None;
        }
        let point = fraser::project(&camera.interior, b.pose.cam_from_world(&(a.pose.centre + ray * scale)).into());
        let inside = |value: f64, size: u32| value >= 0.0 && value <= f64::from(size);
        let seen = point.is_some_and(|[x, y]| inside(x, camera.width_px) && inside(y, camera.height_px));
        Some(f64::from(u8::from(seen)))
    }))
}
