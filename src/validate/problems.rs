//! The bundle problems of the suite: each a scenario with its errors, generated when it is asked for, and what is
//! estimated.

use super::certificate::Certificate;
use crate::block::Block;
use crate::camera::{PARAMETER_COUNT, parameter_indices};
use crate::effects;
use crate::inject::{apply, parse, recipe};
use crate::model::{Datum, EffectRef, EffectTerm, Loss, Model, Prior, TieWeights};
use crate::scenario::{Scenario, SurveyNoise, add_survey_noise, simulate};
use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// How long a problem takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Size {
    /// Below a second.
    #[default]
    Small,
    /// Thousands of images.
    Large,
}

/// A bundle problem as `data/validation/problems.toml` states it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BundleProblem {
    /// Its name, that of its folder in a suite.
    pub name: String,
    /// What it is, in a line.
    pub about: String,
    /// Scenario among those of the suite.
    scenario: Option<String>,
    /// Or a preset.
    preset: Option<String>,
    /// Parameters of the scenario.
    #[serde(default)]
    set: BTreeMap<String, f64>,
    /// Seed of everything random.
    pub seed: u64,
    /// Standard deviation of each image coordinate, as the block states it, px.
    pub px: f64,
    /// What goes wrong, start values included.
    #[serde(default)]
    causes: Vec<String>,
    /// How long it takes.
    #[serde(default)]
    pub size: Size,
    /// Camera parameters and groups that are estimated.
    pub free: Vec<String>,
    /// The centre of distortion is the principal point.
    #[serde(default)]
    pub tie: bool,
    /// Datum; absent: free.
    #[serde(default = "free_datum")]
    pub datum: Datum,
    /// Loss; absent: none.
    #[serde(default = "no_loss")]
    pub loss: Loss,
    /// Weights of tie points.
    #[serde(default = "unit_weights")]
    tie_weights: TieWeights,
    /// Effects in the model.
    #[serde(default)]
    effects: Vec<Term>,
    /// Observed camera parameters.
    #[serde(default)]
    priors: Vec<Prior>,
    /// Of a problem without a solution: parameters that its measurements do not determine.
    #[serde(default)]
    pub null_space: Vec<String>,
    /// And how many directions among these.
    #[serde(default)]
    pub null_dimension: usize,
}

/// An effect in the model of a problem.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Term {
    id: String,
    #[serde(default)]
    values: BTreeMap<String, f64>,
    #[serde(default)]
    held: Vec<String>,
}

fn free_datum() -> Datum {
    Datum::Free
}

fn no_loss() -> Loss {
    Loss::None
}

fn unit_weights() -> TieWeights {
    TieWeights::Unit
}

macro_rules! texts {
    ($($name:literal)*) => {
        [$(($name, include_str!(concat!("../../data/validation/scenarios/", $name, ".toml")))),*]
    };
}

/// Scenarios of the suite, by name.
const SCENARIOS: [(&str, &str); 13] = texts!(
    "area" "cameras" "crowd" "flat" "high" "many" "pair" "pinhole" "radial" "strip" "targets" "turning" "wide"
);

/// Every problem, in the order of the table.
///
/// # Errors
/// A table of problems that cannot be read (a fault of the program, which a test would find).
pub fn problems() -> Result<&'static [BundleProblem]> {
    #[derive(Deserialize)]
    struct File {
        problem: Vec<BundleProblem>,
    }
    static ALL: LazyLock<Result<Vec<BundleProblem>, String>> = LazyLock::new(|| {
        let file = toml::from_str::<File>(include_str!("../../data/validation/problems.toml"));
        file.map(|file| file.problem).map_err(|error| error.to_string())
    });
    ALL.as_deref().map_err(|error| anyhow::anyhow!("data/validation/problems.toml: {error}"))
}

/// The problem of a name.
///
/// # Errors
/// No such problem.
pub fn find(name: &str) -> Result<&'static BundleProblem> {
    let all = problems()?;
    let found = all.iter().find(|problem| problem.name == name);
    found.with_context(|| {
        let names: Vec<&str> = all.iter().map(|problem| problem.name.as_str()).collect();
        format!("the suite has no problem `{name}`, expected one of {}", names.join(", "))
    })
}

