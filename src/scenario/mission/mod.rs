//! Missions of flight-planning programs: the images that a planned flight will take.
//!
//! ```text
//! .kml, .kmz          points, one image each, or lines           kml
//! .plan               QGroundControl                             qgroundcontrol
//! .kmz, .wpml         DJI: wpmz/waylines.wpml                    wpml
//!        read ──► Mission ──► apply ──► a Scenario with a Route
//! ```
//!
//! A mission has no camera, no ground and no precision: a scenario gives these. What a mission leaves open is taken
//! from the scenario or from the path, and a note says so.

mod apply;
mod archive;
mod kml;
mod qgroundcontrol;
#[cfg(test)]
mod qgroundcontrol_tests;
mod walk;
#[cfg(test)]
mod walk_tests;
mod wpml;
mod wpml_places;
#[cfg(test)]
mod wpml_tests;
mod xml;

pub use apply::apply;

use std::fmt;

/// Longest mission, bytes, unpacked: a thousand times that of a long flight.
pub(crate) const MOST_BYTES: u64 = 32 << 20;

/// What a planned flight will do.
#[derive(Debug, Clone, PartialEq)]
pub struct Mission {
    /// Name of the file without its extension.
    pub name: String,
    /// Ground speed, m/s, where the mission says it.
    pub speed_mps: Option<f64>,
    /// Images in the order of time.
    pub exposures: Vec<Exposure>,
    /// What was taken for granted, and what was not read; sentences for people.
    pub notes: Vec<String>,
}

/// An image of a mission.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// Degrees, north.
    pub latitude_deg: f64,
    /// Degrees, east.
    pub longitude_deg: f64,
    /// Above the ground, m.
    pub height_m: f64,
    /// Direction in which the camera's upper edge points, degrees clockwise from north; `None`: that of the flight.
    pub heading_deg: Option<f64>,
    /// Does the heading follow the direction of flight?
    pub follows_path: bool,
    /// Tilt towards the heading, degrees from straight down; `None` where the mission does not say.
    pub tilt_deg: Option<f64>,
}

/// What a reader has to be told.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Given {
    /// Height of the ground in the file's heights, m.
    pub ground_m: Option<f64>,
    /// Distance of two images along a line, per metre of height.
    pub base_to_height: Option<f64>,
}

/// A mission that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}{place}: {problem}")]
pub struct MissionError {
    file: String,
    place: Place,
    problem: String,
}

/// Where in a file; lines and columns count from 1.
#[derive(Debug, Clone, PartialEq)]
enum Place {
    File,
    Character(usize, usize),
    /// A value of a JSON file.
    Value(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::File => Ok(()),
            Place::Character(line, column) => write!(f, ":{line}:{column}"),
            Place::Value(path) => write!(f, ": {path}"),
        }
    }
}

impl MissionError {
    fn new(file: &str, place: Place, problem: impl Into<String>) -> Self {
        Self { file: file.into(), place, problem: problem.into() }
    }
}

/// Result of this module.
type Result<T> = std::result::Result<T, MissionError>;

/// Reads a mission: `file` is its path, which decides the format and stands in messages.
///
/// # Errors
/// A file of another kind, and what cannot be understood, with its place and what was expected.
pub fn read(file: &str, bytes: &[u8], given: &Given) -> Result<Mission> {
    let refuse = |problem: String| MissionError::new(file, Place::File, problem);
    if bytes.len() as u64 > MOST_BYTES {
        return Err(refuse(format!("expected at most {MOST_BYTES} bytes, found more")));
    }
    let text = || std::str::from_utf8(bytes).map_err(|_| refuse("expected a text in UTF-8".into()));
    let last = file.rsplit(['/', '\\']).next().unwrap_or(file);
    let (stem, extension) = last.rsplit_once('.').unwrap_or((last, ""));
    let mission = match extension.to_ascii_lowercase().as_str() {
        "kml" => kml::read(file, text()?, given),
        "kmz" => archive::read(file, bytes, given),
        "wpml" => wpml::read(file, text()?, given),
        "plan" => qgroundcontrol::read(file, text()?, given),
        _ => Err(refuse("expected a mission: .kml, .kmz, .wpml or .plan".into())),
    }?;
    match mission.exposures.is_empty() {
        true => Err(refuse("the mission takes no image".into())),
        false => Ok(Mission { name: stem.into(), ..mission }),
    }
}

/// Height above the ground of a height over the sea or the ellipsoid.
///
/// # Errors
/// Says what is needed where nobody says how high the ground is.
fn above_ground(height_m: f64, ground_m: Option<f64>) -> std::result::Result<f64, String> {
    let ground_m = ground_m.ok_or(
        "the height is that above the sea or the ellipsoid: --ground has to say the height of the ground in the same \
         system",
    )?;
    Ok(height_m - ground_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_mission_is_refused() {
        let message = |file: &str, bytes: &[u8]| read(file, bytes, &Given::default()).unwrap_err().to_string();
        assert_eq!(message("a/b.csv", b""), "a/b.csv: expected a mission: .kml, .kmz, .wpml or .plan");
        assert_eq!(message("b.plan", b"\xff"), "b.plan: expected a text in UTF-8");
        assert!(message("b.kmz", b"PK").starts_with("b.kmz: expected a zip file"));
        assert!(message("b.kml", &vec![b' '; MOST_BYTES as usize + 1]).contains("expected at most"));
    }
}
