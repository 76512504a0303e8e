//! A block whose errors one chooses: it is measured anew under them, and the truth stands beside every estimate.

use super::change::Change;
use crate::block::Block;
use crate::inject::mistakes::{self, Mistake};
use crate::inject::{self, Cause, DefaultValue, Injected, ParameterSpec};
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
        let parameters: Vec<Value> = cause.parameters().iter().map(parameter).collect();
        json!({ "id": cause.id(), "about": cause.summary(), "parameters": parameters })
    };
    let causes: Vec<Value> = inject::registry().iter().map(cause).collect();
    json!({
        "preset": simulated.preset, "errors": simulated.errors, "mistakes": simulated.mistakes, "seed": simulated.seed,
        "causes": causes,
    })
}

fn parameter(spec: &ParameterSpec) -> Value {
    let base = json!({ "name": spec.name, "unit": spec.unit, "about": spec.help, "default": null, "min": null, "max": null, "choices": null });
    let Value::Object(mut all) = base else { return base };
    match spec.default {
        DefaultValue::Number(number) => {
            let reach = REACH * number.abs().max(f64::MIN_POSITIVE);
            all.insert("default".into(), json!(number));
            if number != 0.0 {
                all.insert("min".into(), json!(if number < 0.0 { -reach } else { 0.0 }));
                all.insert("max".into(), json!(if number < 0.0 { 0.0 } else { reach }));
            }
        }
        DefaultValue::Flag(flag) => {
            all.insert("default".into(), json!(u8::from(flag)));
            all.insert("choices".into(), json!(["0", "1"]));
        }
        DefaultValue::Choice(word, choices) => {
            all.insert("default".into(), json!(word));
            all.insert("choices".into(), json!(choices));
        }
        DefaultValue::Optional(_) | DefaultValue::Name(_) | DefaultValue::List(_) => {}
    }
    Value::Object(all)
}
