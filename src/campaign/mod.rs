//! Campaigns: thousands of cases from one grid, worked off by any number of processes and machines.
//!
//! ```text
//! grid.toml ──plan──► cases.jsonl ──run, run, run──► leases/ results/ failures/ ──gather──► tables ──analyse──► report.html
//! ```
//!
//! The state is a folder, not a server: every process that sees the folder may work. A worker takes a case by an
//! exclusive file ([`lease`]), and its result appears whole or not at all ([`folder`]). A result depends on its case
//! alone, so that a case that was worked twice (its first worker was thought dead) gives the same bytes.

pub mod analyse;
mod case;
mod execute;
pub mod folder;
pub mod frame;
pub mod gather;
pub mod grid;
pub mod lease;
mod outcome;
pub mod run;
pub mod scripts;

pub use case::Case;
pub use execute::execute;
pub use folder::Folder;
pub use outcome::{Candidate, Estimate, Outcome};
