//! Adjustment: with known truth, of every kind of block and model, in both solvers.

#[cfg(feature = "ceres")]
mod agreement;
mod building;
mod covariance;
mod dike;
mod found_again;
mod moved;
mod noisy;
mod null_model;
#[cfg(feature = "ceres")]
mod place;
mod reduced;
mod singular;
mod threads;
