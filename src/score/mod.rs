//! Statistics of extra columns, from score and information alone: small dense systems, no block, no model, no solver.
//!
//! A [`System`] says what columns would explain of the residuals of a fit. Sets of its columns are tested ([`fixed`]),
//! estimated as random values ([`random`]), held against each other ([`separability`]) and conditioned on
//! ([`System::beside`]).

pub mod design_effect;
pub mod fixed;
pub mod multiple;
pub mod pivoted;
pub mod power;
pub mod random;
pub mod separability;
pub mod system;

pub use fixed::{Tested, test};
pub use system::{Penalised, System};

/// Share of the stated variance below which residuals are no noise any more: of 20 degrees of freedom or more this
/// happens less than once in a thousand million. An error-free block leaves rounding and what iterations stopped at,
/// and these have structure.
pub const LEAST_NOISE: f64 = 0.05;

/// Are residuals as large as noise is, for what is stated of it?
pub fn is_noise(sum_of_squares: f64, degrees: f64) -> bool {
    degrees.is_nan() || sum_of_squares >= LEAST_NOISE * degrees
}

/// Variance factor that chance is held against: that of the residuals, `sum_of_squares / degrees`, and the stated one
/// where they are much smaller than stated.
pub fn variance_factor(sum_of_squares: f64, degrees: f64) -> f64 {
    if is_noise(sum_of_squares, degrees) { sum_of_squares / degrees } else { 1.0 }
}
