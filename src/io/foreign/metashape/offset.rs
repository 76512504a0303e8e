//! Where a sensor stands in its rig, as the XML has it.

use super::super::super::error::Error;
use super::super::pose;
use super::super::xml::Element;
use nalgebra::{Matrix3, Vector3};

/// Camera to chunk, or camera to master: rotation and projection centre.
pub(super) type Placed = (Matrix3<f64>, Vector3<f64>);

/// Rotation to the camera axes of the master sensor, and projection centre in these. `None` where they are not stated:
/// the elements are there and empty for a sensor of no rig.
pub(super) fn offset(sensor: Element<'_>) -> Result<Option<Placed>, Error> {
    let stated = |name| sensor.optional(name).filter(|part| !part.text().is_empty());
    let (Some(rotation), Some(location)) = (stated("rotation"), stated("location")) else { return Ok(None) };
    let matrix = Matrix3::from_row_slice(&rotation.numbers::<9>()?);
    match pose::from_matrix(&matrix) {
        // As it stands: it is multiplied with others.
        Some(_) => Ok(Some((matrix, location.numbers::<3>()?.into()))),
        None => Err(rotation.refuse("<rotation> of the sensor is no rotation")),
    }
}
