//! The causes, one file each, and their order.

use super::parameters::{DefaultValue, parameter};
use super::{Action, Cause, Observations, Prepared, Random, Setting, World};
use crate::camera::{Camera, DCX, DCY, F, Interior, PPX, PPY};
use anyhow::{Result, ensure};

mod calibration;
mod control_blunder;
mod decentring_high;
mod earth_curvature;
mod exact_marks;
mod flat_port;
mod focal_growth;
mod focal_steps;
mod focus_hunting;
mod forward_motion;
mod gnss_delay;
mod gnss_drift;
mod gnss_lever_arm;
mod gnss_shift;
mod homothety;
mod lens_sag;
mod local_flaw;
mod map_frame;
mod map_scale;
mod noise;
mod outliers;
mod pp_drift;
mod pp_steps;
mod radial_high;
mod refraction;
mod rolling_shutter;
mod sensor_jitter;
mod sensor_stitch;
mod start;
mod temperature_focal;
mod unflatness;
mod vibration;

/// Every cause, in the order in which they act.
pub(super) static REGISTRY: &[&Cause] = &[
    // Starting values.
    &calibration::CAUSE,
    &start::CAUSE,
    // Between the object and the lens.
    &refraction::CAUSE,
    &flat_port::CAUSE,
    // While the image is taken.
    &rolling_shutter::CAUSE,
    &forward_motion::CAUSE,
    &vibration::CAUSE,
    // The lens, which is another one in every image.
    &temperature_focal::CAUSE,
    &focal_growth::CAUSE,
    &focal_steps::CAUSE,
    &focus_hunting::CAUSE,
    &pp_drift::CAUSE,
    &pp_steps::CAUSE,
    &sensor_jitter::CAUSE,
    &lens_sag::CAUSE,
    // From the lens to the pixel.
    &radial_high::CAUSE,
    &decentring_high::CAUSE,
    &unflatness::CAUSE,
    &homothety::CAUSE,
    &local_flaw::CAUSE,
    &sensor_stitch::CAUSE,
    // The receiver and the survey.
    &gnss_delay::CAUSE,
    &gnss_lever_arm::CAUSE,
    &gnss_shift::CAUSE,
    &gnss_drift::CAUSE,
    &earth_curvature::CAUSE,
    &map_scale::CAUSE,
    &control_blunder::CAUSE,
    // The measurements themselves, noise last.
    &exact_marks::CAUSE,
    &outliers::CAUSE,
    &noise::CAUSE,
];

/// The action, or nothing when its size is zero.
fn unless(zero: bool, action: impl Action + 'static) -> Prepared {
    Ok((!zero).then(|| Box::new(action) as Box<dyn Action>))
}

/// Moves principal point and centre of distortion together: the sensor moves, the lens stays as it is.
fn shift_sensor(interior: &mut Interior, dx: f64, dy: f64) {
    interior[PPX] += dx;
    interior[PPY] += dy;
    interior[DCX] += dx;
    interior[DCY] += dy;
}

/// Distance from the centre of distortion to the farthest corner of the sensor, px.
fn corner_radius(camera: &Camera) -> f64 {
    let (dcx, dcy) = (camera.interior[DCX], camera.interior[DCY]);
    let farthest = |centre: f64, size: u32| centre.abs().max((f64::from(size) - centre).abs());
    farthest(dcx, camera.width_px).hypot(farthest(dcy, camera.height_px))
}

/// Progress of each image through the block, 0 for the first and 1 for the last: by `time`, or by `order` in the table.
fn progress(world: &World, against: &str) -> Result<Vec<f64>> {
    let times = if against == "order" { (0..world.images.len()).map(|n| n as f64).collect() } else { world.times()? };
    let first = times.iter().copied().fold(f64::INFINITY, f64::min);
    let last = times.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    ensure!(last > first, "all images have the same time");
    Ok(times.into_iter().map(|time| (time - first) / (last - first)).collect())
}

/// One value per flight: as listed, or normal with standard deviation `size` and zero for the first flight.
fn steps_by_flight(list: Option<&[f64]>, size: f64, world: &World, random: &mut Random) -> Result<Vec<f64>> {
    let flights = world.flights.len();
    if let Some(list) = list {
        ensure!(list.len() == flights, "{} values are listed, the block has {flights} flights", list.len());
        return Ok(list.to_vec());
    }
    Ok((0..flights).map(|flight| if flight == 0 { 0.0 } else { size * random.normal() }).collect())
}

/// Notes of one value per flight.
fn notes_by_flight(world: &World, what: &str, unit: &str, values: &[f64]) -> Vec<(String, String)> {
    let note = |(flight, value): (&String, &f64)| (format!("{what}[{flight}]"), format!("{value} {unit}"));
    world.flights.iter().zip(values).map(note).collect()
}

/// Index of an image by name.
fn image_named(world: &World, name: &str) -> Result<usize> {
    let found = world.images.iter().position(|image| image.name == name);
    found.ok_or_else(|| anyhow::anyhow!("the block has no image `{name}`"))
}
