//! The validation suite: certificates, our solvers against them, anybody's results, and NIST's sets.

use crate::beside;
mod certificates;
mod command;
mod nist;
