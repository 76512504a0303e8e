//! Rotations, statistics, probabilities in words, smoothing, finite differences and small linear algebra; knows nothing
//! of images.

pub mod double_double;
pub mod finite_difference;
pub mod intersect;
pub mod jet;
pub mod lane;
mod number;
pub mod pieces;
pub mod probability;
pub mod rotation;
pub mod smoothing_spline;
pub mod statistics;
pub mod symmetric;
pub mod variance_component;
pub mod vectors;
mod wide;

pub use double_double::DoubleDouble;
pub use number::{Number, Several};
pub use wide::Wide;

/// Reads a number for which JSON, that has no NaN, may hold `null` (`#[serde(deserialize_with = "null_is_nan")]`).
pub fn null_is_nan<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    let number: Option<f64> = serde::Deserialize::deserialize(deserializer)?;
    Ok(number.unwrap_or(f64::NAN))
}
