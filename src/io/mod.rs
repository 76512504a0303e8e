//! Files: a block in its own format ([`block`]), a model ([`model`]), and the tables of a run ([`table`]).
//!
//! What is wrong in a file is refused with an [`Error`] that names file, line, column, value and what was expected; what is
//! merely useless is left out and counted ([`block::SetAside`]). Numbers are written with the shortest text that reads back as
//! the same `f64`, so writing and reading is exact. No file is ever seen half written: each is written under another name in
//! the same folder and then renamed.

pub mod block;
pub mod foreign;
pub mod model;
pub mod table;

mod atomic;
mod csv_table;
mod error;
mod names;
mod toml_table;

pub use atomic::write_atomically;
pub use error::{Error, Place};

use std::fs::File;
use std::path::Path;

/// Opens a file for reading. A pipe or a device in place of one, which might never end, is refused.
pub(crate) fn open(path: &Path) -> std::io::Result<File> {
    let kind = std::fs::metadata(path)?.file_type();
    if !kind.is_file() {
        return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, "this is no regular file"));
    }
    File::open(path)
}

/// Reads a text file that [`open`] opens.
pub(crate) fn read_text(path: &Path) -> std::io::Result<String> {
    std::io::read_to_string(open(path)?)
}
