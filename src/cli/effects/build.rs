//! `misclosure effects build`: an effect of one's own, compiled.

use super::super::plugins::suspect;
use super::super::{Answer, Console};
use crate::effects::{Effect, plugin};
use crate::kit::build;
use serde_json::json;
use std::path::PathBuf;

/// Compiles an effect of your own to a plug-in, with the system's compiler
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure effects build sensor-pattern.h -o sensor-pattern.so   a C++ header; CXX names another compiler, CXXFLAGS \
  its options
  misclosure effects build sensor-pattern -o sensor-pattern.so     a Rust package, with cargo")]
pub struct Arguments {
    /// C++ header, or folder of a Rust package
    #[arg(value_name = "FILE.h|FOLDER")]
    source: PathBuf,
    /// Shared library to write
    #[arg(short, long, value_name = "FILE.so")]
    output: PathBuf,
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console) -> anyhow::Result<Answer> {
    let Arguments { source, output } = arguments;
    let warnings = build::build(source, output)?;
    if !warnings.is_empty() {
        console.message(&warnings);
    }
    // What it is called stands in its table alone; a header that exports nothing is told here.
    suspect(std::slice::from_ref(output));
    let plugin = plugin::open(output)?;
    let (descriptor, sha256) = (plugin.descriptor(), &plugin.origin().sha256);
    let text = format!(
        "{path}: effect `{id}`, {stage} stage, SHA-256 {sha256}\nNext: misclosure effects check {path}\n",
        path = output.display(),
        id = descriptor.id,
        stage = descriptor.stage.name()
    );
    let json = json!({ "format": 1, "library": output.display().to_string(), "sha256": sha256, "effect": descriptor.id,
                       "stage": descriptor.stage.name(), "warnings": warnings });
    Ok(Answer { text, json, failure: None })
}
