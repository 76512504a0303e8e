//! Which physical effect is missing: every question of a converged fit is linear algebra of one small system ([`linearised`]).
//!
//! - [`mod@test`]: pure statistics of such systems, without a block.
//! - [`select`]: which effects belong to the model, rules over what the tests say.
//! - [`improve`]: carries out what the rules ask for, refits, and keeps the ledger; [`settle`] fits without outliers; [`run`] is a whole diagnosis.
//! - [`structure`]: what is left in the residuals, whatever its cause; [`outliers`]: data snooping.
//! - [`check_points`]: height errors of check points against what the block's own errors allow.
//! - [`look`]: one model as it stands, without the loop.
//! - [`verdict`] is `diagnosis.json`; [`impact`] what effects do to the points.

pub mod added;
pub mod candidate;
mod catalogue;
pub mod check_points;
mod conclusion;
mod domain;
mod entries;
pub mod fit;
pub mod handed_on;
pub mod heldout;
pub mod impact;
pub mod imprecise;
pub mod improve;
pub mod left;
pub mod linearised;
pub mod look;
pub mod models;
mod neighbours;
pub mod outliers;
pub mod pictures;
mod pinned;
mod probability;
pub mod run;
pub mod scan;
pub mod select;
pub mod settings;
pub mod settle;
pub mod shown;
mod squares;
pub mod structure;
pub mod test;
pub mod verdict;
mod weigh;
pub mod weights;
