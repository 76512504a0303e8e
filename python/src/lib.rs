//! The compiled half of the Python package: blocks and results as opaque objects, tables as bytes, long work on a
//! separate thread. All that a user sees, arguments and arrays alike, is in the Python half (`misclosure/*.py`).
//!
//! | file | is |
//! |---|---|
//! | `errors` | an exception for each kind of error |
//! | `job` | long work: progress, Ctrl-C, panics |
//! | `table` | rows as the bytes of a structured array |
//! | `block`, `block_tables`, `figure` | blocks, their tables and their picture |
//! | `simulated`, `made` | simulated blocks; blocks from columns |
//! | `checked` | what a block of columns must keep |
//! | `run`, `run_tables` | results and their tables |
//! | `effects`, `program` | effects of formulas; the program itself |

mod block;
mod block_tables;
mod checked;
mod effects;
mod errors;
mod figure;
mod job;
mod made;
mod program;
mod run;
mod run_tables;
mod simulated;
mod table;

use pyo3::prelude::*;

/// The module `misclosure._native`.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("version", env!("CARGO_PKG_VERSION"))?;
    module.add("solvers", misclosure::adjust::BUILT.iter().map(|solver| solver.name()).collect::<Vec<_>>())?;
    module.add_class::<block::Block>()?;
    module.add_class::<run::Run>()?;
    module.add_function(wrap_pyfunction!(effects::header, module)?)?;
    module.add_function(wrap_pyfunction!(effects::build, module)?)?;
    module.add_function(wrap_pyfunction!(effects::check, module)?)?;
    module.add_function(wrap_pyfunction!(program::program, module)?)
}
