//! What each image measurement has of `v'Pv`.

use crate::measure::{MeasureError, Predictor};
use crate::run::fit::Fit;

/// Tells point, image and standardised squared residual of every image measurement of a fit, in the order of its problem; robust weights not
/// applied. What the state holds but cannot be predicted is left out, as it is in the fit.
///
/// # Errors
/// A state of which an image cannot be prepared.
pub fn each(fit: &Fit, mut tell: impl FnMut(usize, usize, f64)) -> Result<(), MeasureError> {
    let Fit { problem, solution, .. } = fit;
    Predictor::new(problem, &solution.state)?.each_measurement(|point, seen, predicted| {
        if let Some(([x, y], _)) = predicted {
            let squared_px = (seen.x - x).powi(2) + (seen.y - y).powi(2);
            tell(point, seen.image as usize, squared_px * seen.inverse_sigma.powi(2));
        }
    });
    Ok(())
}
