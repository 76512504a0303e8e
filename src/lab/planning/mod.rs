//! A plan on sliders: the numbers of a scenario are turned, and what the block would show follows.
//!
//! While a slider moves, [`Planning::answer`] plans a draft ([`Scenario::draft`]); where it rests, the whole block. The
//! command that gives the same numbers in a shell stands beside them.

pub(super) mod routes;

use crate::adjust::Options;
use crate::diagnose::settings::Settings;
use crate::model::{Datum, Model};
use crate::plan::{Extent, Plan, plan_to};
use crate::report::figures::{flights_plan_profile, plan_ellipses};
use crate::report::pictures::{ellipses_of_plan, flights_of_block};
use crate::run::default_diagnosis_datum;
use crate::scenario::{Dial, FlightOverlap, Result, Scenario, simulate};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::time::Instant;

/// What a plan on sliders is opened with.
#[derive(Debug)]
pub struct Planning {
    /// Text of the scenario.
    pub text: String,
    /// Preset, or file.
    pub name: String,
    /// Seed of terrain, points and jitter.
    pub seed: u64,
    /// The base model, but for its datum.
    pub model: Model,
    /// What defines position, orientation and scale, where that was said.
    pub datum: Option<Datum>,
    /// Family-wise significance of the diagnosis.
    pub significance: f64,
    /// Threads.
    pub threads: usize,
    /// The command that gives the plan as it was opened.
    pub command: String,
}

/// What is turned.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turned {
    /// Parameters of the scenario that are not as it says.
    #[serde(default)]
    pub values: BTreeMap<String, f64>,
    /// What defines position, orientation and scale; absent: as the command line says, else all that the block has.
    pub datum: Option<Datum>,
    /// Is a quick answer wanted?
    #[serde(default)]
    pub draft: bool,
}

/// What a turned scenario would show.
#[derive(Debug, Serialize)]
pub struct Answer {
    /// The plan.
    pub plan: Plan,
    /// Overlaps that result.
    pub flights: Vec<FlightOverlap>,
    /// From the first image to the last, min.
    pub minutes: f64,
    /// Of a draft: the tie points that stand for those of the block.
    pub draft: Option<usize>,
    /// Tie points of the block.
    pub tie_points: usize,
    /// Check points of the block.
    pub check: usize,
    /// Images, control and check points as a drawing.
    pub map: String,
    /// Error ellipses of tie points as a drawing; a draft has none.
    pub ellipses: Option<String>,
    /// The command that gives the same in a shell.
    pub command: String,
    /// What it took, s.
    pub seconds: f64,
}

impl Planning {
    /// The numbers that can be turned.
    ///
    /// # Errors
    /// A text that is no scenario.
    pub fn dials(&self) -> Result<Vec<Dial>> {
        Scenario::dials(&self.text, &self.name)
    }

    /// What the turned scenario would show.
    ///
    /// # Errors
    /// Values that no simulation can use; a block that cannot be adjusted.
    pub fn answer(&self, turned: &Turned) -> anyhow::Result<Answer> {
        let began = Instant::now();
        let whole = Scenario::from_toml_with(&self.text, &self.name, &turned.values)?;
        let draft = turned.draft.then(|| whole.draft()).flatten();
        let simulation = simulate(draft.as_ref().unwrap_or(&whole), self.seed)?;
        let block = simulation.block;
        let datum = turned.datum.or(self.datum).unwrap_or_else(|| default_diagnosis_datum(&block));
        let model = Model { datum, ..self.model.clone() };
        let options = Options { threads: self.threads, ..Options::default() };
        let settings = Settings { plugins: &[], options, significance: self.significance, snoop: true, tell: &|_| {} };
        let extent = if draft.is_some() { Extent::Draft } else { Extent::Whole };
        let planned = plan_to(extent, &block, &model, &settings)?;
        Ok(Answer {
            flights: simulation.report.flights,
            minutes: block.images.last().and_then(|image| image.time_s).unwrap_or(0.0) / 60.0,
            draft: draft.as_ref().map(Scenario::tie_count),
            tie_points: whole.tie_count(),
            check: whole.surveyed.check.count,
            map: flights_plan_profile(&flights_of_block(&block)),
            ellipses: draft.is_none().then(|| plan_ellipses(&ellipses_of_plan(&planned.precision))),
            command: self.command(turned),
            plan: planned,
            seconds: began.elapsed().as_secs_f64(),
        })
    }

    fn command(&self, turned: &Turned) -> String {
        let mut command = self.command.clone();
        for (name, value) in &turned.values {
            command += &format!(" --set {name}={value}");
        }
        if let Some(datum) = turned.datum.or(self.datum)
            && let Ok(Value::String(datum)) = serde_json::to_value(datum)
        {
            command += &format!(" --datum {datum}");
        }
        command
    }
}
