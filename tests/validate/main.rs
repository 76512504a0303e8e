//! The validation suite: certificates, our solvers against them, anybody's results, and NIST's sets.

#[path = "../common/beside.rs"]
mod beside;
mod certificates;
mod command;
mod nist;
