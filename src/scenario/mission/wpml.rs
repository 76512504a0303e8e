//! DJI's `waylines.wpml`: waypoints in folders, and groups of actions that a trigger sets off.
//!
//! ```text
//! Folder              one path: executeHeightMode, autoFlightSpeed
//!   startActionGroup  before the first waypoint
//!   Placemark         index, Point, executeHeight, waypointHeadingParam, waypointGimbalHeadingParam
//!     actionGroup     from one waypoint to another: actionTrigger, action ...
//! ```
//!
//! Group and waypoint belong together by the index, wherever the group stands.

use super::walk::{Step, Yaw, walk};
use super::wpml_places::waypoint;
use super::xml::{Element, parse};
use super::{Given, Mission, Result};
use std::collections::BTreeSet;

/// What aircraft and camera do that changes no image.
const HARMLESS: [&str; 8] = [
    "hover",
    "startRecord",
    "stopRecord",
    "customDirName",
    "focus",
    "setFocusType",
    "gimbalAngleLock",
    "gimbalAngleUnlock",
];
/// Turns the camera on the way to the next waypoint.
const EVENLY: &str = "gimbalEvenlyRotate";

/// Waypoints of all groups together, at most.
const MOST_ACTIVE: usize = 1_000_000;

/// Reads a document.
///
/// # Errors
/// Waypoints without a place or a height above a known ground; actions that aim or trigger the camera in a way that is
/// not read.
pub(super) fn read(file: &str, text: &str, given: &Given) -> Result<Mission> {
    let root = parse(file, text)?;
    let mut folders = Vec::new();
    root.descendants("Folder", &mut folders);
    if folders.is_empty() {
        return Err(root.refuse(file, "expected a <Folder> with waypoints"));
    }
    let mut notes = BTreeSet::new();
    let (mut exposures, mut speeds) = (Vec::new(), Vec::new());
    for folder in folders {
        let speed = folder.number(file, "autoFlightSpeed")?;
        let reader = Reader { file, folder, given, speed };
        let steps = reader.steps(&mut speeds, &mut notes)?;
        exposures.extend(walk(&steps).map_err(|problem| folder.refuse(file, problem))?);
    }
    if let Some(first) = speeds.first().filter(|first| speeds.iter().any(|other| other != *first)) {
        notes.insert(format!("The speed changes on the way: {first} m/s, the first one, is taken."));
    }
    let speed_mps = speeds.first().copied();
    Ok(Mission { name: String::new(), speed_mps, exposures, notes: notes.into_iter().collect() })
}

/// When a group of actions is done.
enum Trigger {
    /// At its waypoints.
    Reach,
    /// By distance along the path, m.
    Metres(f64),
    /// On the leg behind each of its waypoints.
    Between,
}

struct Group<'a> {
    from: f64,
    to: f64,
    trigger: Trigger,
    element: &'a Element,
}

impl Group<'_> {
    /// Does it take images on its way?
    fn triggers(&self) -> bool {
        let images = ["takePhoto", "startTimeLapse"];
        !matches!(self.trigger, Trigger::Reach)
            && self.element.all("action").any(|own| images.contains(&own.text_of("actionActuatorFunc")))
    }
}

struct Reader<'a> {
    file: &'a str,
    folder: &'a Element,
    given: &'a Given,
    /// m/s.
    speed: Option<f64>,
}

