//! QGroundControl's `.plan`: commands of MAVLink one after the other, as JSON.
//!
//! A survey holds the commands that QGroundControl made of it (`TransectStyleComplexItem.Items`); these are read, not
//! its polygon. Numbers of commands and frames are those of MAVLink's `MAV_CMD` and `MAV_FRAME`.

use super::walk::{Nose, Step, Waypoint, Yaw, walk};
use super::{Given, Mission, MissionError, Place, Result, above_ground};
use serde_json::Value;
use std::collections::BTreeMap;

/// `firmwareType` of ArduPilot, which does not use the yaw of a waypoint.
const ARDUPILOT: u64 = 3;
/// `vehicleType` of aeroplanes, which fly at `cruiseSpeed`, not `hoverSpeed`.
const FIXED_WING: u64 = 1;
/// Waypoint, three kinds of loitering, spline, loitering to a height.
const WAYPOINTS: [u64; 6] = [16, 17, 18, 19, 82, 31];
/// Landing and take-off, of aeroplanes that hover, too: where no place stands, at the planned home.
const ENDS: [u64; 4] = [21, 22, 84, 85];
/// Returning, waiting, and the camera's mode: they change no image. Aiming at nothing any more, too.
const HARMLESS: [u64; 6] = [20, 93, 112, 189, 197, 530];
/// `AltitudeMode` and `DistanceMode` of heights above a model of the terrain.
const ABOVE_TERRAIN: u64 = 3;
/// Bit of the gimbal's flags: its yaw is from north.
const YAW_LOCK: u32 = 16;

/// Reads a plan.
///
/// # Errors
/// What is no plan, has an unknown height, or aims or triggers the camera in a way that is not read.
pub(super) fn read(file: &str, text: &str, given: &Given) -> Result<Mission> {
    let root: Value = serde_json::from_str(text).map_err(|error| {
        let place = Place::Character(error.line(), error.column());
        MissionError::new(file, place, format!("not JSON: {error}"))
    })?;
    if root["fileType"] != "Plan" {
        return Err(at(file, "fileType", "expected \"Plan\""));
    }
    let mission = &root["mission"];
    let home = mission["plannedHomePosition"].as_array().and_then(|home| {
        let number = |k: usize| home.get(k)?.as_f64();
        Some([number(0)?, number(1)?, number(2)?])
    });
    let speed = if mission["vehicleType"] == FIXED_WING { "cruiseSpeed" } else { "hoverSpeed" };
    let mut reader = Reader {
        file,
        ground_m: given.ground_m,
        home,
        uses_yaw: mission["firmwareType"] != ARDUPILOT,
        speed: mission[speed].as_f64().filter(|speed| *speed > 0.0),
        speeds: Vec::new(),
        steps: Vec::new(),
        left_out: BTreeMap::new(),
        above_sea: 0,
        above_terrain: 0,
        survey_m: None,
    };
    reader.items(mission, "mission.items", "items")?;
    let exposures = walk(&reader.steps).map_err(|problem| at(file, "mission.items", problem))?;
    let notes = reader.notes();
    Ok(Mission { name: String::new(), speed_mps: reader.speeds.first().copied().or(reader.speed), exposures, notes })
}

fn at(file: &str, path: &str, problem: impl Into<String>) -> MissionError {
    MissionError::new(file, Place::Value(path.into()), problem)
}

struct Reader<'a> {
    file: &'a str,
    ground_m: Option<f64>,
    /// Latitude, longitude, height above the sea.
    home: Option<[f64; 3]>,
    uses_yaw: bool,
    /// Now, m/s.
    speed: Option<f64>,
    /// While images are taken.
    speeds: Vec<f64>,
    steps: Vec<Step>,
    /// Commands, and how often.
    left_out: BTreeMap<u64, usize>,
    above_sea: usize,
    above_terrain: usize,
    /// Height above the terrain of the survey that is read, m.
    survey_m: Option<f64>,
}

