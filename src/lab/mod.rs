//! The laboratory: compare a model with measurements, see where it fails, add what is missing, watch the error fall,
//! and step back.
//!
//! A server on this machine alone draws the figures of [`crate::report`] on request and keeps every model that was
//! tried:
//!
//! - [`api`]: what the page and the server say to each other, in one place.
//! - [`change`]: what a step changes; [`step`] carries it out; [`tree`] keeps its result as the folder of a run.
//! - [`setup::Source`]: the block of a root or of a step that mends, screened for mistakes of people.
//! - [`columns`], [`quantity`] and [`brush`]: every measurement of a node with what was recorded of it,
//!   and which of them are chosen.
//! - [`figures`] as [`asked`], [`candidates`], [`predict`], [`space`]: what is shown of a node.
//! - [`photos`]: the images themselves, where their folder is known.
//! - [`simulated`]: a block whose errors one chooses.
//! - [`planning`]: another page, on which a user plans a scenario with sliders.
//! - [`server`]: HTTP; [`guard`] says who is answered.

pub mod api;
pub mod asked;
pub mod assets;
pub mod brush;
pub mod candidates;
pub mod change;
pub mod columns;
pub mod figures;
pub mod guard;
pub mod live;
pub mod measurements;
pub mod node;
pub mod photos;
pub mod planning;
pub mod predict;
pub mod predicted;
pub mod quantity;
pub mod server;
pub mod setup;
pub mod simulated;
pub mod space;
pub mod state;
pub mod step;
pub mod tree;
pub mod view;

mod about;
mod answers;
mod aside;
mod changing;
mod commands;
mod events;
mod job;
mod kept;
mod known;
mod longest;
mod mending;
mod moved;
mod points;
mod restore;
mod routes;
mod screened;
mod sources;
mod truth;
mod worker;
