//! Recipes of blocks with a hidden effect: scenario, causes and random errors, and beside them what a diagnosis should
//! find.
//!
//! ```toml
//! about = "a fast platform and a slow shutter"
//! seed = 11
//! causes = ["rolling-shutter:readout=0.004"]    # as `misclosure inject --error` takes them
//! [scenario]
//! preset = "dike"                               # or file = "..." beside the recipe
//! set = { points = 3000, check = 300 }
//! crs = "+proj=tmerc ..."                       # absent: what the scenario states
//! [noise]
//! px = 0.3                                      # what ties and marks have
//! stated_px = 0.5                               # what block.toml says
//! [outliers]                                    # absent: none
//! fraction = 0.01
//! min_px = 3.0
//! max_px = 30.0
//! [start]                                       # absent: the approximations are the truth
//! position_m = 0.5
//! angle_deg = 0.5
//! focal_px = 20.0
//! points = false                                # tie points have no approximations
//! centre_share = 0.01                           # of the sensor: centres of distortion
//! [truth]                                       # for the judge of the tests alone, see `Truth`; absent: nobody judges
//! ```
//!
//! `mistakes` beside `causes` lists mistakes of people, as `misclosure inject --mistake` takes them:
//!
//! ```toml
//! mistakes = ["height-offset:of=gnss,by=47.3"]
//! ```
//!
//! A recipe is read here and by the test that judges; a diagnosis sees the block alone.

use super::mistakes::{self, Mistake};
use super::{Injected, Injection, Report, apply, parse};
use crate::block::Block;
use crate::scenario::{self, Scenario, SurveyNoise, add_survey_noise};
use anyhow::{Context, Result, bail, ensure};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A recipe as it is written down.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// One sentence for people.
    pub about: String,
    /// Seed of everything random.
    pub seed: u64,
    /// What goes wrong, as `ID[:key=value,...]`.
    #[serde(default)]
    pub causes: Vec<String>,
    /// Mistakes of people, as `KIND[:key=value,...]`, see [`Recipe::mistakes`].
    #[serde(default)]
    pub mistakes: Vec<String>,
    /// Parameters or groups of the camera that the model holds fixed, as `--fix` takes them.
    #[serde(default)]
    pub fix: Vec<String>,
    /// Numbers have as many decimals as files of practice, see [`Recipe::build`].
    #[serde(default)]
    pub rounded: bool,
    /// Scenario.
    pub scenario: Source,
    /// Random errors.
    pub noise: Noise,
    /// Wrong matches.
    pub outliers: Option<Outliers>,
    /// Wrong approximations.
    pub start: Option<Start>,
    /// What a diagnosis should find; a recipe of the user's needs none, nobody judges it.
    #[serde(default)]
    pub truth: Truth,
    /// Folder of the recipe: `scenario.file` is relative to it.
    #[serde(skip)]
    folder: PathBuf,
}

/// A preset or a scenario's file, and parameters of it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// Name of a preset.
    pub preset: Option<String>,
    /// Or a file beside the recipe.
    pub file: Option<String>,
    /// Values of its parameters.
    #[serde(default)]
    pub set: BTreeMap<String, f64>,
    /// Coordinate system that the block states, in place of the scenario's. It changes no coordinate: `earth-curvature`
    /// and `map-scale` among the causes make those of a map.
    pub crs: Option<String>,
}

/// Normal errors.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Standard deviation of each coordinate of ties and marks, px.
    pub px: f64,
    /// What the block states it to be, px.
    pub stated_px: f64,
    /// GNSS positions and control points have errors of their stated standard deviations. Check points are exact, so
    /// that the error of the block shows and not that of the survey.
    #[serde(default = "yes")]
    pub survey: bool,
}

fn yes() -> bool {
    true
}

/// Wrong matches among the tie points.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outliers {
    /// Part of all tie measurements.
    pub fraction: f64,
    /// Least size, px.
    pub min_px: f64,
    /// Largest size, px.
    pub max_px: f64,
}

/// Wrong approximations.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// Standard deviation of each coordinate of a projection centre, m.
    #[serde(default)]
    pub position_m: f64,
    /// Standard deviation of the rotation about each camera axis, degrees.
    #[serde(default)]
    pub angle_deg: f64,
    /// Added to every focal length, px.
    #[serde(default)]
    pub focal_px: f64,
    /// Tie points have approximations.
    #[serde(default = "yes")]
    pub points: bool,
    /// Standard deviation of each coordinate of a centre of distortion, as a share of the sensor.
    #[serde(default)]
    pub centre_share: f64,
}

