//! Fuzz targets: whatever the bytes, each comes back with a value or with an error that says something. libFuzzer drives them
//! (`make fuzz`), and for some seconds `tests/files/fuzz`.

pub mod adjust;
pub mod block;
pub mod descriptor;
mod folder;
pub mod foreign;
pub mod model;
pub mod recipe;
pub mod run_folder;
pub mod scenario;

pub use folder::SEPARATOR;
