//! Effects of formulas: a header, compiled and checked.

use crate::errors::{input, raised};
use misclosure::effects::Stage;
use misclosure::kit::formula::{self, Parameter, Size};
use misclosure::kit::{build as compiler, check as laws};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Name, unit, given value, typical size, largest size.
type Declared = (String, String, Option<f64>, Option<f64>, Option<f64>);

/// The C++ header of a formula.
#[pyfunction(name = "effect_header")]
pub fn header(
    py: Python<'_>,
    name: &str,
    stage: &str,
    formula: Vec<(String, String)>,
    parameters: Vec<Declared>,
) -> PyResult<String> {
    let known = || Stage::ALL.iter().map(|stage| stage.name()).collect::<Vec<_>>().join(", ");
    let found = Stage::ALL.into_iter().find(|own| own.name() == stage);
    let found = found.ok_or_else(|| input(py, &format!("stage={stage:?}: expected one of {}", known())))?;
    let parameter = |(name, unit, given, typical, most): Declared| {
        let size = match given {
            Some(value) => Size::Given(value),
            None => Size::Estimated { typical: typical.or(most).unwrap_or(1.0), most },
        };
        Parameter { name, unit, size }
    };
    let parameters: Vec<Parameter> = parameters.into_iter().map(parameter).collect();
    let file = formula::cpp(name, found, &formula, &parameters);
    file.map(|file| file.text).map_err(|error| input(py, &error.to_string()))
}

/// Compiles a header, or the folder of a Rust package; gives the compiler's warnings.
#[pyfunction(name = "build_effect")]
pub fn build(py: Python<'_>, source: PathBuf, library: PathBuf) -> PyResult<String> {
    py.detach(|| compiler::build(&source, &library)).map_err(|error| raised(py, &error.into()))
}

/// Holds a library against every law; gives the effect's id, its stage and the laws as JSON.
#[pyfunction(name = "check_effect")]
pub fn check(py: Python<'_>, library: PathBuf) -> PyResult<String> {
    let found = py.detach(|| laws::check(&library)).map_err(|error| raised(py, &error.into()))?;
    let json = serde_json::json!({
        "effect": found.descriptor.id, "stage": found.descriptor.stage.name(), "holds": found.holds(),
        "laws": found.laws, "remarks": found.remarks, "values_ns": found.values_ns,
        "derivatives_ns": found.derivatives_ns,
    });
    Ok(json.to_string())
}