impl BundleProblem {
    /// Makes the block: the same on every machine.
    ///
    /// # Errors
    /// A scenario or a cause that cannot be used.
    pub fn block(&self) -> Result<Block> {
        let of_problem = || format!("problem `{}`", self.name);
        let scenario = match (&self.scenario, &self.preset) {
            (Some(name), None) => {
                let text = SCENARIOS.iter().find(|(other, _)| other == name);
                let (_, text) = text.with_context(|| format!("no scenario `{name}`")).with_context(of_problem)?;
                Scenario::from_toml_with(text, name, &self.set)
            }
            (None, Some(name)) => Scenario::preset(name, &self.set),
            _ => anyhow::bail!("problem `{}` needs one of `scenario` and `preset`", self.name),
        };
        let mut simulation = simulate(&scenario.with_context(of_problem)?, self.seed).with_context(of_problem)?;
        simulation.block.sigma.tie_px = self.px;
        simulation.block.sigma.mark_px = self.px;
        let noise = format!("noise:px={}", self.px);
        let errors: Vec<_> = self
            .causes
            .iter()
            .chain([&noise])
            .map(|text| parse(text))
            .collect::<Result<_>>()
            .with_context(of_problem)?;
        let mut block = apply(&simulation.block, &simulation.truth, &errors, self.seed).with_context(of_problem)?.block;
        add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, self.seed);
        recipe::round(&mut block);
        block.name.clone_from(&self.name);
        Ok(block)
    }

    /// What is estimated.
    ///
    /// # Errors
    /// A parameter or an effect that does not exist.
    pub fn model(&self) -> Result<Model> {
        let mut free = [false; PARAMETER_COUNT];
        for name in &self.free {
            let indices = parameter_indices(name);
            let indices = indices.with_context(|| format!("problem `{}`: no camera parameter `{name}`", self.name))?;
            indices.into_iter().for_each(|k| free[k] = true);
        }
        let effects = self.effects.iter().map(|term| {
            let effect = effects::find(&term.id);
            let effect = effect.with_context(|| format!("problem `{}`: no effect `{}`", self.name, term.id))?;
            Ok(EffectTerm { effect: EffectRef::Builtin(effect), values: term.values.clone(), held: term.held.clone() })
        });
        Ok(Model {
            free,
            tie_dc_to_pp: self.tie,
            datum: self.datum,
            loss: self.loss,
            tie_weights: self.tie_weights,
            effects: effects.collect::<Result<_>>()?,
            priors: self.priors.clone(),
            ..Model::default()
        })
    }

    /// Has it no solution, but a null space?
    pub fn is_deficient(&self) -> bool {
        self.null_dimension > 0
    }

    /// Its certificate.
    ///
    /// # Errors
    /// None that can be read.
    pub fn certificate(&self) -> Result<Certificate> {
        let text = super::certificates::text_of(&self.name);
        let text = text.with_context(|| format!("problem `{}` has no certificate", self.name))?;
        let certificate: Certificate =
            serde_json::from_str(text).with_context(|| format!("certificate of `{}`", self.name))?;
        ensure!(certificate.problem == self.name, "certificate of `{}`: it is of `{}`", self.name, certificate.problem);
        Ok(certificate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Problem;

    #[test]
    fn every_problem_has_a_certificate_and_a_name_of_its_own() -> Result<()> {
        let mut names: Vec<&str> = problems()?.iter().map(|problem| problem.name.as_str()).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
        assert!(count >= 30, "{count} problems");
        for problem in problems()? {
            problem.certificate()?;
        }
        Ok(())
    }

    #[test]
    fn a_problem_is_the_same_every_time_and_can_be_laid_out() -> Result<()> {
        for name in ["pair", "shift-of-everything", "camera-priors"] {
            let problem = find(name)?;
            let block = problem.block()?;
            assert_eq!(block, problem.block()?);
            Problem::new(&block, &problem.model()?)?;
        }
        assert!(find("no-such").is_err());
        Ok(())
    }
}