impl<'a> Reader<'a> {
    /// What happens in the folder.
    fn steps(&self, speeds: &mut Vec<f64>, notes: &mut BTreeSet<String>) -> Result<Vec<Step>> {
        let Self { file, folder, given, speed } = *self;
        speeds.extend(speed);
        let mut placemarks = Vec::new();
        for placemark in folder.all("Placemark") {
            speeds.extend(placemark.number(file, "waypointSpeed")?.filter(|speed| *speed > 0.0));
            placemarks.push((placemark.required(file, "index")?, placemark));
        }
        placemarks.sort_by(|a, b| a.0.total_cmp(&b.0));
        let groups = self.groups()?;
        let all: Vec<&Element> = folder.all("startActionGroup").chain(groups.iter().map(|own| own.element)).collect();
        let moves = |action: &Element| ["gimbalRotate", EVENLY].contains(&action.text_of("actionActuatorFunc"));
        let has_moves = all.iter().any(|group| group.all("action").any(moves));
        let mut steps = Vec::new();
        for group in folder.all("startActionGroup") {
            self.act(group, &mut steps, notes)?;
        }
        let active = self.active(&placemarks, &groups)?;
        for ((index, placemark), groups) in placemarks.into_iter().zip(active) {
            for group in groups.iter().filter(|own| own.from < index && matches!(own.trigger, Trigger::Between)) {
                self.turn(group.element, &mut steps)?;
            }
            if let Some(angle) = placemark.child("waypointGimbalHeadingParam").filter(|_| !has_moves) {
                let pitch = angle.number(file, "waypointGimbalPitchAngle")?;
                // Zero is level: what programs write that turn the camera by actions.
                steps.extend(pitch.filter(|pitch| *pitch != 0.0).map(Step::PitchAlong));
            }
            steps.push(Step::Fly(waypoint(file, folder, placemark, given, notes)?));
            if groups.iter().any(|own| own.triggers() && own.to == index && own.from < index) {
                steps.push(Step::Stop);
            }
            for group in groups.iter().filter(|own| matches!(own.trigger, Trigger::Reach)) {
                self.act(group.element, &mut steps, notes)?;
            }
            for group in groups.iter().filter(|own| own.from == index && own.to > index) {
                if !matches!(group.trigger, Trigger::Reach) {
                    self.begin(group, &mut steps, notes)?;
                }
            }
        }
        Ok(steps)
    }

    /// The groups of each waypoint, from that where they begin to that where they end.
    fn active<'g>(&self, placemarks: &[(f64, &Element)], groups: &'g [Group<'a>]) -> Result<Vec<Vec<&'g Group<'a>>>> {
        let mut active = vec![Vec::new(); placemarks.len()];
        let mut count = 0;
        for group in groups {
            let first = placemarks.partition_point(|(index, _)| *index < group.from);
            let behind = placemarks.partition_point(|(index, _)| *index <= group.to);
            if behind <= first || placemarks[first].0 != group.from {
                let expected = "expected the index of a waypoint, and an end that is not before it";
                return Err(group.element.refuse(self.file, format!("actionGroupStartIndex: {expected}")));
            }
            count += behind - first;
            if count > MOST_ACTIVE {
                let problem = format!("expected at most {MOST_ACTIVE} waypoints in all groups together");
                return Err(group.element.refuse(self.file, problem));
            }
            active[first..behind].iter_mut().for_each(|own| own.push(group));
        }
        Ok(active)
    }

