//! One case: a block that is made or read, the model, and what a diagnosis should name.

use crate::block::{Block, Role};
use crate::camera::parameter_indices;
use crate::inject::mistakes;
use crate::inject::recipe::Recipe;
use crate::inject::{self, Injected};
use crate::io::block::{read_block, write_block};
use crate::model::{Datum, Model};
use crate::run::default_diagnosis_datum;
use anyhow::{Context, Result, bail, ensure};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A case of a campaign.
#[derive(Debug, Clone)]
pub struct Case {
    origin: Origin,
    /// Names of the control points; the others are check points. `None`: as the block has it.
    control: Option<Vec<String>>,
    model: ModelSpec,
    /// Effects, and mistakes as `kind of subject`, that a diagnosis should name.
    pub expected: Vec<String>,
}

#[derive(Debug, Clone)]
enum Origin {
    Made(Box<Recipe>),
    Read(Read),
}

/// A block in a folder of the campaign, measured anew under errors where there are any.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Read {
    block: PathBuf,
    #[serde(default)]
    seed: u64,
    #[serde(default)]
    causes: Vec<String>,
    #[serde(default)]
    mistakes: Vec<String>,
}

/// The model, in the words of the options of `diagnose`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct ModelSpec {
    free: Vec<String>,
    fix: Vec<String>,
    tie: Option<String>,
    datum: Option<Datum>,
    significance: f64,
}

impl Default for ModelSpec {
    fn default() -> Self {
        Self { free: Vec::new(), fix: Vec::new(), tie: None, datum: None, significance: 1e-3 }
    }
}

/// The keys that a recipe does not have.
#[derive(Deserialize)]
struct Own {
    #[serde(default)]
    expected: Vec<String>,
    control: Option<Vec<String>>,
    #[serde(default)]
    model: ModelSpec,
}

impl Case {
    /// A case as a plan has it; `folder`: of the campaign.
    ///
    /// # Errors
    /// What is no case, with the key.
    pub fn new(value: &serde_json::Value, folder: &Path) -> Result<Self> {
        let mut rest = value.clone();
        let Some(table) = rest.as_object_mut() else { bail!("a case is a table") };
        let own: serde_json::Map<_, _> =
            ["expected", "control", "model"].into_iter().filter_map(|key| table.remove_entry(key)).collect();
        let Own { expected, control, model } = serde_json::from_value(own.into())?;
        ensure!(
            model.significance > 0.0 && model.significance < 0.5,
            "model.significance {}: expected a probability above 0 and below 0.5",
            model.significance
        );
        let origin = if table.contains_key("block") {
            Origin::Read(serde_json::from_value(rest)?)
        } else {
            table.entry("about").or_insert_with(|| "".into());
            let recipe: Recipe = serde_json::from_value(rest)?;
            Origin::Made(Box::new(recipe.in_folder(folder)))
        };
        let case = Self { origin, control, model, expected };
        // What can be judged without making the block is judged when the campaign is planned.
        let (causes, mistakes) = case.errors();
        causes.iter().try_for_each(|text| inject::parse(text).map(drop))?;
        mistakes.iter().try_for_each(|text| mistakes::parse(text).map(drop))?;
        case.free()?;
        Ok(case)
    }

    /// Paths in it that a campaign has to hold: of a scenario, or of a block.
    pub fn path_of(value: &mut serde_json::Value) -> Option<&mut String> {
        let table = value.as_object_mut()?;
        let place = match table.contains_key("block") {
            true => table.get_mut("block")?,
            false => table.get_mut("scenario")?.get_mut("file")?,
        };
        match place {
            serde_json::Value::String(path) => Some(path),
            _ => None,
        }
    }

    /// The level of the diagnosis.
    pub fn significance(&self) -> f64 {
        self.model.significance
    }

    fn errors(&self) -> (&[String], &[String]) {
        match &self.origin {
            Origin::Made(recipe) => (&recipe.causes, &recipe.mistakes),
            Origin::Read(read) => (&read.causes, &read.mistakes),
        }
    }

    /// The block; `folder`: of the campaign.
    ///
    /// # Errors
    /// A scenario, a block, an error or a mistake that cannot be used.
    pub fn block(&self, folder: &Path) -> Result<Block> {
        let mut block = match &self.origin {
            Origin::Made(recipe) => recipe.build()?.block,
            Origin::Read(read) => read.measured(&folder.join(&read.block))?,
        };
        let (_, mistakes) = self.errors();
        if !mistakes.is_empty() {
            let mistakes = mistakes.iter().map(|text| mistakes::parse(text)).collect::<Result<Vec<_>>>()?;
            let place = tempfile::tempdir().context("no temporary folder for the block")?;
            write_block(&block, place.path())?;
            mistakes::make(place.path(), &mistakes)?;
            block = read_block(place.path())?.block;
        }
        if let Some(control) = &self.control {
            for name in control {
                ensure!(block.surveyed.iter().any(|point| point.name == *name), "control: no surveyed point `{name}`");
            }
            for point in &mut block.surveyed {
                point.role = if control.contains(&point.name) { Role::Control } else { Role::Check };
            }
        }
        Ok(block.about_its_centre())
    }

