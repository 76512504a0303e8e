//! The layout of a flight's strips: lengths, distances, numbers of images.

use super::description::Scenario;
use super::image_sets::{Flight, LongSide};

/// Nadir footprint on z = 0 across and along the track, m.
pub(super) fn footprint(scenario: &Scenario, flight: &Flight) -> [f64; 2] {
    // Validated: the camera exists.
    let camera = &scenario.cameras[scenario.camera_index(flight.camera.as_deref()).unwrap_or(0)];
    let scale = flight.height_m / camera.f;
    let [width, height] = [f64::from(camera.width_px) * scale, f64::from(camera.height_px) * scale];
    match flight.long_side {
        LongSide::Across => [width, height],
        LongSide::Along => [height, width],
    }
}

/// Distance of the strips, m.
pub(super) fn strip_spacing(scenario: &Scenario, flight: &Flight) -> f64 {
    let across = footprint(scenario, flight)[0];
    flight.strip_spacing_m.or(flight.side_overlap.map(|overlap| (1.0 - overlap) * across)).unwrap_or(0.0)
}

/// Length of the strips, m.
pub(super) fn strip_length(scenario: &Scenario, flight: &Flight) -> f64 {
    let [length, width, _] = scenario.terrain.extent();
    let (sin, cos) = flight.heading_deg.to_radians().sin_cos();
    flight.length_m.unwrap_or(length * cos.abs() + width * sin.abs())
}

/// Strips of a flight; a float, so that no number is too large to be refused.
fn strips_by_overlap(scenario: &Scenario, flight: &Flight) -> f64 {
    if flight.side_overlap.is_none() {
        return 1.0;
    }
    let [length, width, _] = scenario.terrain.extent();
    let (sin, cos) = flight.heading_deg.to_radians().sin_cos();
    let across = length * sin.abs() + width * cos.abs();
    // A width that is a multiple of the distance to rounding needs no further strip.
    (across / strip_spacing(scenario, flight) - 1e-3).ceil().max(1.0)
}

/// Strips of a flight.
pub(super) fn strip_count(scenario: &Scenario, flight: &Flight) -> usize {
    flight.strips.unwrap_or_else(|| strips_by_overlap(scenario, flight) as usize)
}

/// Distance of the images of a strip, m, as the flight states it; `None` of single images.
pub(super) fn strip_base(scenario: &Scenario, flight: &Flight) -> Option<f64> {
    match (flight.forward_overlap, &flight.images) {
        (Some(overlap), _) => Some((1.0 - overlap) * footprint(scenario, flight)[1]),
        (None, Some(images)) => {
            let most = images.iter().max().filter(|count| **count > 1)?;
            Some(strip_length(scenario, flight) / (most - 1) as f64)
        }
        (None, None) => None,
    }
}

/// Images of a strip whose images follow from the overlap.
fn images_by_overlap(scenario: &Scenario, flight: &Flight) -> f64 {
    let base = (1.0 - flight.forward_overlap.unwrap_or(0.0)) * footprint(scenario, flight)[1];
    // Never less overlap than asked for; a length that is a multiple of the base to rounding needs no further image.
    (strip_length(scenario, flight) / base - 1e-3).ceil().max(0.0) + 1.0
}

/// Images of a strip.
pub(super) fn strip_images(scenario: &Scenario, flight: &Flight, strip: usize) -> usize {
    match &flight.images {
        Some(images) => images[strip],
        None => images_by_overlap(scenario, flight) as usize,
    }
}

/// Images of a flight; a float, so that no number is too large to be refused.
pub(super) fn image_count(scenario: &Scenario, flight: &Flight) -> f64 {
    match &flight.images {
        Some(images) => images.iter().map(|count| *count as f64).sum(),
        None => {
            let strips = flight.strips.map_or_else(|| strips_by_overlap(scenario, flight), |strips| strips as f64);
            strips * images_by_overlap(scenario, flight)
        }
    }
}
