//! The table of residuals of a run: observed minus computed, px.

use crate::block::{Block, ImageId, PointId};
use crate::evaluate::Comparison;
use crate::measure::{MeasureError, Predictor};
use crate::problem::{MeasurementKind, PointSource, Problem, State};

/// Kind of measurement, as in `residuals.csv`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResidualKind {
    /// Tie point.
    Tie,
    /// Mark of a surveyed point, in the adjustment or intersected after it.
    Mark,
}

/// One row of `residuals.csv`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualRow {
    /// Image.
    pub image: ImageId,
    /// Position of the point in the block: tie points for ties, surveyed points for marks.
    pub point: u32,
    /// Kind.
    pub kind: ResidualKind,
    /// Observed, px.
    pub observed: [f64; 2],
    /// Observed minus computed, px.
    pub residual: [f64; 2],
    /// A-priori standard deviation of each coordinate, px.
    pub sigma: f64,
}

/// Residuals of every measurement that took part, then those of marks of points that were only intersected.
pub fn residual_rows(
    block: &Block,
    problem: &Problem,
    state: &State,
    comparison: Option<&Comparison>,
) -> Result<Vec<ResidualRow>, MeasureError> {
    let predictor = Predictor::new(problem, state)?;
    let intersected = || comparison.iter().flat_map(|comparison| &comparison.intersections.points);
    let marks: usize = intersected().map(|point| point.measurements.len()).sum();
    let mut rows = Vec::with_capacity(problem.observations.len() + marks);
    let mut marked = vec![false; block.surveyed.len()];
    for source in problem.point_sources.iter() {
        if let PointSource::Control(id) = source {
            marked[id.index()] = true;
        }
    }
    predictor.each_measurement(|j, observation, predicted| {
        let (PointSource::Tie(PointId(point)) | PointSource::Control(PointId(point))) = problem.point_sources[j];
        let observed = [observation.x, observation.y];
        // The adjusted state projects every measurement; NaN would show otherwise.
        let computed = predicted.map_or([f64::NAN; 2], |(computed, _)| computed);
        rows.push(ResidualRow {
            image: ImageId(observation.image),
            point,
            kind: match observation.kind {
                MeasurementKind::Tie => ResidualKind::Tie,
                MeasurementKind::Mark => ResidualKind::Mark,
            },
            observed,
            residual: [observed[0] - computed[0], observed[1] - computed[1]],
            sigma: 1.0 / observation.inverse_sigma,
        });
    });
    for intersection in intersected() {
        if marked[intersection.point.index()] {
            continue;
        }
        for (m, residual) in intersection.measurements.iter().zip(&intersection.residuals) {
            let mark = &block.marks[*m];
            rows.push(ResidualRow {
                image: mark.image,
                point: mark.point.0,
                kind: ResidualKind::Mark,
                observed: [mark.x, mark.y],
                residual: [residual[0], residual[1]],
                sigma: mark.sigma.unwrap_or(block.sigma.mark_px),
            });
        }
    }
    Ok(rows)
}

/// RMS of tie residuals per coordinate, px. NaN without tie points.
pub fn tie_rms_px(block: &Block, problem: &Problem, state: &State) -> Result<f64, MeasureError> {
    Ok(tie_rms_of_rows(&residual_rows(block, problem, state, None)?).unwrap_or(f64::NAN))
}

/// RMS of tie residuals per coordinate, px: `sqrt(sum(rx^2 + ry^2) / (2 n))`; `None` without tie points.
pub(super) fn tie_rms_of_rows(rows: &[ResidualRow]) -> Option<f64> {
    let ties = rows.iter().filter(|row| row.kind == ResidualKind::Tie);
    let (mut n, mut sum) = (0usize, 0.0);
    for [x, y] in ties.map(|row| row.residual) {
        n += 1;
        sum += x.powi(2) + y.powi(2);
    }
    (n > 0).then(|| (sum / (2.0 * n as f64)).sqrt())
}