    fn groups(&self) -> Result<Vec<Group<'a>>> {
        let mut elements = Vec::new();
        self.folder.descendants("actionGroup", &mut elements);
        elements.into_iter().map(|element| self.group(element)).collect()
    }

    fn group(&self, element: &'a Element) -> Result<Group<'a>> {
        let file = self.file;
        let (from, to) =
            (element.required(file, "actionGroupStartIndex")?, element.required(file, "actionGroupEndIndex")?);
        let trigger = element.child("actionTrigger").ok_or_else(|| element.refuse(file, "expected <actionTrigger>"))?;
        let trigger = match trigger.text_of("actionTriggerType") {
            "reachPoint" => Trigger::Reach,
            "betweenAdjacentPoints" => Trigger::Between,
            "multipleDistance" => Trigger::Metres(trigger.required(file, "actionTriggerParam")?),
            "multipleTiming" => Trigger::Metres(self.metres(trigger, "actionTriggerParam")?),
            other => {
                let expected = "expected reachPoint, betweenAdjacentPoints, multipleDistance or multipleTiming";
                return Err(trigger.refuse(file, format!("actionTriggerType {other:?}: {expected}")));
            }
        };
        Ok(Group { from, to, trigger, element })
    }

    /// The way in a time that an element states, m.
    fn metres(&self, element: &Element, name: &str) -> Result<f64> {
        let seconds = element.required(self.file, name)?;
        let expected = || element.refuse(self.file, "images by time: expected <autoFlightSpeed> in the folder");
        self.speed.map(|speed| seconds * speed).ok_or_else(expected)
    }

    /// The camera turns on the way to the next waypoint.
    fn turn(&self, group: &Element, steps: &mut Vec<Step>) -> Result<()> {
        for action in group.all("action").filter(|own| own.text_of("actionActuatorFunc") == EVENLY) {
            let param = action.child("actionActuatorFuncParam").unwrap_or(action);
            steps.push(Step::PitchAlong(param.required(self.file, "gimbalPitchRotateAngle")?));
        }
        Ok(())
    }

    /// What a group does on its way begins.
    fn begin(&self, group: &Group, steps: &mut Vec<Step>, notes: &mut BTreeSet<String>) -> Result<()> {
        for action in group.element.all("action") {
            match (action.text_of("actionActuatorFunc"), &group.trigger) {
                ("takePhoto", Trigger::Metres(metres)) => steps.push(Step::Every { metres: *metres, now: true }),
                (EVENLY, Trigger::Between) => {}
                ("gimbalRotate", _) | ("startTimeLapse", Trigger::Between) => self.do_one(action, steps, notes)?,
                (harmless, _) if HARMLESS.contains(&harmless) => {}
                (other, _) => {
                    let problem =
                        format!("{other:?} is not read where distance, time or the way to a waypoint triggers");
                    return Err(action.refuse(self.file, problem));
                }
            }
        }
        Ok(())
    }

    /// Actions at a waypoint.
    fn act(&self, group: &Element, steps: &mut Vec<Step>, notes: &mut BTreeSet<String>) -> Result<()> {
        group.all("action").try_for_each(|action| self.do_one(action, steps, notes))
    }

    fn do_one(&self, action: &Element, steps: &mut Vec<Step>, notes: &mut BTreeSet<String>) -> Result<()> {
        let file = self.file;
        let param = action.child("actionActuatorFuncParam").unwrap_or(action);
        match action.text_of("actionActuatorFunc") {
            "takePhoto" => steps.push(Step::Shoot),
            "startTimeLapse" => steps.push(Step::Every { metres: self.metres(param, "minShootInterval")?, now: true }),
            "stopTimeLapse" => steps.push(Step::Stop),
            "gimbalRotate" => self.gimbal(action, param, steps)?,
            EVENLY => steps.push(Step::Pitch(param.required(file, "gimbalPitchRotateAngle")?)),
            "rotateYaw" => steps.push(Step::Turn(param.required(file, "aircraftHeading")?)),
            "zoom" => {
                notes.insert("The camera zooms: the camera of the scenario is taken as it is.".into());
            }
            harmless if HARMLESS.contains(&harmless) => {}
            other => {
                let expected = "takePhoto, startTimeLapse, gimbalRotate, gimbalEvenlyRotate or rotateYaw";
                return Err(action.refuse(file, format!("{other:?} is not read: expected {expected}")));
            }
        }
        Ok(())
    }

    fn gimbal(&self, action: &Element, param: &Element, steps: &mut Vec<Step>) -> Result<()> {
        let file = self.file;
        if !["", "absoluteAngle"].contains(&param.text_of("gimbalRotateMode")) {
            return Err(action.refuse(file, "gimbalRotateMode: expected absoluteAngle"));
        }
        // An angle counts where its switch is on, or absent.
        let angle = |axis: &str| match param.text_of(&format!("gimbal{axis}RotateEnable")) {
            "0" => Ok(None),
            _ => param.number(file, &format!("gimbal{axis}RotateAngle")),
        };
        if angle("Roll")?.is_some_and(|roll| roll != 0.0) {
            return Err(action.refuse(file, "expected a camera without roll"));
        }
        steps.extend(angle("Pitch")?.map(Step::Pitch));
        if let (Some(yaw), "1") = (angle("Yaw")?, param.text_of("gimbalYawRotateEnable")) {
            let is_north = param.text_of("gimbalHeadingYawBase") == "north";
            steps.push(Step::Yaw(if is_north { Yaw::OfNorth(yaw) } else { Yaw::OfNose(yaw) }));
        }
        Ok(())
    }
}
