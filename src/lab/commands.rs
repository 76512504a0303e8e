//! The commands that make a node again in a shell.

use super::setup::Source;
use super::state::Lab;
use anyhow::Result;
use serde_json::{Value, json};
use std::path::Path;

/// The commands that reproduce a node from the shell, in whatever folder: mistakes undone in a copy of the block, the
/// adjustment, and its report again.
///
/// # Errors
/// A node that is not done.
pub(super) fn commands(lab: &Lab, id: u32) -> Result<Value> {
    let view = lab.view(id)?;
    let source = lab.source(id)?;
    let mut all: Vec<String> = Vec::new();
    let mut block = path(&source.path);
    for (number, only) in lab.mends(id)?.iter().enumerate() {
        let copy = format!("step-{id:04}-block-{}", number + 1);
        let kinds: String = only.iter().map(|kind| format!(" --only {}", quoted(kind))).collect();
        all.push(format!("misclosure mend {block} -o {copy}{kinds}"));
        block = copy;
    }
    all.extend(warning(&source));
    let model = path(&lab.setup.folder.step(id).join("model.toml"));
    let run = format!("step-{id:04}-again");
    let mut adjust = format!("misclosure adjust {block} -o {run} --model {model}");
    for plugin in &view.run.summary.plugins {
        adjust += &format!(" --plugin {}", path(Path::new(&plugin.path)));
    }
    if let [solver] = lab.setup.solvers.as_slice() {
        adjust += &format!(" --solver {}", solver.name());
    }
    all.push(adjust);
    all.push(format!("misclosure report {run}"));
    Ok(json!({ "commands": all }))
}

/// A line that a shell passes over, where the block still has mistakes. Names of a block may hold anything: it has none
/// of them.
fn warning(source: &Source) -> Option<String> {
    if source.mistakes.is_empty() {
        return None;
    }
    let kinds: Vec<String> = source.mistakes.iter().map(|own| format!("{} ({})", own.kind, own.subject)).collect();
    Some(format!(
        "# The step left out what is recorded wrongly: {}. An adjustment takes the files as they are.",
        kinds.join(", ")
    ))
}

/// A path that a shell takes as one word.
fn path(path: &Path) -> String {
    quoted(&path.canonicalize().unwrap_or_else(|_| path.to_owned()).display().to_string())
}

fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}
