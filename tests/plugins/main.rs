//! Effects from shared libraries: our own headers under another name, ranges and words, libraries of an older version
//! and with one fault each.

#[path = "../common/mod.rs"]
mod common;

mod compiled;
mod faults;
mod older;
mod own_headers;
mod stated;
