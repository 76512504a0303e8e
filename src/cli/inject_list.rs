//! `misclosure inject --list`: the errors, and the mistakes of people, with their parameters.

use super::Answer;
use crate::inject::mistakes::{self, Kind};
use crate::inject::{self, Cause, ParameterSpec};
use crate::report::tables::Table;
use serde_json::{Value, json};

/// Over the second part of the list.
const MISTAKES: &str = "MISTAKES (--mistake): the files are rewritten as a person would, after all errors\n\n";

/// The list.
pub fn list() -> Answer {
    let mut text = String::new();
    for cause in inject::registry() {
        text += &format!("{}: {}\n", cause.id(), cause.summary());
        text += &parameters(cause.parameters());
    }
    text += MISTAKES;
    for kind in mistakes::registry() {
        text += &format!("{} ({}): {}\n", kind.id(), kind.subjects().join(", "), kind.summary());
        text += &parameters(kind.parameters());
    }
    let errors: Vec<Value> = inject::registry().iter().map(|cause| error_json(cause)).collect();
    let mistakes: Vec<Value> = mistakes::registry().map(mistake_json).collect();
    Answer { text, json: json!({ "format": 1, "errors": errors, "mistakes": mistakes }), failure: None }
}

/// Parameters as a table, and an empty line.
fn parameters(specs: &[ParameterSpec]) -> String {
    let mut table = (Table::new("").text("    parameter", "").text("unit", "").text("default", "")).text("meaning", "");
    for p in specs {
        table.row([format!("    {}", p.name), p.unit.into(), p.default.to_string(), p.help.into()]);
    }
    let text = if specs.is_empty() { String::new() } else { table.to_text() };
    text + "\n"
}

fn parameters_json(specs: &[ParameterSpec]) -> Vec<Value> {
    let parameter =
        |p: &ParameterSpec| json!({ "name": p.name, "unit": p.unit, "default": p.default.to_string(), "help": p.help });
    specs.iter().map(parameter).collect()
}

fn error_json(cause: &Cause) -> Value {
    json!({ "error": cause.id(), "summary": cause.summary(), "parameters": parameters_json(cause.parameters()) })
}

fn mistake_json(kind: &Kind) -> Value {
    json!({
        "mistake": kind.id(), "subjects": kind.subjects(), "summary": kind.summary(),
        "parameters": parameters_json(kind.parameters()),
    })
}
