//! The observations of a block: image measurements by point, control coordinates, GNSS positions.

use super::{ImageObservation, MeasurementKind, PointSource, PositionObservation};
use crate::block::{Block, Image, Measurement, PointId, Role};
use crate::model::{FlightFactors, Model, SigmaFactors, TieWeights};
use nalgebra::Vector3;

/// A point and its measurements.
pub(super) struct PointRows {
    pub source: PointSource,
    pub observations: Vec<ImageObservation>,
}

pub(super) fn point_name(block: &Block, source: PointSource) -> String {
    match source {
        PointSource::Tie(id) => block.tie_points[id.index()].name.clone(),
        PointSource::Control(id) => block.surveyed[id.index()].name.clone(),
    }
}

/// Tie points with two rays or more in order along the block, then control points.
pub(super) fn collect_points(block: &Block, model: &Model, uses_control: bool, ranks: &[u32]) -> Vec<PointRows> {
    let flights = flight_factors(block, model);
    let factor =
        |row: &Measurement| model.sigma_factors.image * flights[block.images[row.image.index()].flight.index()].image;
    let ties = by_point(&block.ties, block.tie_points.len());
    let mut points: Vec<PointRows> = ties
        .into_iter()
        .enumerate()
        .filter(|(_, rows)| rows.len() > 1)
        .map(|(id, rows)| {
            let m = rows.len() as f64;
            let weight = match model.tie_weights {
                TieWeights::Unit => 1.0,
                TieWeights::Multi => m * (m - 1.0),
                TieWeights::Pairs => m * (m - 1.0) * (m - 1.0),
            };
            let mut observations: Vec<_> = rows
                .into_iter()
                .map(|row| observation(row, MeasurementKind::Tie, block.sigma.tie_px, weight.sqrt() / factor(row)))
                .collect();
            observations.sort_by_key(|o| ranks[o.image as usize]);
            PointRows { source: PointSource::Tie(PointId::from(id)), observations }
        })
        .collect();
    points.sort_by_key(|point| {
        let first = point.observations.first().map_or(0, |o| ranks[o.image as usize]);
        let last = point.observations.last().map_or(0, |o| ranks[o.image as usize]);
        (first, last)
    });
    if uses_control {
        for (id, rows) in by_point(&block.marks, block.surveyed.len()).into_iter().enumerate() {
            if block.surveyed[id].role != Role::Control || rows.is_empty() {
                continue;
            }
            let mut observations: Vec<_> = rows
                .into_iter()
                .map(|row| observation(row, MeasurementKind::Mark, block.sigma.mark_px, 1.0 / factor(row)))
                .collect();
            observations.sort_by_key(|o| ranks[o.image as usize]);
            points.push(PointRows { source: PointSource::Control(PointId::from(id)), observations });
        }
    }
    points
}

/// Factors of each flight.
fn flight_factors(block: &Block, model: &Model) -> Vec<FlightFactors> {
    block.flights.iter().map(|name| model.flight_factors.get(name).copied().unwrap_or_default()).collect()
}

fn by_point(measurements: &[Measurement], points: usize) -> Vec<Vec<&Measurement>> {
    let mut rows = vec![Vec::new(); points];
    for measurement in measurements {
        rows[measurement.point.index()].push(measurement);
    }
    rows
}

fn observation(row: &Measurement, kind: MeasurementKind, sigma: f64, root_weight: f64) -> ImageObservation {
    ImageObservation {
        image: row.image.0,
        kind,
        x: row.x,
        y: row.y,
        inverse_sigma: root_weight / row.sigma.unwrap_or(sigma),
    }
}

pub(super) fn control_observations(
    block: &Block,
    points: &[PointRows],
    factors: &SigmaFactors,
) -> Vec<PositionObservation> {
    let observed = |(j, point): (usize, &PointRows)| match point.source {
        PointSource::Tie(_) => None,
        PointSource::Control(id) => {
            let surveyed = &block.surveyed[id.index()];
            let xy = factors.control * surveyed.sigma_xy.unwrap_or(block.sigma.control_xy_m);
            let z = factors.control_z * surveyed.sigma_z.unwrap_or(block.sigma.control_z_m);
            Some(PositionObservation { index: j as u32, position: surveyed.position, sigma: Vector3::new(xy, xy, z) })
        }
    };
    points.iter().enumerate().filter_map(observed).collect()
}

/// Antenna positions of the images that take part.
pub(super) fn gnss_observations(block: &Block, pose_free: &[[bool; 6]], model: &Model) -> Vec<PositionObservation> {
    let (factors, flights) = (&model.sigma_factors, flight_factors(block, model));
    let observed = |(i, image): (usize, &Image)| {
        let gnss = image.gnss.filter(|_| pose_free[i] != [false; 6])?;
        let of_flight = &flights[image.flight.index()];
        let xy = factors.gnss * of_flight.gnss * gnss.sigma_xy.unwrap_or(block.sigma.gnss_xy_m);
        let z = factors.gnss_z * of_flight.gnss_z * gnss.sigma_z.unwrap_or(block.sigma.gnss_z_m);
        Some(PositionObservation { index: i as u32, position: gnss.position, sigma: Vector3::new(xy, xy, z) })
    };
    block.images.iter().enumerate().filter_map(observed).collect()
}
