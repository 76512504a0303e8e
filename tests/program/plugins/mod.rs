//! Effects from shared libraries: our own headers under another name, ranges and words, libraries of an older version
//! and with one fault each.

mod compiled;
mod faults;
mod older;
mod own_headers;
mod stated;
