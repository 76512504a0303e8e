//! The program itself, for the command `misclosure` of the package.

use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs the program with this command line, its own name first, and gives its exit code. For a process that does
/// nothing else: the program sets signal handlers, and may end the process.
#[pyfunction]
pub fn program(py: Python<'_>, line: Vec<OsString>) -> u8 {
    py.detach(|| misclosure::shared::run_line(line)) as u8
}