/// What a diagnosis should say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ExpectedVerdict {
    /// Nothing significant is left.
    Adequate,
    /// Effects of the catalogue explain what is there.
    Missing,
    /// Something is left that no effect of the catalogue describes.
    Unexplained,
    /// Somebody made a mistake.
    Mistake,
}

/// What the judge knows.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// The verdict.
    pub verdict: ExpectedVerdict,
    /// The catalogue's effects that describe the causes.
    #[serde(default)]
    pub effects: Vec<Expected>,
    /// `v'Pv` of the base model less that of the true model ([`Truth::effects`] added), both adjusted to the block
    /// without random errors ([`Recipe::without_random_errors`]). With an unexplained cause, and of effects with a
    /// value drawn for every image, `v'Pv` of the base model there. Zero where nothing is missing.
    pub noncentrality: f64,
    /// 3D RMS of the check points of [`Recipe::with_known_noise`], before and after the effects are added. An
    /// unexplained cause stays in the measurements of both.
    pub check_mm: CheckRms,
}

impl Default for Truth {
    /// Nothing is known: no judge takes a figure that is no number.
    fn default() -> Self {
        let check_mm = CheckRms { base: f64::NAN, model: f64::NAN };
        Self { verdict: ExpectedVerdict::Adequate, effects: Vec::new(), noncentrality: f64::NAN, check_mm }
    }
}

/// 3D RMS of the check points, mm.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckRms {
    /// Base model.
    pub base: f64,
    /// True model.
    pub model: f64,
}

/// An effect of the catalogue that describes a cause.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// Its id.
    pub id: String,
    /// Sizes in the catalogue's parameters, where these describe the cause to well below their precision.
    #[serde(default)]
    pub sizes: BTreeMap<String, f64>,
    /// Parameters beside the sizes from which the true model starts (given and searched ones).
    #[serde(default)]
    pub start: BTreeMap<String, f64>,
    /// Parameters that the true model holds: those that have nothing to describe here, or that the block cannot
    /// separate.
    #[serde(default)]
    pub held: Vec<String>,
}

/// A block made from a recipe.
#[derive(Debug, Clone)]
pub struct Made {
    /// The measurements, with approximations.
    pub block: Block,
    /// The truth, without measurements.
    pub truth: Block,
    /// What the causes did.
    pub report: Report,
}

/// Reads a recipe.
///
/// # Errors
/// A file that cannot be read or is no recipe, with line and column.
pub fn read(path: &Path) -> Result<Recipe> {
    let text = crate::files::read_text(path).with_context(|| format!("cannot read the recipe {}", path.display()))?;
    let mut recipe: Recipe = toml::from_str(&text).with_context(|| format!("{}", path.display()))?;
    recipe.folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    Ok(recipe)
}

/// Decimals of image coordinates, px: matching is no better.
const IMAGE_DECIMALS: i32 = 3;
/// Decimals of coordinates, m, and of velocities, m/s.
const OBJECT_DECIMALS: i32 = 4;
/// Decimals of times, s, and temperatures, degrees Celsius.
const RECORD_DECIMALS: i32 = 3;