impl Reader<'_> {
    fn items(&mut self, holder: &Value, path: &str, key: &str) -> Result<()> {
        let items = holder[key].as_array().ok_or_else(|| at(self.file, path, "expected a list of items"))?;
        for (number, item) in items.iter().enumerate() {
            let path = format!("{path}[{number}]");
            match item["type"].as_str() {
                Some("SimpleItem") => self.simple(item, &path)?,
                Some("ComplexItem") => match item["complexItemType"].as_str() {
                    Some("survey" | "CorridorScan") => {
                        let path = format!("{path}.TransectStyleComplexItem.Items");
                        let survey = &item["TransectStyleComplexItem"];
                        let camera = &survey["CameraCalc"];
                        let is_above = camera["DistanceMode"].as_u64() == Some(ABOVE_TERRAIN);
                        self.survey_m = camera["DistanceToSurface"].as_f64().filter(|_| is_above);
                        self.items(survey, &path, "Items")?;
                        self.survey_m = None;
                    }
                    Some("fwLandingPattern" | "vtolLandingPattern") => {}
                    _ => return Err(self.other(&path, item, "complexItemType", "\"survey\" or \"CorridorScan\"")),
                },
                _ => return Err(self.other(&path, item, "type", "\"SimpleItem\" or \"ComplexItem\"")),
            }
        }
        Ok(())
    }

    fn simple(&mut self, item: &Value, path: &str) -> Result<()> {
        let refuse = |problem: String| at(self.file, path, problem);
        let command = item["command"].as_u64().ok_or_else(|| refuse("expected a command".into()))?;
        let values = item["params"].as_array().filter(|values| values.len() == 7);
        let values = values.ok_or_else(|| refuse("expected seven params".into()))?;
        let params: Vec<Option<f64>> = values.iter().map(Value::as_f64).collect();
        let value = |k: usize| params[k].unwrap_or(0.0);
        match command {
            own if WAYPOINTS.contains(&own) || ENDS.contains(&own) => {
                let is_end = ENDS.contains(&own);
                let stated = params[4].zip(params[5]).map(|(latitude, longitude)| [latitude, longitude]);
                // Zeros stand for the place where the aircraft is.
                let place = match stated.filter(|place| !is_end || *place != [0.0, 0.0]) {
                    None if is_end => match self.home {
                        Some([latitude, longitude, _]) => [latitude, longitude],
                        None => return Ok(()),
                    },
                    place => place.ok_or_else(|| refuse("params: expected latitude and longitude".into()))?,
                };
                // On the ground there is no image.
                let height_m = if own == 21 || own == 85 { 0.0 } else { self.height(item, params[6], path)? };
                let nose = match params[3].filter(|_| self.uses_yaw && own == 16) {
                    Some(yaw) => Nose::Held(yaw),
                    None => Nose::Path,
                };
                self.steps.push(Step::Fly(Waypoint { place, height_m, nose }));
            }
            206 if value(0) > 0.0 => self.trigger(value(0), value(2) == 1.0),
            206 | 2001 => self.steps.push(Step::Stop),
            203 if value(4) == 1.0 => self.shoot(),
            2000 if value(2) == 1.0 => self.shoot(),
            2000 if value(2) == 0.0 && value(1) > 0.0 => {
                let speed = self.speed.ok_or_else(|| refuse("images by time: expected a speed before them".into()))?;
                self.trigger(value(1) * speed, true);
            }
            2000 => {
                return Err(refuse("params: expected one image, or an interval and images without end (0)".into()));
            }
            205 | 1000 => self.gimbal(command, &params, path)?,
            178 if value(1) > 0.0 => self.speed = Some(value(1)),
            195 | 201 => return Err(refuse(format!("command {command} aims at a place, which is not read"))),
            214 | 2003 => {
                return Err(refuse(format!(
                    "command {command}: expected images by distance (206) or single ones (2000)"
                )));
            }
            177 => return Err(refuse("command 177 repeats others, which is not read".into())),
            own if HARMLESS.contains(&own) => {}
            other => *self.left_out.entry(other).or_default() += 1,
        }
        Ok(())
    }

    /// Height above the ground.
    fn height(&mut self, item: &Value, stated: Option<f64>, path: &str) -> Result<f64> {
        let refuse = |problem: String| at(self.file, path, problem);
        // It made heights above the sea of those above the terrain, which stand beside them.
        let own = item["Altitude"].as_f64().filter(|_| item["AltitudeMode"].as_u64() == Some(ABOVE_TERRAIN));
        if let Some(height) = own.or(self.survey_m) {
            self.above_terrain += 1;
            return Ok(height);
        }
        let height = stated.ok_or_else(|| refuse("params: expected a height".into()))?;
        match item["frame"].as_u64() {
            Some(3 | 6) => Ok(height - self.ground_m.unwrap_or(0.0)),
            Some(10 | 11) => {
                self.above_terrain += 1;
                Ok(height)
            }
            Some(0 | 5) => {
                self.above_sea += 1;
                above_ground(height, self.ground_m.or(self.home.map(|home| home[2]))).map_err(refuse)
            }
            _ => Err(self.other(path, item, "frame", "0, 3 or 10")),
        }
    }

    /// A key of an item has another value than those that are read.
    fn other(&self, path: &str, item: &Value, key: &str, expected: &str) -> MissionError {
        at(self.file, path, format!("{key}: expected {expected}, found {}", item[key]))
    }

    /// Camera's pitch and yaw.
    fn gimbal(&mut self, command: u64, params: &[Option<f64>], path: &str) -> Result<()> {
        let (pitch, yaw, from_north) = match command {
            205 if params[1].is_some_and(|roll| roll != 0.0) => {
                return Err(at(self.file, path, "params: expected a camera without roll"));
            }
            205 => (params[0], params[2], false),
            _ => (params[0], params[1], params[4].is_some_and(|flags| flags as u32 & YAW_LOCK != 0)),
        };
        self.steps.extend(pitch.map(Step::Pitch));
        self.steps.extend(yaw.map(|yaw| Step::Yaw(if from_north { Yaw::OfNorth(yaw) } else { Yaw::OfNose(yaw) })));
        Ok(())
    }

    fn trigger(&mut self, metres: f64, now: bool) {
        self.speeds.extend(self.speed);
        self.steps.push(Step::Every { metres, now });
    }

    fn shoot(&mut self) {
        self.speeds.extend(self.speed);
        self.steps.push(Step::Shoot);
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some(first) = self.speeds.first().filter(|first| self.speeds.iter().any(|other| other != *first)) {
            notes.push(format!("The speed changes between images: {first} m/s, that of the first ones, is taken."));
        }
        if let (Some(home), true, None) = (self.home, self.above_sea > 0, self.ground_m) {
            let height = home[2];
            notes.push(format!("Heights are above the sea: the ground is at the planned home, {height} m."));
        }
        if self.above_terrain > 0 {
            notes.push("Heights are above the terrain, which is a plain here.".into());
        }
        if !self.left_out.is_empty() {
            let list: Vec<String> = self.left_out.iter().map(|(own, count)| format!("{own} ({count})")).collect();
            notes.push(format!("Commands that are not read (how often): {}.", list.join(", ")));
        }
        notes
    }
}
