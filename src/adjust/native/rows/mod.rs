//! Rows of the design matrix for the measurements of some points, weighted and scaled, as the sums over them need it:
//! whole vectors, one row of the border and one of the image's unknowns for each coordinate.

mod fill;
mod spread;

use super::aligned::Aligned;
use super::loss::Curvature;
use super::point::Prepared;
use super::side_by_side::Workspace;
use super::structure::{FIRST_THETA, NONE, Structure};
use crate::math::lane::{LANES, Lane};
use crate::math::vectors::dispatch;
use crate::measure::{self, MeasureError};
use crate::problem::Problem;
use fill::FillMeasured;
pub use spread::Contents;
use std::iter::Zip;
use std::ops::Range;
use std::slice::{ChunksExact, Iter};

/// Measurements of a batch: their rows stay in the nearest cache.
const BATCH_MEASUREMENTS: usize = 64;
/// Where the derivatives of a pair's second coordinate by the point begin in [`Rows::by_point`]; those of the first
/// begin at zero.
pub const SECOND: usize = LANES / 2;

/// Rows of the measurements of some points, in pairs: x and y of an image measurement; of a surveyed point x and y,
/// then z and nothing.
pub struct Rows {
    /// Numbers of a row of the border: its columns, zeros and the misclosure.
    pub width: usize,
    /// Numbers of a row of an image's unknowns: the unknowns, and zeros.
    pub stride: usize,
    /// Two rows of the border for each pair.
    pub shared: Aligned,
    /// Two rows of the image for each pair.
    pub image: Aligned,
    /// Of each pair, by the point: three numbers of the first coordinate, and from [`SECOND`] on three of the second.
    pub by_point: Vec<Lane>,
    /// Rank of each pair's image; [`NONE`] for surveyed coordinates.
    pub rank: Vec<u32>,
    /// Pairs of each point.
    pub points: Vec<OfPoint>,
    /// `sum rho`.
    pub chi_square: f64,
    curvature: Curvature,
    contents: Contents,
}

/// Pairs of a point.
#[derive(Debug, Clone)]
pub struct OfPoint {
    /// Position of the point in the problem.
    pub number: usize,
    /// Its image measurements.
    pub measured: Range<usize>,
    /// Its surveyed coordinates.
    pub surveyed: Range<usize>,
}

/// Points in groups of some measurements each.
pub fn batches(problem: &Problem, points: &Range<usize>) -> Vec<Range<usize>> {
    let starts = &problem.point_start;
    let (mut batches, mut first) = (Vec::new(), points.start);
    while first < points.end {
        let fits = starts[first..=points.end].partition_point(|start| *start <= starts[first] + BATCH_MEASUREMENTS);
        let end = first + fits.saturating_sub(1).max(1);
        batches.push(first..end);
        first = end;
    }
    batches
}

impl Rows {
    /// Room for a batch.
    pub fn new(structure: &Structure, curvature: Curvature) -> Self {
        let (width, stride) = (structure.width, structure.stride);
        Self {
            width,
            stride,
            shared: Aligned::zeros(0),
            image: Aligned::zeros(0),
            by_point: Vec::new(),
            rank: Vec::new(),
            points: Vec::new(),
            chi_square: 0.0,
            curvature,
            contents: Contents::new(structure),
        }
    }

    /// Row of the border of a pair's first or second coordinate.
    #[inline(always)]
    pub fn shared_row(&self, pair: usize, i: usize) -> &[f64] {
        &self.shared[(2 * pair + i) * self.width..][..self.width]
    }

    /// Of each of some pairs: both rows of the border, one behind the other, and what is by the point.
    #[inline(always)]
    pub fn shared_and_points(&self, pairs: &Range<usize>) -> Zip<ChunksExact<'_, f64>, Iter<'_, Lane>> {
        let shared = self.shared[2 * pairs.start * self.width..2 * pairs.end * self.width].chunks_exact(2 * self.width);
        shared.zip(&self.by_point[pairs.clone()])
    }

    /// Row of the image's unknowns.
    #[inline(always)]
    pub fn image_row(&self, pair: usize, i: usize) -> &[f64] {
        &self.image[(2 * pair + i) * self.stride..][..self.stride]
    }

    /// Linearises some points. Errors: an observation that cannot be computed.
    pub fn fill(&mut self, at: &Prepared<'_>, points: Range<usize>, work: &mut Workspace) -> Result<(), MeasureError> {
        let Prepared { problem, .. } = at;
        let starts = &problem.point_start;
        let measurements = starts[points.start]..starts[points.end];
        let controls = problem.control.partition_point(|c| (c.index as usize) < points.start)
            ..problem.control.partition_point(|c| (c.index as usize) < points.end);
        self.clear(measurements.len(), measurements.len() + 2 * controls.len());
        self.rank.resize(measurements.len() + 2 * controls.len(), NONE);
        let mut surveyed = measurements.len();
        for j in points.clone() {
            let has = problem.control[controls.clone()].binary_search_by_key(&(j as u32), |c| c.index).is_ok();
            let end = surveyed + if has { 2 } else { 0 };
            let measured = starts[j] - measurements.start..starts[j + 1] - measurements.start;
            self.points.push(OfPoint { number: j, measured, surveyed: surveyed..end });
            surveyed = end;
        }
        dispatch(FillMeasured { rows: self, at, points, work })?;
        for (c, pair) in controls.zip((measurements.len()..).step_by(2)) {
            self.fill_surveyed(at, c, pair)?;
        }
        Ok(())
    }

    /// Room for so many pairs; zeros in the rows behind those of image measurements, which are filled as a whole.
    fn clear(&mut self, measured: usize, pairs: usize) {
        if self.shared.len() < 2 * pairs * self.width {
            self.shared = Aligned::zeros(2 * pairs * self.width);
            self.image = Aligned::zeros(2 * pairs * self.stride);
        } else {
            self.shared[2 * measured * self.width..2 * pairs * self.width].fill(0.0);
        }
        self.by_point.clear();
        self.by_point.resize(pairs, Lane::default());
        self.rank.clear();
        self.points.clear();
        self.chi_square = 0.0;
    }

    /// Rows of the surveyed coordinates number `c`, in two pairs.
    fn fill_surveyed(&mut self, at: &Prepared<'_>, c: usize, pair: usize) -> Result<(), MeasureError> {
        let Prepared { problem, structure, state, .. } = at;
        let observation = &problem.control[c];
        let j = observation.index as usize;
        let p = measure::predict_surveyed(problem, &structure.stages, &state.theta, &state.points[j])
            .ok_or_else(|| MeasureError::surveyed(problem, j))?;
        let width = self.width;
        for i in 0..3 {
            let weight = 1.0 / observation.sigma[i];
            let row = &mut self.shared[(2 * pair + i) * width..][..width];
            // Control effects have no image of their own: any image's list of global parameters serves.
            for column in structure.local.first().into_iter().flatten().filter(|column| column.source >= FIRST_THETA) {
                let d = p.d_theta[(column.source - FIRST_THETA) as usize][i];
                row[column.column as usize] = d * weight * column.scale;
            }
            let v = (observation.position[i] - p.position[i]) * weight;
            row[width - 1] = v;
            let by_point = &mut self.by_point[pair + i / 2][SECOND * (i % 2)..];
            for k in 0..3 {
                by_point[k] = p.derivative[(i, 3 + k)] * weight;
            }
            self.chi_square += v * v;
        }
        Ok(())
    }
}
