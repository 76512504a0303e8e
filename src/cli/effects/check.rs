//! `misclosure effects check`: does a plug-in keep the laws?

use super::super::plugins::suspect;
use super::super::text::paragraph;
use super::super::{Answer, Usage};
use super::catalogue;
use crate::kit::check::{self, Check};
use crate::report::numbers::significant;
use crate::report::tables::Table;
use serde_json::json;
use std::path::PathBuf;

/// Column at which the text behind a label begins.
const INDENT: usize = 16;

/// Checks a plug-in against every law that an effect must keep, and measures what a call costs
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure effects check sensor-pattern.so
  misclosure effects check sensor-pattern.so --json | jq '.laws[] | select(.holds | not)'

Ends with code 2 where a law is broken.")]
pub struct Arguments {
    /// Shared library of an effect
    #[arg(value_name = "FILE.so")]
    library: PathBuf,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<Answer> {
    suspect(std::slice::from_ref(&arguments.library));
    let found = check::check(&arguments.library)?;
    let broken: Vec<&str> = found.laws.iter().filter(|law| !law.holds).map(|law| law.law).collect();
    let failure = (!broken.is_empty()).then(|| {
        let (path, id) = (found.origin.path.display(), &found.descriptor.id);
        Usage(format!("{path}: effect `{id}` breaks {}", broken.join(", "))).into()
    });
    let json = json!({
        "format": 1, "library": found.origin.path.display().to_string(), "sha256": found.origin.sha256,
        "effect": found.descriptor.id, "stage": found.descriptor.stage.name(), "holds": found.holds(),
        "laws": found.laws,
        "abi_version": found.version, "parameters": catalogue::parameters_json(&found.descriptor),
        "words": found.descriptor.words, "picture": found.descriptor.picture.to_string(), "remarks": found.remarks,
        "values_ns": found.values_ns, "derivatives_ns": found.derivatives_ns,
    });
    Ok(Answer { text: text(&found), json, failure })
}

fn text(found: &Check) -> String {
    let mut text = format!(
        "{}: effect `{}`, {} stage\nSHA-256 {}\n\n",
        found.origin.path.display(),
        found.descriptor.id,
        found.descriptor.stage.name(),
        found.origin.sha256
    );
    let mut table = Table::new("").text("law", "").text("what it asks for", "").text("kept", "");
    for law in &found.laws {
        table.row([law.law, law.asks, if law.holds { "yes" } else { "NO" }].map(String::from));
    }
    text += &table.to_text();
    for law in found.laws.iter().filter(|law| !law.holds) {
        text += "\n";
        text += &paragraph("", 0, &format!("{}: {}", law.law, law.found));
    }
    text += "\n";
    text += &catalogue::parameters(&found.descriptor);
    text += "\n";
    text += &catalogue::told(&found.descriptor);
    for remark in &found.remarks {
        text += "\n";
        text += &paragraph("Not stated", INDENT, remark);
    }
    text += &format!(
        "\nA call costs {} ns, {} ns with derivatives.\n",
        significant(found.values_ns, 2),
        significant(found.derivatives_ns, 2)
    );
    text
}
