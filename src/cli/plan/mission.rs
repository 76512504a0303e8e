//! A mission of a flight-planning program in the place of a scenario's flights.

use super::super::text::path_text;
use super::super::{Console, Usage};
use crate::scenario::Scenario;
use crate::scenario::mission::{Given, MOST_BYTES, Mission, apply, read};
use serde_json::{Value, json};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The mission that is flown.
#[derive(Debug, clap::Args)]
pub struct MissionOptions {
    /// Images of a planned mission in the place of the scenario's: .kml, .kmz, QGroundControl's .plan, DJI's .kmz or
    /// .wpml
    #[arg(long, alias = "from-kml", value_name = "FILE")]
    mission: Option<PathBuf>,
    /// Height of the ground in the mission's heights, m [default: the take-off's]
    #[arg(long, value_name = "M", requires = "mission", allow_negative_numbers = true)]
    ground: Option<f64>,
}

/// A mission that was read.
#[derive(Debug)]
pub struct Planned {
    file: String,
    mission: Mission,
    base: Scenario,
}

impl MissionOptions {
    /// Refuses a mission beside a block, which has images of its own.
    ///
    /// # Errors
    /// [`Usage`].
    pub fn judge(&self, block: Option<&Path>) -> Result<(), Usage> {
        match (&self.mission, block) {
            (Some(_), Some(block)) => {
                let block = path_text(block);
                Err(Usage(format!("--mission: {block} is a block; a mission takes the place of a scenario's flights")))
            }
            _ => Ok(()),
        }
    }

    /// Reads the mission; `base`: the scenario whose flights it replaces. `None` where there is none.
    ///
    /// # Errors
    /// [`Usage`]; what cannot be read, with its place.
    pub fn read(&self, base: impl FnOnce() -> anyhow::Result<Scenario>) -> anyhow::Result<Option<Planned>> {
        let Some(path) = &self.mission else { return Ok(None) };
        if self.ground.is_some_and(|ground| !ground.is_finite()) {
            return Err(Usage("--ground: expected a height in metres".into()).into());
        }
        let base = base()?;
        let file = path_text(path);
        let bytes = bytes(path).map_err(|error| Usage(format!("cannot read the mission {file}: {error}")))?;
        let mission = read(&file, &bytes, &Given::of(&base, self.ground))?;
        Ok(Some(Planned { file, mission, base }))
    }
}

impl Planned {
    /// Flies the mission in a scenario: the one whose flights it replaces, with or without additions.
    ///
    /// # Errors
    /// What mission and scenario leave open.
    fn flown(&self, scenario: Scenario) -> anyhow::Result<(Scenario, Vec<String>)> {
        Ok(apply(&self.file, &self.mission, scenario, &self.base)?)
    }

    /// What was taken for granted, for people and as JSON.
    ///
    /// # Errors
    /// What mission and scenario leave open.
    pub fn told(&self, console: &Console) -> anyhow::Result<Value> {
        let (_, notes) = self.flown(self.base.clone())?;
        notes.iter().for_each(|note| console.message(&format!("{}: {note}", self.file)));
        Ok(json!({ "file": self.file, "images": self.mission.exposures.len(), "notes": notes }))
    }
}

/// Reads the file up to one byte beyond the limit, at which the reader refuses it.
fn bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    crate::files::open(path)?.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// A scenario with the images of a mission, where there is one.
///
/// # Errors
/// What mission and scenario leave open.
pub fn with_mission(scenario: Scenario, mission: Option<&Planned>) -> anyhow::Result<Scenario> {
    match mission {
        Some(mission) => Ok(mission.flown(scenario)?.0),
        None => Ok(scenario),
    }
}
