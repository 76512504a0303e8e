//! Which physical effect is missing, decided by one objective: calibrated best-subset selection on the small system
//! of a converged fit.
//!
//! - [`linearised`]: a fit as `(s, M)`, every candidate a set of columns; [`select`]: tests conditional on the model.
//! - [`hypothesis`]: everything that may be true, with prior and price; [`objective`]: what a set of hypotheses
//!   leaves, and what it costs.
//! - [`search`]: a beam over sets to first order; [`competition`]: a linearisation with its hypotheses; [`refit`]: the
//!   objective of a fitted set, which counts; `descent`: a step of it, `options` another; [`improvement`]: the model on
//!   its way and its ledger.
//! - [`run`] is a whole diagnosis, of a block without what the [`screening`](crate::screening) found; [`look`]: one
//!   model as it stands, without the descent.
//! - [`verdict`] is `diagnosis.json`; [`impact`] what an effect does to the points, [`moved`] how far all together
//!   moved them.

pub mod added;
pub mod candidate;
mod catalogue;
mod checked;
pub mod competition;
mod conclusion;
mod descent;
mod domain;
mod entries;
pub mod handed_on;
pub mod heldout;
pub mod hypothesis;
pub mod impact;
pub mod imprecise;
pub mod improvement;
pub mod knowledge;
pub mod ledger;
pub mod left;
pub mod linearised;
pub mod look;
pub mod models;
pub mod moved;
pub mod objective;
mod options;
mod outliers;
mod own_cameras;
pub mod pictures;
mod precision;
pub mod refit;
pub mod run;
pub mod scan;
pub mod search;
pub mod select;
pub mod settings;
pub mod shown;
mod single;
pub mod two_cameras;
pub mod verdict;
mod weigh;
pub mod weights;
