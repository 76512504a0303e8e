//! Observed constants of the block and of its images, as effects see them.

use super::PositionObservation;
use super::velocities::velocities;
use crate::block::Block;
use crate::effects::{BlockContext, ImageContext};
use nalgebra::Vector3;

fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count();
    if n == 0 { f64::NAN } else { values.sum::<f64>() / n as f64 }
}

fn mean_point<'a>(points: impl Iterator<Item = &'a Vector3<f64>>) -> Vector3<f64> {
    let (sum, n) = points.fold((Vector3::zeros(), 0usize), |(sum, n), point| (sum + point, n + 1));
    if n == 0 { Vector3::zeros() } else { sum / n as f64 }
}

/// Mean of the control points that take part; without any, of the antennas that do; zero without either, where no
/// effect needs it.
pub fn survey_centre(control: &[PositionObservation], gnss: &[PositionObservation]) -> Vector3<f64> {
    let observed = if control.is_empty() { gnss } else { control };
    mean_point(observed.iter().map(|observation| &observation.position))
}

/// Constants of the block. The survey's centre is zero until the datum is known: [`survey_centre`].
pub fn block_context(block: &Block) -> BlockContext {
    let mut history: Vec<[f64; 2]> =
        block.images.iter().filter_map(|image| Some([image.time_s?, image.temperature_c?])).collect();
    history.sort_by(|a, b| a[0].total_cmp(&b[0]));
    BlockContext {
        centre: mean_point(block.images.iter().map(|image| &image.pose.centre)),
        survey_centre: Vector3::zeros(),
        counts: [block.images.len() as u32, block.flights.len() as u32, block.cameras.len() as u32],
        mean_temperature_c: mean(block.images.iter().filter_map(|image| image.temperature_c)),
        temperature_history: history,
    }
}

/// Constants of every image, with the projection centres that give velocities where none was measured.
pub fn image_contexts(block: &Block, centres: &[Vector3<f64>]) -> Vec<ImageContext> {
    let times = || block.images.iter().filter_map(|image| image.time_s);
    let span = |first: f64, last: f64| last - first;
    let first = times().fold(f64::INFINITY, f64::min);
    let last = times().fold(f64::NEG_INFINITY, f64::max);
    let mean_time = mean(times());
    let n = block.images.len();
    let flight_times = |flight: usize| {
        let own = block.images.iter().filter(move |image| image.flight.index() == flight);
        let times = own.filter_map(|image| image.time_s);
        times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)))
    };
    let flights: Vec<(f64, f64)> = (0..block.flights.len()).map(flight_times).collect();
    let (velocities, sigmas) = velocities(block, centres);
    block
        .images
        .iter()
        .enumerate()
        .map(|(i, image)| {
            let camera = &block.cameras[image.camera.index()];
            let time = image.time_s.unwrap_or(f64::NAN);
            let (flight_first, flight_last) = flights[image.flight.index()];
            // One image, or all at one instant: nothing changes with time.
            let along = |value: f64, centre: f64, span: f64| if span > 0.0 { (value - centre) / span } else { 0.0 };
            ImageContext {
                image: i as u32,
                flight: image.flight.0,
                camera: image.camera.0,
                width_px: f64::from(camera.width_px),
                height_px: f64::from(camera.height_px),
                time_s: time,
                tau: if time.is_nan() { f64::NAN } else { along(time, mean_time, span(first, last)) },
                tau_order: along(i as f64, (n as f64 - 1.0) / 2.0, n as f64 - 1.0),
                flight_time_s: time - flight_first,
                flight_span_s: span(flight_first, flight_last),
                temperature_c: image.temperature_c.unwrap_or(f64::NAN),
                velocity: velocities[i],
                velocity_sigma: sigmas[i],
                angular_velocity: image.angular_velocity.unwrap_or_else(Vector3::zeros),
                exposure_s: image.exposure_s.unwrap_or(f64::NAN),
                focus_m: image.focus_m.unwrap_or(f64::NAN),
            }
        })
        .collect()
}
