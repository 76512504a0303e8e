//! What each measurement has of `v'Pv`.

use super::fit::Fit;
use crate::measure::{MeasureError, Predictor};
use crate::problem::{PositionObservation, Problem, State};
use nalgebra::Vector3;

/// Tells point, image and standardised squared residual of every image measurement of a fit, in the order of its
/// problem; robust weights not applied. What the state holds but cannot be predicted is left out, as it is in the fit.
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

/// What surveyed coordinates, those of control and of antennas, have of `v'Pv`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Surveyed {
    /// Sum of their standardised squares.
    pub chi_square: f64,
    /// Their number.
    pub count: f64,
}

impl Surveyed {
    /// At a state.
    ///
    /// # Errors
    /// A state of which an image cannot be prepared.
    pub fn at(problem: &Problem, state: &State) -> Result<Self, MeasureError> {
        let predictor = Predictor::new(problem, state)?;
        let control = problem.control.iter().filter_map(|own| of_control(&predictor, state, own));
        let gnss = problem.gnss.iter().filter_map(|own| of_antenna(&predictor, own));
        let add = |sum: Self, off: Vector3<f64>| Self {
            chi_square: sum.chi_square + off.norm_squared(),
            count: sum.count + off.len() as f64,
        };
        Ok(control.chain(gnss).fold(Self::default(), add))
    }
}

/// Standardised residual of a surveyed point.
pub fn of_control(predictor: &Predictor<'_>, state: &State, observed: &PositionObservation) -> Option<Vector3<f64>> {
    let predicted = predictor.surveyed(&state.points[observed.index as usize])?;
    Some((observed.position - predicted).component_div(&observed.sigma))
}

/// Standardised residual of an antenna position.
pub fn of_antenna(predictor: &Predictor<'_>, observed: &PositionObservation) -> Option<Vector3<f64>> {
    Some((observed.position - predictor.antenna(observed.index as usize)?).component_div(&observed.sigma))
}
