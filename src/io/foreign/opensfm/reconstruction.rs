//! `reconstruction.json` and its neighbours, as they say it.

use super::super::super::error::{Error, Place};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::path::Path;

/// One connected part of what OpenSfM reconstructed.
#[derive(Deserialize)]
pub(super) struct Reconstruction {
    pub cameras: BTreeMap<String, Camera>,
    pub shots: BTreeMap<String, Shot>,
    #[serde(default)]
    pub points: BTreeMap<String, Point>,
    pub reference_lla: Option<Reference>,
}

/// Lengths are in units of the longer side of the image.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Camera {
    /// Absent in old files, where it is the perspective one.
    pub projection_type: Option<String>,
    pub width: u32,
    pub height: u32,
    pub focal: Option<f64>,
    pub focal_x: Option<f64>,
    pub focal_y: Option<f64>,
    pub c_x: f64,
    pub c_y: f64,
    pub k1: f64,
    pub k2: f64,
    pub k3: f64,
    pub p1: f64,
    pub p2: f64,
}

/// An image.
#[derive(Deserialize)]
pub(super) struct Shot {
    pub camera: String,
    /// Rotation vector, world to camera.
    pub rotation: [f64; 3],
    /// `t` of `X_cam = R X + t`.
    pub translation: [f64; 3],
    /// Seconds since 1970.
    pub capture_time: Option<f64>,
    /// In the frame of the reconstruction, m.
    pub gps_position: Option<[f64; 3]>,
    /// OpenSfM takes it for a standard deviation in m.
    pub gps_dop: Option<f64>,
}

#[derive(Deserialize)]
pub(super) struct Point {
    pub coordinates: [f64; 3],
}

/// Degrees and metres.
#[derive(Deserialize, Clone, Copy)]
pub(super) struct Reference {
    pub latitude: f64,
    pub longitude: f64,
    #[serde(default)]
    pub altitude: f64,
}

/// `ground_control_points.json`.
#[derive(Deserialize)]
pub(in super::super) struct GroundControl {
    pub points: Vec<GroundControlPoint>,
}

#[derive(Deserialize)]
pub(in super::super) struct GroundControlPoint {
    pub id: String,
    /// Absent where the point was only seen, not surveyed.
    pub position: Option<GroundPosition>,
    #[serde(default)]
    pub observations: Vec<Observation>,
    /// `metrics_only` makes it a check point.
    pub role: Option<String>,
}

#[derive(Deserialize, Clone, Copy)]
pub(in super::super) struct GroundPosition {
    pub latitude: f64,
    pub longitude: f64,
    pub altitude: Option<f64>,
}

#[derive(Deserialize)]
pub(in super::super) struct Observation {
    pub shot_id: String,
    /// Normalised.
    pub projection: [f64; 2],
}

/// Reads a JSON file.
pub(in super::super) fn read<T: DeserializeOwned>(path: &Path) -> Result<T, Error> {
    let text = super::super::super::read_text(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
    serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|error| {
        let place = Place::Character(error.line() as u64, error.column() as u64);
        Error::content(path.display().to_string(), place, error.to_string())
    })
}
