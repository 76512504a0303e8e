//! An exception for each kind of error, with the program's own text. The classes stand in `misclosure/errors.py`.

use misclosure::adjust::AdjustError;
use misclosure::effects::plugin::PluginError;
use misclosure::evaluate::similarity::SimilarityError;
use misclosure::io;
use misclosure::kit::build::BuildError;
use misclosure::measure::MeasureError;
use misclosure::problem::ProblemError;
use misclosure::run::RunError;
use misclosure::scenario::ScenarioError;
use misclosure::shared::{Bent, Disagreement, Exit, Usage, error_chain};
use pyo3::prelude::*;

/// What a user gave is not what was expected.
pub const INPUT: &str = "InputError";
/// A bug.
pub const INTERNAL: &str = "InternalError";

/// An exception of the class `kind`; `code` is the program's exit code of such an error.
pub fn exception(py: Python<'_>, kind: &str, text: &str, code: u8) -> PyErr {
    let made = py.import("misclosure.errors").and_then(|module| module.getattr(kind)?.call1((text, code)));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// The exception of what a user gave.
pub fn input(py: Python<'_>, text: &str) -> PyErr {
    exception(py, INPUT, text, Exit::BadInput as u8)
}

/// The exception of an error of the library.
pub fn raised(py: Python<'_>, error: &anyhow::Error) -> PyErr {
    let text = error_chain(error);
    let kind = error.chain().find_map(kind).unwrap_or("MisclosureError");
    exception(py, kind, text.strip_prefix("error: ").unwrap_or(&text), Exit::of(error) as u8)
}

/// The class of the first cause that has one.
fn kind(cause: &(dyn std::error::Error + 'static)) -> Option<&'static str> {
    if cause.is::<Usage>() {
        return Some(INPUT);
    }
    if cause.is::<ScenarioError>() {
        return Some("ScenarioError");
    }
    if cause.is::<PluginError>() {
        return Some("PluginError");
    }
    if cause.is::<BuildError>() {
        return Some("CompilerError");
    }
    if cause.is::<Bent>() {
        return Some("BlunderError");
    }
    if cause.is::<Disagreement>() {
        return Some("DisagreementError");
    }
    if cause.is::<ProblemError>() || cause.is::<MeasureError>() || cause.is::<SimilarityError>() {
        return Some("ModelError");
    }
    if let Some(error) = cause.downcast_ref::<io::Error>() {
        return Some(match error {
            io::Error::Content { .. } => "BlockError",
            io::Error::Read { .. } | io::Error::Write { .. } => "FileError",
        });
    }
    if cause.is::<std::io::Error>() {
        return Some("FileError");
    }
    match cause.downcast_ref::<RunError>() {
        Some(RunError::Adjust(error)) => Some(adjustment(error)),
        Some(RunError::Problem(_) | RunError::Measure(_) | RunError::Similarity(_)) => Some("ModelError"),
        None => cause.downcast_ref::<AdjustError>().map(adjustment),
    }
}

fn adjustment(error: &AdjustError) -> &'static str {
    match error {
        AdjustError::Singular { .. } | AdjustError::RaysDoNotMeet { .. } => "SingularError",
        AdjustError::NotConverged { .. } => "NotConvergedError",
        AdjustError::BadStart { .. } => "StartError",
        AdjustError::WrongDerivative { .. } => "PluginError",
        AdjustError::Unsupported { .. } => INPUT,
        AdjustError::NoThreads { .. } | AdjustError::NoMemory { .. } => "ResourceError",
        AdjustError::Cancelled { .. } | AdjustError::Bridge(_) => "AdjustmentError",
    }
}
