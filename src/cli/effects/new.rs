//! `misclosure effects new`: a template for an effect of one's own.

use super::super::{Answer, Usage};
use crate::effects::Stage;
use crate::kit::formula::{self, Parameter, Size};
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
  misclosure effects new sensor-pattern --stage image --rust   sensor-pattern/, a Rust package
  misclosure effects new ripple --stage image --formula \"dx=a*sin(2*pi*x/p)\" --parameter a:unit=px,typical=0.2 \
  --parameter p:unit=px,given=300                              ripple.h, finished

A formula has names of the stage's values, of its parameters, and of what is recorded. At the image stage values are
x, y (px), f, ppx, ppy, dcx, dcy, k1, ... Recorded are t (seconds since the first image of the flight), tau, T, vx, vy,
vz, w, h, row and column. A name that is unknown is refused with the list of those that are known.")]
pub struct Arguments {
    /// Name of the effect: lower case words with hyphens
    name: String,
    /// Where in the measurement chain it acts
    #[arg(long)]
    stage: Stage,
    /// In Rust instead of C++
    #[arg(long)]
    rust: bool,
    /// What the effect adds to a value, as `dx=EXPRESSION` (repeatable); the header is then finished
    #[arg(long, value_name = "dVALUE=EXPRESSION", conflicts_with = "rust")]
    formula: Vec<String>,
    /// A parameter of the formula (repeatable): estimated with a typical and a largest size, or given
    #[arg(long, value_name = "NAME[:unit=U,typical=V,most=V|given=V]", requires = "formula")]
    parameter: Vec<String>,
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
    let Arguments { name, stage, rust, formula, parameter, output } = arguments;
    let files = if formula.is_empty() {
        let make = if *rust { template::rust } else { template::cpp };
        make(name, *stage).map_err(|error| Usage(error.to_string()))?
    } else {
        let formula = formula.iter().map(|text| equation(text)).collect::<Result<Vec<_>, _>>()?;
        let parameters = parameter.iter().map(|text| own_parameter(text)).collect::<Result<Vec<_>, _>>()?;
        vec![formula::cpp(name, *stage, &formula, &parameters).map_err(|error| Usage(error.to_string()))?]
    };
    let is_finished = !formula.is_empty();
    let inside = |path: &str| output.as_ref().map_or_else(|| PathBuf::from(path), |folder| folder.join(path));
    let paths: Vec<PathBuf> = files.iter().map(|file| inside(&file.path)).collect();
    if let Some(there) = paths.iter().find(|path| path.exists()) {
        return Err(Usage(format!("{}: is there already; name another effect or folder (-o)", there.display())).into());
    }
    for (path, file) in paths.iter().zip(&files) {
        write_new(path, &file.text).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    let source = if *rust { inside(name) } else { inside(&format!("{name}.h")) };
    let file = if *rust { source.join("src/lib.rs") } else { source.clone() };
    let (source, file) = (source.display(), file.display());
    let state = if is_finished { "has your formula" } else { "its formula is yours to write" };
    let text = format!("{file}: {state}.\nNext: misclosure effects build {source} -o {name}.so\n");
    let paths: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    Ok(Answer { text, json: json!({ "format": 1, "files": paths }), failure: None })
}

/// `dx=EXPRESSION`.
fn equation(text: &str) -> Result<(String, String), Usage> {
    let (output, expression) =
        text.split_once('=').ok_or_else(|| Usage(format!("--formula {text}: expected dVALUE=EXPRESSION")))?;
    Ok((output.trim().to_owned(), expression.trim().to_owned()))
}

/// `NAME:unit=px,typical=0.2,most=2` or `NAME:unit=px,given=300`.
fn own_parameter(text: &str) -> Result<Parameter, Usage> {
    let refuse = |problem: String| Usage(format!("--parameter {text}: {problem}"));
    let (name, list) = text.split_once(':').unwrap_or((text, ""));
    let (mut unit, mut typical, mut most, mut given) = ("1".to_owned(), None, None, None);
    for setting in list.split(',').filter(|setting| !setting.is_empty()) {
        let (key, value) = setting.split_once('=').ok_or_else(|| refuse(format!("`{setting}`: expected KEY=VALUE")))?;
        let place = match key {
            "unit" => {
                unit = value.to_owned();
                continue;
            }
            "typical" => &mut typical,
            "most" => &mut most,
            "given" => &mut given,
            _ => return Err(refuse(format!("`{key}`: expected unit, typical, most or given"))),
        };
        let number = value.parse::<f64>().ok().filter(|value| value.is_finite());
        *place = Some(number.ok_or_else(|| refuse(format!("`{setting}`: expected a number")))?);
    }
    let size = match (given, typical.or(most)) {
        (Some(value), None) => Size::Given(value),
        (Some(_), Some(_)) => return Err(refuse("a given parameter has neither typical nor largest size".into())),
        (None, _) => Size::Estimated { typical: typical.or(most).unwrap_or(1.0), most },
    };
    Ok(Parameter { name: name.to_owned(), unit, size })
}

/// Never over a file that came there meanwhile.
fn write_new(path: &Path, text: &str) -> std::io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::OpenOptions::new().write(true).create_new(true).open(path)?.write_all(text.as_bytes())
}
