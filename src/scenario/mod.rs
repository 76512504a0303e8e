//! Simulated blocks: what a flight over a terrain would have measured, without errors.
//!
//! A [`Scenario`] is a TOML file: cameras, terrain, flights, tie points, surveyed points. Its
//! images can also be those of a flight-planning program: [`mission`]. Presets are such files inside
//! the binary ([`preset_names`]). [`simulate`] makes a [`Simulation`] of it; [`twin_of`] makes one of a real block.
//!
//! What the simulation states and leaves out:
//! - World axes are x east, y north, z up. The terrain's long axis is north-south through the origin.
//! - A nadir image has its y axis against the heading and its x axis to the right of it (long side across track), or
//!   with `long_side = "along"` its x axis along the heading.
//! - A point is seen where it is in front of the camera, at least [`SENSOR_MARGIN_PX`] inside the sensor, inside the
//!   domain where the distortion is monotonic, and where the surface faces the camera (at most [`MAX_INCIDENCE_DEG`]
//!   off its normal). Occlusion of one part of the terrain by another is ignored: the terrain is gentle.
//! - The GNSS antenna stands in the projection centre.
//! - Every object has a random stream of its own, so results do not depend on the number of threads.

mod course;
mod description;
mod dials;
mod draft;
pub mod extras;
mod flight;
mod image_sets;
pub mod mission;
mod noise;
mod overlap;
mod preset;
mod random;
mod simulate;
mod strips;
mod terrain;
mod twin;
mod validate;
mod visibility;

pub use description::{
    CameraModel, Control, Detection, GnssModel, Parameter, Points, Scenario, SigmaModel, Surveyed, Temperature,
    Terrain, Ties,
};
pub use dials::Dial;
pub use image_sets::{Flight, LongSide, Ring, Route};
pub use noise::{Perturbation, SurveyNoise, add_noise, add_stated_noise, add_survey_noise};
pub use overlap::{Dropped, FlightOverlap, OverlapReport};
pub use preset::{preset_names, preset_text};
pub use simulate::simulate;
pub use twin::twin_of;
pub use visibility::{MAX_INCIDENCE_DEG, SENSOR_MARGIN_PX};

use crate::block::Block;

/// A simulated block with the truth it was made from.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// The measurements, with approximations that equal the truth until they are perturbed.
    pub block: Block,
    /// True cameras, poses, points and antenna positions; no measurements.
    pub truth: Block,
    /// Overlap and multiplicity that result.
    pub report: OverlapReport,
}

/// Why a scenario cannot be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScenarioError {
    /// The text is not a scenario; the message has line and column.
    #[error("{file}: {message}")]
    Toml {
        /// File or preset.
        file: String,
        /// The parser's message.
        message: String,
    },
    /// A value is out of its range.
    #[error("{scenario}: {key} = {value}: expected {expected}")]
    Value {
        /// Scenario's name.
        scenario: String,
        /// Dotted path of the value.
        key: String,
        /// What stands there.
        value: String,
        /// What may stand there.
        expected: String,
    },
    /// No preset of this name.
    #[error("unknown preset \"{name}\": expected one of {}", preset_names().join(", "))]
    UnknownPreset {
        /// The name asked for.
        name: String,
    },
    /// The scenario has no such parameter.
    #[error("{scenario} has no parameter \"{name}\": expected {known}")]
    UnknownParameter {
        /// Scenario.
        scenario: String,
        /// The name asked for.
        name: String,
        /// The parameters it has.
        known: String,
    },
    /// A kind of point is seen by too few images wherever it is put.
    #[error("{scenario}: no place found for {what}: none of {attempts} is seen by {images} images")]
    Unseen {
        /// Scenario.
        scenario: String,
        /// Kind of point.
        what: &'static str,
        /// Places that were tried.
        attempts: usize,
        /// Images needed.
        images: usize,
    },
    /// Images of a flight that share no ground with the next one.
    #[error(
        "{scenario}: no image of flight {flight} shares ground with the next one of its strip. They are {base_m:.0} m \
         apart, and an image is {length_m:.0} m long on the ground: fly higher, or take images more often"
    )]
    Gaps {
        /// Scenario.
        scenario: String,
        /// Name.
        flight: String,
        /// Mean distance of successive images, m.
        base_m: f64,
        /// Nominal footprint along the track, m.
        length_m: f64,
    },
    /// Not a usable argument of a function.
    #[error("{what} = {value}: expected {expected}")]
    Argument {
        /// Name.
        what: &'static str,
        /// Value given.
        value: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// A block of which no twin can be made.
    #[error("block {block}: {message}")]
    Twin {
        /// Block's name.
        block: String,
        /// What is missing.
        message: String,
    },
}

/// Result of this module.
pub type Result<T> = std::result::Result<T, ScenarioError>;
