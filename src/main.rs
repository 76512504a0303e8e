//! The `misclosure` program.
fn main() {}