    /// The model of a diagnosis of `block`.
    ///
    /// # Errors
    /// A camera parameter that there is not.
    pub fn model(&self, block: &Block) -> Result<Model> {
        let datum = self.model.datum.unwrap_or_else(|| default_diagnosis_datum(block));
        Ok(Model { free: self.free()?, tie_dc_to_pp: self.model.tie.is_some(), datum, ..Model::default() })
    }

    fn free(&self) -> Result<[bool; crate::camera::PARAMETER_COUNT]> {
        let ModelSpec { free, fix, tie, .. } = &self.model;
        if let Some(tie) = tie.as_deref().filter(|tie| *tie != "dc=pp") {
            bail!("model.tie `{tie}`: expected dc=pp");
        }
        let indices = |name: &String| {
            parameter_indices(name).with_context(|| format!("model: `{name}` is no parameter or group of a camera"))
        };
        let mut all = [free.is_empty(); crate::camera::PARAMETER_COUNT];
        for name in free {
            indices(name)?.into_iter().for_each(|k| all[k] = true);
        }
        for name in fix {
            indices(name)?.into_iter().for_each(|k| all[k] = false);
        }
        Ok(all)
    }
}

impl Read {
    fn measured(&self, folder: &Path) -> Result<Block> {
        let block = read_block(folder)?.block;
        if self.causes.is_empty() {
            return Ok(block);
        }
        let truth = folder.join("truth");
        ensure!(truth.is_dir(), "{} has no truth/: errors need a simulated block", folder.display());
        let injections = self.causes.iter().map(|text| inject::parse(text)).collect::<Result<Vec<_>>>()?;
        let Injected { block, .. } = inject::apply(&block, &read_block(&truth)?.block, &injections, self.seed)?;
        Ok(block)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn case(change: serde_json::Value) -> Result<Case> {
        let mut value = json!({
            "seed": 3,
            "scenario": { "preset": "closerange", "set": { "points": 40 } },
            "noise": { "px": 0.1, "stated_px": 0.1 },
        });
        let table = value.as_object_mut().expect("a table");
        table.extend(change.as_object().expect("a table").clone());
        Case::new(&value, Path::new(""))
    }

    #[test]
    fn a_block_is_made_with_its_mistakes_and_its_control() {
        let plain = case(json!({})).expect("a case").block(Path::new("")).expect("a block");
        let control: Vec<&str> =
            plain.surveyed.iter().filter(|p| p.role == Role::Control).map(|p| p.name.as_str()).collect();
        let (kept, other) = (&control[..3], control[3]);
        let changed = case(json!({ "control": kept, "mistakes": ["height-offset:of=check,by=47.3"] }));
        let changed = changed.expect("a case").block(Path::new("")).expect("a block");
        assert_eq!(changed.count(Role::Control), 3);
        let height = |block: &Block, name: &str| {
            let point = block.surveyed.iter().find(|p| p.name == name).expect("the point");
            point.position.z + block.origin.z
        };
        assert!((height(&changed, other) - height(&plain, other)).abs() < 1e-6, "it was control when heights changed");
        let check = plain.surveyed.iter().find(|p| p.role == Role::Check).map(|p| p.name.as_str()).expect("a point");
        assert!((height(&changed, check) - height(&plain, check) - 47.3).abs() < 1e-6);
    }

    #[test]
    fn what_is_no_case_is_refused_before_it_is_worked() {
        let refused = |change| format!("{:#}", case(change).expect_err("refused"));
        assert!(refused(json!({ "sead": 1 })).contains("sead"));
        assert!(refused(json!({ "causes": ["rolling-shuter"] })).contains("rolling-shuter"));
        assert!(refused(json!({ "mistakes": ["feet"] })).contains("feet"));
        assert!(refused(json!({ "model": { "free": ["focus"] } })).contains("focus"));
        assert!(refused(json!({ "model": { "tie": "pp=dc" } })).contains("pp=dc"));
        assert!(refused(json!({ "model": { "significance": 2.0 } })).contains("significance"));
        let fixed = case(json!({ "model": { "free": ["f", "pp"], "fix": ["ppx"], "datum": "control" } }));
        let fixed = fixed.expect("a case");
        let model = fixed.model(&fixed.block(Path::new("")).expect("a block")).expect("a model");
        assert_eq!((model.free.iter().filter(|own| **own).count(), model.datum), (2, Datum::Control));
    }
}
