//! GNSS positions against the adjusted block: computed minus measured, m.

use crate::block::{Block, ImageId};
use crate::evaluate::{Comparison, Similarity};
use crate::measure::{MeasureError, Predictor};
use crate::problem::{Problem, State};
use nalgebra::Vector3;

/// A measured antenna position against the adjusted image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GnssResidual {
    /// Image.
    pub image: ImageId,
    /// Computed minus measured, m.
    pub d: Vector3<f64>,
    /// Measured, m.
    pub position: Vector3<f64>,
    /// Time of exposure, s; NaN where not known.
    pub time_s: f64,
    /// Heading of the platform from north to east, degrees from 0 to 360; NaN where not known.
    pub heading_deg: f64,
}

/// The antenna positions that the model predicts against those that were measured, whether or not they took part in the
/// adjustment, of every image that did. None where nothing brings the block into the survey's system: a free datum
/// without a similarity.
///
/// # Errors
/// A state at which images cannot be predicted.
pub fn gnss_residuals(
    block: &Block,
    problem: &Problem,
    state: &State,
    comparison: Option<&Comparison>,
) -> Result<Vec<GnssResidual>, MeasureError> {
    let similarity = comparison.and_then(|comparison| comparison.similarity);
    let has_datum = !problem.control.is_empty() || !problem.gnss.is_empty();
    if !has_datum && similarity.is_none() {
        return Ok(Vec::new());
    }
    let alignment = similarity.unwrap_or_else(Similarity::identity);
    let mut took_part = vec![false; block.images.len()];
    problem.observations.iter().for_each(|row| took_part[row.image as usize] = true);
    let predictor = Predictor::new(problem, state)?;
    let contexts = &problem.image_contexts;
    let mut rows = Vec::new();
    for (i, image) in block.images.iter().enumerate().filter(|(i, _)| took_part[*i]) {
        let Some(gnss) = image.gnss else { continue };
        let computed = predictor.antenna(i).ok_or_else(|| MeasureError::antenna(problem, i))?;
        let velocity = contexts[i].velocity;
        rows.push(GnssResidual {
            image: i.into(),
            d: alignment.apply(&computed) - gnss.position,
            position: gnss.position,
            time_s: contexts[i].time_s,
            heading_deg: heading_deg(&velocity),
        });
    }
    Ok(rows)
}

/// RMS in space, m; `None` without any.
pub fn gnss_rms_m(rows: &[GnssResidual]) -> Option<f64> {
    let squares: f64 = rows.iter().map(|row| row.d.norm_squared()).sum();
    (!rows.is_empty()).then(|| (squares / rows.len() as f64).sqrt())
}

/// Heading of a velocity from north to east, degrees from 0 to 360; NaN where it is not known.
pub fn heading_deg(velocity: &Vector3<f64>) -> f64 {
    velocity.x.atan2(velocity.y).to_degrees().rem_euclid(360.0)
}
