//! Effects from shared libraries: our own headers under another name, and libraries with one fault each.

#[path = "../common/mod.rs"]
mod common;

mod compiled;
mod faults;
mod own_headers;
