//! The validation suite: problems whose answers are certain, for our solvers and for anybody's.
//!
//! - [`problems`]: bundle problems, each generated from a scenario, with a certificate of its solution, its precision
//!   and its cost.
//! - [`certificate`]: where certificates come from. The forward model is written a third time ([`forward`], [`laws`]),
//!   for numbers of 32 digits and with automatic derivatives; a solution is refined until the gradient vanishes to
//!   these digits ([`lineariser`], [`normal`]). What has no solution is certified by its rank ([`rank`]).
//! - [`score`]: digits of a result, in units of its standard deviation.
//! - [`solve`]: our solvers on the suite. [`suite`] writes it for others, [`judge`] reads their results back.
//! - [`nist`]: the nonlinear regression sets of NIST for the loop of the native Levenberg-Marquardt itself.

pub mod certificate;
mod certificates;
pub mod forward;
pub mod judge;
pub mod laws;
pub mod lineariser;
pub mod nist;
pub mod normal;
pub mod problems;
pub mod rank;
pub mod score;
pub mod solve;
pub mod suite;
