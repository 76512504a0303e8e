//! A block whose errors one chooses: it is measured anew under them, and the truth stands beside every estimate.

use super::change::Change;
use crate::block::{Block, Role};
use crate::inject::mistakes::{self, Mistake};
use crate::inject::{self, Cause, DefaultValue, Injected, ParameterSpec, Random, Setting, World};
use crate::io::block::write_block;
use crate::scenario::{SurveyNoise, add_survey_noise};
use anyhow::{Context, Result};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

/// A simulated block.
pub struct Simulated {
    /// Its preset, or its file.
    pub preset: String,
    /// The truth.
    pub truth: Block,
    /// Errors of the first measurement.
    pub errors: Vec<String>,
    /// Seed of the first measurement.
    pub seed: u64,
    /// Mistakes of people in the files of every measurement, as `inject --mistake` takes them.
    pub mistakes: Vec<String>,
}

/// Sliders reach so many times the default.
const REACH: f64 = 5.0;

impl Simulated {
    /// The first measurement.
    pub fn first(&self) -> Change {
        Change::Simulate { errors: self.errors.clone(), seed: self.seed }
    }

    /// The mistakes.
    ///
    /// # Errors
    /// A kind or a parameter that there is not.
    pub fn mistakes(&self) -> Result<Vec<Mistake>> {
        self.mistakes.iter().map(|text| mistakes::parse(text)).collect()
    }

    /// Writes the truth into `folder`, with the mistakes: as a block without errors looks.
    ///
    /// # Errors
    /// A mistake that there is not, or that the block cannot have.
    pub fn write_truth(&self, folder: &Path) -> Result<()> {
        write_block(&self.truth, folder)?;
        mistakes::make(folder, &self.mistakes()?)?;
        Ok(())
    }

    /// Can the block be measured under `errors`?
    ///
    /// # Errors
    /// An error that there is not, one that the block cannot have, or parameters that do not go together.
    pub fn check(&self, errors: &[String], seed: u64) -> Result<()> {
        let world = World::new(&self.truth, &self.truth)?;
        for text in errors {
            let own = inject::parse(text)?;
            let random = Random::new(seed, own.cause.id(), 0);
            let mut setting = Setting { values: &own.values, world: &world, random };
            own.cause.prepare(&mut setting).with_context(|| text.clone())?;
        }
        Ok(())
    }

    /// Measures the block under `errors` and writes it to `folder`, whole or not at all. Survey and receiver err as
    /// stated; mistakes come last.
    ///
    /// # Errors
    /// An error that there is not, or that the block cannot have.
    pub fn measure(&self, errors: &[String], seed: u64, folder: &Path) -> Result<()> {
        let errors = errors.iter().map(|text| inject::parse(text)).collect::<Result<Vec<_>>>()?;
        let Injected { mut block, .. } = inject::apply(&self.truth, &self.truth, &errors, seed)?;
        add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, seed);
        let parent = folder.parent().unwrap_or(Path::new("."));
        let staged = tempfile::Builder::new().prefix(".step-").tempdir_in(parent)?;
        write_block(&block, staged.path())?;
        mistakes::make(staged.path(), &self.mistakes()?)?;
        if folder.exists() {
            fs::remove_dir_all(folder).with_context(|| format!("{}: cannot remove", folder.display()))?;
        }
        fs::rename(staged.path(), folder).with_context(|| format!("{}: cannot write", folder.display()))?;
        let _ = staged.keep();
        Ok(())
    }
}

/// The causes that a block can be given, with their sliders.
pub fn causes(simulated: &Simulated) -> Value {
    let cause = |cause: &&Cause| {
        let parameters: Vec<Value> = cause.parameters().iter().map(|spec| parameter(&simulated.truth, spec)).collect();
        json!({ "id": cause.id(), "about": cause.summary(), "parameters": parameters })
    };
    let causes: Vec<Value> = inject::registry().iter().map(cause).collect();
    json!({
        "preset": simulated.preset, "errors": simulated.errors, "mistakes": simulated.mistakes, "seed": simulated.seed,
        "causes": causes,
    })
}

/// A parameter as the page sets it: by a number, a tick, one of some words, or a text; or as it is without a value.
fn parameter(truth: &Block, spec: &ParameterSpec) -> Value {
    let mut all = json!({
        "name": spec.name, "unit": spec.unit, "about": spec.help, "kind": "number", "default": null, "without": null,
        "min": null,
        "max": null, "choices": null,
    });
    match spec.default {
        DefaultValue::Number(number) => {
            let reach = REACH * number.abs().max(f64::MIN_POSITIVE);
            all["default"] = json!(number);
            if number != 0.0 {
                all["min"] = json!(if number < 0.0 { -reach } else { 0.0 });
                all["max"] = json!(if number < 0.0 { 0.0 } else { reach });
            }
        }
        DefaultValue::Flag(flag) => {
            (all["kind"], all["default"], all["choices"]) = (json!("flag"), json!(u8::from(flag)), json!(["0", "1"]));
        }
        DefaultValue::Choice(word, choices) => {
            (all["kind"], all["default"], all["choices"]) = (json!("choice"), json!(word), json!(choices));
        }
        DefaultValue::Optional(without) => (all["kind"], all["without"]) = (json!("optional"), json!(without)),
        DefaultValue::Name(without) => {
            (all["kind"], all["without"]) = (json!("name"), json!(without));
            all["choices"] = json!(names(truth, spec.name));
        }
        DefaultValue::List(without) => (all["kind"], all["without"]) = (json!("list"), json!(without)),
    }
    all
}

/// The names of a block that a parameter may have.
fn names<'a>(truth: &'a Block, parameter: &str) -> Vec<&'a str> {
    match parameter {
        "flight" => truth.flights.iter().map(String::as_str).collect(),
        "image" => truth.images.iter().map(|image| image.name.as_str()).collect(),
        _ => {
            let control = truth.surveyed.iter().filter(|point| point.role == Role::Control);
            control.map(|point| point.name.as_str()).collect()
        }
    }
}
