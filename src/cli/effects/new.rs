//! `misclosure effects new`: a template for an effect of one's own.

use super::super::{Answer, Usage};
use crate::effects::Stage;
use crate::kit::template;
use anyhow::Context;
use clap::builder::PossibleValue;
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes a commented template for an effect of your own, which compiles and keeps every law as it stands
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure effects new sensor-pattern --stage image          sensor-pattern.h, in C++
  misclosure effects new sensor-pattern --stage image --rust   sensor-pattern/, a Rust package")]
pub struct Arguments {
    /// Name of the effect: lower case words with hyphens
    name: String,
    /// Where in the measurement chain it acts
    #[arg(long)]
    stage: Stage,
    /// In Rust instead of C++
    #[arg(long)]
    rust: bool,
    /// Folder to write it into [default: this one]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

impl clap::ValueEnum for Stage {
    fn value_variants<'a>() -> &'a [Self] {
        &Stage::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Stage::Image => "where a point is read on the sensor",
            Stage::Interior => "the camera in an image: focal length, principal point, distortion",
            Stage::Exposure => "where the camera is, and how it is turned, when a row is exposed",
            Stage::Ray => "the way of the light from the point to the lens",
            Stage::Position => "the antenna beside the camera",
            Stage::Control => "surveyed points",
            Stage::Frame => "the system of the survey, of points and antennas",
        };
        Some(PossibleValue::new(self.name()).help(help))
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<Answer> {
    let Arguments { name, stage, rust, output } = arguments;
    let make = if *rust { template::rust } else { template::cpp };
    let files = make(name, *stage).map_err(|error| Usage(error.to_string()))?;
    let inside = |path: &str| output.as_ref().map_or_else(|| PathBuf::from(path), |folder| folder.join(path));
    let paths: Vec<PathBuf> = files.iter().map(|file| inside(&file.path)).collect();
    if let Some(there) = paths.iter().find(|path| path.exists()) {
        return Err(Usage(format!("{}: is there already; name another effect or folder (-o)", there.display())).into());
    }
    for (path, file) in paths.iter().zip(&files) {
        write_new(path, &file.text).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    let source = if *rust { inside(name) } else { inside(&format!("{name}.h")) };
    let formula = if *rust { source.join("src/lib.rs") } else { source.clone() };
    let (source, formula) = (source.display(), formula.display());
    let text = format!(
        "{formula}: its formula is yours to write.\n\
         Next: misclosure effects build {source} -o {name}.so\n"
    );
    let paths: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    Ok(Answer { text, json: json!({ "format": 1, "files": paths }), failure: None })
}

/// Never over a file that came there meanwhile.
fn write_new(path: &Path, text: &str) -> std::io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::OpenOptions::new().write(true).create_new(true).open(path)?.write_all(text.as_bytes())
}
