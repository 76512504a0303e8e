//! Files: a block in its own format ([`block`]), a model ([`model`]), the tables of a run ([`table`]),
//! and edits of a block's files ([`edit`]).
//!
//! What is wrong in a file is refused with an [`Error`] that names file, line, column, value and what was expected;
//! what is merely useless is left out and counted ([`block::SetAside`]). Numbers are written with the shortest text
//! that reads back as the same `f64`, so writing and reading is exact. No file is ever seen half written: each is
//! written under another name in the same folder and then renamed.

pub mod block;
pub mod edit;
pub mod foreign;
pub mod model;
pub mod table;

mod atomic;
mod csv_table;
mod error;
mod names;
pub(crate) mod toml_table;

pub(crate) use crate::files::{open, read_text};
pub use atomic::write_atomically;
pub use error::{Error, Place};
