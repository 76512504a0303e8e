//! The observations of a block: image measurements by point, control coordinates, GNSS positions.

use super::{ImageObservation, MeasurementKind, PointSource, PositionObservation};
use crate::block::{Block, ByPoint, Image, Measurement, PointId, Role};
use crate::model::{FlightFactors, Model, SigmaFactors, TieWeights};
use nalgebra::Vector3;

/// Rays that intersect in a tie point.
const FEWEST_RAYS: usize = 2;

/// The points that take part and their measurements.
pub(super) struct Points {
    pub sources: Vec<PointSource>,
    /// Measurements of point `j`: `observations[starts[j]..starts[j + 1]]`.
    pub starts: Vec<usize>,
    pub observations: Vec<ImageObservation>,
}

impl Points {
    fn with_capacity(points: usize, measurements: usize) -> Self {
        let mut starts = Vec::with_capacity(points + 1);
        starts.push(0);
        Self { sources: Vec::with_capacity(points), starts, observations: Vec::with_capacity(measurements) }
    }

    /// Each with its measurements.
    pub fn iter(&self) -> impl Iterator<Item = (PointSource, &[ImageObservation])> {
        let rows = self.starts.windows(2).map(|ends| &self.observations[ends[0]..ends[1]]);
        self.sources.iter().copied().zip(rows)
    }

    fn push(&mut self, source: PointSource, observations: impl Iterator<Item = ImageObservation>, ranks: &[u32]) {
        let first = self.observations.len();
        self.observations.extend(observations);
        self.observations[first..].sort_by_key(|o| ranks[o.image as usize]);
        self.sources.push(source);
        self.starts.push(self.observations.len());
    }

    /// Leaves the measurements that are `kept`, and the points that still can take part: of a tie point two rays, of a
    /// control point one.
    pub fn keep(&mut self, kept: impl Fn(&ImageObservation) -> bool) {
        let mut left = Self::with_capacity(self.sources.len(), self.observations.len());
        for (source, rows) in self.iter() {
            let first = left.observations.len();
            left.observations.extend(rows.iter().filter(|row| kept(row)));
            let fewest = match source {
                PointSource::Tie(_) => FEWEST_RAYS,
                PointSource::Control(_) => 1,
            };
            if left.observations.len() < first + fewest {
                left.observations.truncate(first);
                continue;
            }
            left.sources.push(source);
            left.starts.push(left.observations.len());
        }
        *self = left;
    }
}

pub(super) fn point_name(block: &Block, source: PointSource) -> String {
    match source {
        PointSource::Tie(id) => block.tie_points[id.index()].name.clone(),
        PointSource::Control(id) => block.surveyed[id.index()].name.clone(),
    }
}

/// Tie points with two rays or more in order along the block, then control points.
pub(super) fn collect_points(block: &Block, model: &Model, uses_control: bool, ranks: &[u32]) -> Points {
    let flights = flight_factors(block, model);
    let factor =
        |row: &Measurement| model.sigma_factors.image * flights[block.images[row.image.index()].flight.index()].image;
    let mark = model.sigma_factors.mark;
    let ties = ByPoint::new(&block.ties, block.tie_points.len());
    let mut order: Vec<(u32, u32, PointId)> = (0..ties.points())
        .map(PointId::from)
        .filter(|id| ties.count(*id) >= FEWEST_RAYS)
        .map(|id| {
            let span = |(first, last): (u32, u32), rank: u32| (first.min(rank), last.max(rank));
            let ranks = ties.of(id).map(|m| ranks[block.ties[m].image.index()]);
            let (first, last) = ranks.fold((u32::MAX, 0), span);
            (first, last, id)
        })
        .collect();
    order.sort_unstable();
    let marks = if uses_control { block.marks.len() } else { 0 };
    let mut points = Points::with_capacity(order.len() + block.surveyed.len(), block.ties.len() + marks);
    for (_, _, id) in order {
        let m = ties.count(id) as f64;
        let weight = match model.tie_weights {
            TieWeights::Unit => 1.0,
            TieWeights::Multi => m * (m - 1.0),
            TieWeights::Pairs => m * (m - 1.0) * (m - 1.0),
        };
        let root = weight.sqrt();
        let rows = ties.of(id).map(|m| &block.ties[m]);
        let rows = rows.map(|row| observation(row, MeasurementKind::Tie, block.sigma.tie_px, root / factor(row)));
        points.push(PointSource::Tie(id), rows, ranks);
    }
    if uses_control {
        let marks = ByPoint::new(&block.marks, block.surveyed.len());
        for id in (0..marks.points()).map(PointId::from) {
            if block.surveyed[id.index()].role != Role::Control || marks.count(id) == 0 {
                continue;
            }
            let rows = marks.of(id).map(|m| &block.marks[m]);
            let rows = rows
                .map(|row| observation(row, MeasurementKind::Mark, block.sigma.mark_px, 1.0 / (mark * factor(row))));
            points.push(PointSource::Control(id), rows, ranks);
        }
    }
    points
}

/// Factors of each flight.
fn flight_factors(block: &Block, model: &Model) -> Vec<FlightFactors> {
    block.flights.iter().map(|name| model.flight_factors.get(name).copied().unwrap_or_default()).collect()
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
    points: &[PointSource],
    factors: &SigmaFactors,
) -> Vec<PositionObservation> {
    let observed = |(j, source): (usize, &PointSource)| match source {
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
