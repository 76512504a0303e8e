//! apex SOLVER SUITE PROBLEM RESULT: a problem of the validation suite by apex-solver.
//!
//! SOLVER is `apex-solver`, as its authors set it up for bundle adjustment, `apex-solver-tight`, the same with tight
//! tolerances and exact steps, or `apex-solver-gn`, its Gauss-Newton. The problem is read from SUITE/PROBLEM/colmap and
//! the result written into RESULT as a COLMAP model. What it took, or why apex-solver cannot express the problem, is
//! printed as one line of JSON.

mod adjust;
mod colmap;
mod entry;
mod form;

use adjust::{Method, Took, adjust};
use anyhow::{Context, Result, bail};
use serde_json::json;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [solver, suite, name, result] = arguments.as_slice() else {
        bail!("usage: apex SOLVER SUITE PROBLEM RESULT");
    };
    let method = match solver.as_str() {
        "apex-solver" => Method::Usual,
        "apex-solver-tight" => Method::Tight,
        "apex-solver-gn" => Method::GaussNewton,
        other => bail!("`{other}`: expected `apex-solver`, `apex-solver-tight` or `apex-solver-gn`"),
    };
    let suite = Path::new(suite);
    let entry = entry::read(suite, name)?;
    let mut model = colmap::Model::read(&suite.join(name).join("colmap"))?;
    let form = match form::of(&entry, &model) {
        Ok(form) => form,
        Err(why) => {
            println!("{}", json!({ "expressible": false, "why": why }));
            return Ok(());
        }
    };
    let took = adjust(&entry, &form, &mut model, method).with_context(|| format!("problem `{name}`"))?;
    model.write(Path::new(result))?;
    let Took { seconds, iterations, status } = took;
    let said = json!({
        "expressible": true, "seconds": seconds, "iterations": iterations, "status": status, "megabytes": peak()?,
    });
    println!("{said}");
    Ok(())
}

/// Peak resident memory of this process, MB.
fn peak() -> Result<f64> {
    let status = std::fs::read_to_string("/proc/self/status").context("/proc/self/status: cannot read")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|text| text.trim().strip_suffix(" kB")).and_then(|text| text.parse::<f64>().ok());
    Ok(kilobytes.context("/proc/self/status: expected `VmHWM: N kB`")? / 1024.0)
}
