//! What is read and written: blocks, models, the files of other programs, and files that nobody should read.

#[path = "../common/beside.rs"]
mod beside;
#[path = "../common/mod.rs"]
mod common;
mod small;

mod formats;
mod fuzz;
mod interop;
mod io_model;
mod io_roundtrip;
mod malformed_blocks;
