//! The validation suite: certificates, our solvers against them, anybody's results, and NIST's sets.

mod certificates;
mod command;
mod nist;
