//! Statistics of extra columns, from score and information alone: small dense systems, no block, no model, no solver.
//!
//! A [`System`] says what columns would explain of the residuals of a fit. Sets of its columns are tested ([`fixed`]), estimated as random
//! values ([`random`]), held against each other ([`separability`]) and taken for granted ([`System::beside`]). Whatever is decided, entry of
//! an effect or its need, is decided by these functions and by one rule.

pub mod design_effect;
pub mod fixed;
pub mod multiple;
pub mod power;
pub mod prediction;
pub mod random;
pub mod separability;
pub mod system;

pub use fixed::{Tested, test};
pub use system::{Penalised, System};
