//! The forward model: a measurement predicted through the chain of effects (CONVENTIONS.md), with derivatives by hand.
//!
//! It is part of no solver: the native one linearises with it, and whoever looks at a fitted state predicts with
//! [`Predictor`]. Ceres has its own, from the forward formulas, so that the two can disagree.

mod chain;
mod eight;
mod eight_rays;
mod eight_rows;
mod error;
mod frame;
mod interior_chain;
pub mod lanes;
mod matrices;
mod place;
mod plain;
mod position;
mod predictor;
mod ray;
mod rays;
mod through;
mod transpose;

pub use chain::{Prediction, predict};
pub use eight::{Answers, Predict, Wanted};
pub use eight_rays::Seen;
pub use error::MeasureError;
pub use frame::{Frame, Stages, frames};
pub use interior_chain::InteriorChain;
pub use plain::{PlainPrediction, PlainView};
pub use position::{PositionPrediction, predict_antenna, predict_surveyed};
pub use predictor::{ImagePoint, Predictor, Sighted};
pub use transpose::transpose;