impl Recipe {
    /// Makes the block; the same recipe gives the same bytes, whatever the number of threads.
    ///
    /// Its mistakes are not made yet: they are made in the files, see [`Recipe::mistakes`].
    ///
    /// A `rounded` recipe gives image coordinates to 0.001 px, coordinates to 0.1 mm, times and temperatures to 0.001 s
    /// and K.
    ///
    /// # Errors
    /// A scenario or cause that cannot be used, with the reason.
    pub fn build(&self) -> Result<Made> {
        let scenario = self.scenario()?;
        let mut simulation = scenario::simulate(&scenario, self.seed)?;
        let Noise { px, stated_px, survey } = self.noise;
        for (name, value) in [("px", px), ("stated_px", stated_px)] {
            ensure!(value >= 0.0 && value.is_finite(), "noise.{name} must not be negative, it is {value}");
        }
        ensure!(stated_px > 0.0, "noise.stated_px must be positive: it is the block's a-priori precision");
        simulation.block.sigma.tie_px = stated_px;
        simulation.block.sigma.mark_px = stated_px;
        if self.start.is_some_and(|start| !start.points) {
            simulation.block.tie_points.iter_mut().for_each(|point| point.position = None);
        }
        let Injected { mut block, report } =
            apply(&simulation.block, &simulation.truth, &self.injections()?, self.seed)?;
        if survey {
            add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, self.seed);
        }
        if self.rounded {
            round(&mut block);
        }
        Ok(Made { block, truth: simulation.truth, report })
    }

    /// The same without outliers, and with the noise stated as it is: what a perfect search for outliers and a perfect
    /// estimate of the weights would leave. (Measurements that outliers pushed off the sensor are back.)
    pub fn with_known_noise(&self) -> Self {
        let noise = Noise { stated_px: self.noise.px, ..self.noise };
        Self { outliers: None, noise, ..self.clone() }
    }

    /// The same with neither outliers nor noise nor rounding; the block states the true noise, so that `v'Pv` is what
    /// the causes contribute.
    pub fn without_random_errors(&self) -> Self {
        let noise = Noise { px: 0.0, stated_px: self.noise.px, survey: false };
        Self { outliers: None, noise, rounded: false, ..self.clone() }
    }

    /// Its mistakes, to be made in the files of the block with [`mistakes::make`].
    ///
    /// # Errors
    /// A kind or a parameter that there is not.
    pub fn mistakes(&self) -> Result<Vec<Mistake>> {
        self.mistakes.iter().map(|text| mistakes::parse(text)).collect()
    }

    /// The same, with `scenario.file` in another folder.
    pub fn in_folder(self, folder: &Path) -> Self {
        Self { folder: folder.to_path_buf(), ..self }
    }

    fn scenario(&self) -> Result<Scenario> {
        let Source { preset, file, set, crs } = &self.scenario;
        let scenario = match (preset, file) {
            (Some(preset), None) => Scenario::preset(preset, set)?,
            (None, Some(file)) => {
                let path = self.folder.join(file);
                let text = crate::files::read_text(&path)
                    .with_context(|| format!("cannot read the scenario {}", path.display()))?;
                Scenario::from_toml_with(&text, file, set)?
            }
            _ => bail!("[scenario] needs one of `preset` and `file`"),
        };
        Ok(Scenario { crs: crs.clone().unwrap_or(scenario.crs), ..scenario })
    }

    /// Everything that goes wrong, as causes.
    fn injections(&self) -> Result<Vec<Injection>> {
        let mut all = self.causes.clone();
        let of_recipe = ["noise", "outliers", "start"];
        for cause in &self.causes {
            let id = cause.split(':').next().unwrap_or_default();
            ensure!(!of_recipe.contains(&id), "`{id}` is a table of the recipe, not one of its causes");
        }
        if let Some(Outliers { fraction, min_px, max_px }) = self.outliers {
            all.push(format!("outliers:fraction={fraction},min={min_px},max={max_px}"));
        }
        if let Some(Start { position_m, angle_deg, focal_px, points: _, centre_share }) = self.start {
            all.push(format!("start:position_m={position_m},angle_deg={angle_deg},centre_share={centre_share}"));
            all.push(format!("calibration:f={focal_px}"));
        }
        all.push(format!("noise:px={}", self.noise.px));
        all.iter().map(|text| parse(text)).collect()
    }
}

/// To the decimals of files of practice: image coordinates to 0.001 px, coordinates to 0.1 mm, times and temperatures
/// to 0.001 s and K.
pub fn round(block: &mut Block) {
    let to = |value: &mut f64, decimals: i32| {
        let unit = 10_f64.powi(decimals);
        *value = (*value * unit).round() / unit;
    };
    for measurement in block.ties.iter_mut().chain(&mut block.marks) {
        to(&mut measurement.x, IMAGE_DECIMALS);
        to(&mut measurement.y, IMAGE_DECIMALS);
    }
    for image in &mut block.images {
        let vectors = [Some(&mut image.pose.centre), image.gnss.as_mut().map(|gnss| &mut gnss.position)];
        for vector in vectors.into_iter().flatten().chain(&mut image.velocity) {
            vector.iter_mut().for_each(|value| to(value, OBJECT_DECIMALS));
        }
        for value in image.time_s.iter_mut().chain(&mut image.temperature_c) {
            to(value, RECORD_DECIMALS);
        }
    }
    for point in &mut block.surveyed {
        point.position.iter_mut().for_each(|value| to(value, OBJECT_DECIMALS));
    }
}
