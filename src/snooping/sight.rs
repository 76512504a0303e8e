//! A block's measurements at a solution, as the search for outliers sees them.

use super::lost::LostControl;
use super::majority::meeting;
use super::point::{Seen, SeenPoint};
use super::{Kept, Solved};
use crate::adjust::AdjustError;
use crate::block::{Block, ByPoint, Measurement, PointId};
use crate::measure::{ImagePoint, Predictor, Sighted};
use crate::problem::{MeasurementKind, PointSource, PositionObservation};
use nalgebra::{Matrix3, Vector2, Vector3};
use smallvec::SmallVec;

/// Rays of most points.
const FEW_RAYS: usize = 16;

/// A block's measurements at a solution, those left out included. Measurements have numbers: tie measurements in the
/// order of the block, then marks.
pub(super) struct Sight<'a> {
    block: &'a Block,
    left: &'a Kept,
    predictor: Predictor<'a>,
    /// Points with their coordinates: those of the problem, then those that take no part and are to be judged anew.
    points: Vec<(PointSource, Vector3<f64>)>,
    /// How many of them the problem has.
    taking_part: usize,
    /// Position of the first control point that takes no part, and the weights of these.
    first_control: usize,
    weights_of_lost: Vec<Vector3<f64>>,
    control: &'a [PositionObservation],
    ties: ByPoint,
    marks: ByPoint,
    /// Position in `points` of each tie point, and of each surveyed point.
    position: [Vec<Option<u32>>; 2],
    /// Images that take no part: their poses are what they were given as, and nothing can be judged by them.
    idle: Vec<bool>,
    /// Factor on the stated standard deviations of marks.
    of_marks: f64,
}

impl<'a> Sight<'a> {
    /// `lost`: tie points that take no part and are to be judged anew; `lost_control`: control points.
    pub(super) fn new(
        block: &'a Block,
        left: &'a Kept,
        lost: &[bool],
        lost_control: &[LostControl],
        fit: Solved<'a>,
    ) -> Result<Self, AdjustError> {
        let Solved { problem, state } = fit;
        let ties = ByPoint::new(&block.ties, block.tie_points.len());
        let idle = problem.unoriented_images();
        let mut points: Vec<_> = problem.point_sources.iter().copied().zip(state.points.iter().copied()).collect();
        for point in (0..lost.len()).filter(|point| lost[*point]).map(PointId::from) {
            let rows = ties.of(point).map(|m| &block.ties[m]);
            let rows: Vec<&Measurement> = rows.filter(|row| !idle[row.image.index()]).collect();
            if let Some(position) = meeting(block, state, &rows) {
                points.push((PointSource::Tie(point), position));
            }
        }
        let first_control = points.len();
        points.extend(lost_control.iter().map(|own| (PointSource::Control(own.point), own.place)));
        let mut position = [vec![None; block.tie_points.len()], vec![None; block.surveyed.len()]];
        for (j, (source, _)) in points.iter().enumerate() {
            match source {
                PointSource::Tie(id) => position[0][id.index()] = Some(j as u32),
                PointSource::Control(id) => position[1][id.index()] = Some(j as u32),
            }
        }
        Ok(Self {
            block,
            left,
            predictor: Predictor::new(problem, state)?,
            points,
            taking_part: problem.point_sources.len(),
            first_control,
            weights_of_lost: lost_control.iter().map(|own| own.weight).collect(),
            control: &problem.control,
            ties,
            marks: ByPoint::new(&block.marks, block.surveyed.len()),
            position,
            idle,
            of_marks: 1.0,
        })
    }

    /// Number of points, those that take no part and are to be judged anew included.
    pub(super) fn points(&self) -> usize {
        self.points.len()
    }

    /// Is point `j` a surveyed one, measured by marks?
    pub(super) fn is_marked(&self, j: usize) -> bool {
        matches!(self.points[j].0, PointSource::Control(_))
    }

    /// Multiplies the standard deviations of all marks.
    pub(super) fn take_marks_as_less_precise(&mut self, factor: f64) {
        self.of_marks = factor;
    }

    /// The measurements of point `j`.
    pub(super) fn point(&self, j: usize) -> SeenPoint {
        let (source, point) = &self.points[j];
        let (rows, first, sigma, factor) = match source {
            PointSource::Tie(id) => (self.ties.of(*id), 0, self.block.sigma.tie_px, 1.0),
            PointSource::Control(id) => {
                (self.marks.of(*id), self.block.ties.len(), self.block.sigma.mark_px, self.of_marks)
            }
        };
        let numbers = rows.map(|m| first + m).filter(|number| !self.idle[self.row(*number).image.index()]);
        let numbers: SmallVec<[usize; FEW_RAYS]> = numbers.collect();
        let sighted = numbers.iter().map(|number| Sighted { image: self.row(*number).image.index(), point: *point });
        let seen = |(number, predicted): (&usize, Option<ImagePoint>)| {
            let (number, row) = (*number, *self.row(*number));
            // What cannot be projected was left out before, or it could not have been adjusted.
            let (computed, by_point) = predicted?;
            let weight = 1.0 / (factor * row.sigma.unwrap_or(sigma));
            let active = self.is_in(number);
            Some(Seen {
                number,
                row,
                active,
                was_active: active,
                residual: Vector2::new(row.x - computed[0], row.y - computed[1]) * weight,
                by_point: by_point * weight,
                neighbours: None,
            })
        };
        let control = self.control.binary_search_by_key(&(j as u32), |observation| observation.index);
        let taking_part = control.ok().map(|c| self.control[c].sigma.map(|sigma| sigma.powi(-2)));
        let lost = j.checked_sub(self.first_control).map(|k| self.weights_of_lost[k]);
        let surveyed = Matrix3::from_diagonal(&taking_part.or(lost).unwrap_or_default());
        let seen = numbers.iter().zip(self.predictor.image_points(sighted)).filter_map(seen).collect();
        SeenPoint { seen, surveyed, lost: j >= self.taking_part }
    }

    /// Number of measurements, those of points that take no part included.
    pub(super) fn measurements(&self) -> usize {
        self.block.ties.len() + self.block.marks.len()
    }

    /// Number of images.
    pub(super) fn images(&self) -> usize {
        self.block.images.len()
    }

    /// A measurement.
    pub(super) fn row(&self, number: usize) -> &Measurement {
        match self.kind_and_measurement(number) {
            (MeasurementKind::Tie, m) => &self.block.ties[m],
            (MeasurementKind::Mark, m) => &self.block.marks[m],
        }
    }

    /// Was it in when the round began?
    pub(super) fn is_in(&self, number: usize) -> bool {
        let (kind, m) = self.kind_and_measurement(number);
        self.left.is_in(kind, m)
    }

    /// Position of the point of a measurement among the points; `None` where it or its image takes no part.
    pub(super) fn point_of(&self, number: usize) -> Option<usize> {
        let row = self.row(number);
        let of_kind = &self.position[self.kind_and_measurement(number).0 as usize];
        of_kind[row.point.index()].filter(|_| !self.idle[row.image.index()]).map(|j| j as usize)
    }

    /// Tie or mark, and its position among those of the block.
    pub(super) fn kind_and_measurement(&self, number: usize) -> (MeasurementKind, usize) {
        match number.checked_sub(self.block.ties.len()) {
            None => (MeasurementKind::Tie, number),
            Some(m) => (MeasurementKind::Mark, m),
        }
    }
}
