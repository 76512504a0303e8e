//! The study of calibration errors: put one known error into an error-free block, adjust, compare with the truth.
//!
//! ```text
//! cases ──► schedule (parallel, resumable) ──► execute: scenario ► inject ► problem ► adjust ► judge ──► outcome ──► page
//! ```
//!
//! A [`Case`] is plain data, its [`Outcome`] too; each outcome is one file in a [`Store`]. The page is made from the
//! outcomes alone: nothing in it is written by hand but the published figures ([`published`]).

pub mod blocks;
pub mod case;
pub mod cases;
pub mod execute;
pub mod flights;
pub mod judge;
pub mod outcome;
pub mod page;
pub mod published;
pub mod results;
pub mod schedule;
pub mod store;

mod pictures;

pub use case::{Case, Term};
pub use execute::{Simulations, execute};
pub use outcome::{Adjusted, Judged, Outcome};
pub use results::Results;
pub use schedule::{Event, run};
pub use store::Store;
