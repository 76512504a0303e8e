//! The images of a scenario: flights in strips, rings, and images at given places.

use serde::Deserialize;

/// Which side of the sensor lies across the track.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LongSide {
    /// x axis to the right of the heading.
    #[default]
    Across,
    /// x axis along the heading.
    Along,
}

/// Parallel strips flown one after the other. They are laid so that the principal rays of the nominal images meet the
/// plane z = 0 along the strips' axes: a tilted flight starts that much earlier.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flight {
    /// Name of the flight.
    pub name: String,
    /// Camera's id; needed when there are several.
    pub camera: Option<String>,
    /// Middle of the strips, m.
    #[serde(default)]
    pub centre_m: [f64; 2],
    /// Heading of the first strip, clockwise from north.
    #[serde(default)]
    pub heading_deg: f64,
    /// Length of the strips, m; absent: the terrain's in this heading.
    pub length_m: Option<f64>,
    /// Number of strips; 0: the flight is not flown. Absent: as many as the side overlap asks for, so that no place of
    /// the terrain is farther than half their distance from a strip; one without a side overlap.
    pub strips: Option<usize>,
    /// Distance of the strips, m.
    pub strip_spacing_m: Option<f64>,
    /// Or the part of the nadir footprint (at the flying height) that neighbouring strips share.
    pub side_overlap: Option<f64>,
    /// Images of each strip, spread evenly over its length.
    pub images: Option<Vec<usize>>,
    /// Or the part of the nadir footprint (at the flying height) that neighbouring images share.
    pub forward_overlap: Option<f64>,
    /// Height above z = 0, m.
    pub height_m: f64,
    /// Ground speed, m/s.
    pub speed_mps: f64,
    /// Tilt of the camera in the direction of the heading.
    #[serde(default)]
    pub tilt_deg: f64,
    /// Every second strip is flown back.
    #[serde(default = "yes")]
    pub alternate: bool,
    /// Side of the sensor across the track.
    #[serde(default)]
    pub long_side: LongSide,
    /// Time of a turn between two strips, s.
    #[serde(default)]
    pub turn_s: f64,
    /// Exposure time, s.
    pub exposure_s: Option<f64>,
    /// Standard deviation of the crab angle of a strip.
    #[serde(default)]
    pub crab_sigma_deg: f64,
    /// Standard deviation of each coordinate of a projection centre about its nominal place, m.
    #[serde(default)]
    pub position_sigma_m: f64,
    /// Standard deviation of each attitude angle.
    #[serde(default)]
    pub attitude_sigma_deg: f64,
    /// Standard deviation of each angular velocity; absent: not recorded.
    pub angular_rate_sigma_deg_s: Option<f64>,
}

fn yes() -> bool {
    true
}

/// Convergent images on a circle, which look at the middle of the targets.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// Name of the image set.
    pub name: String,
    /// Camera's id; needed when there are several.
    pub camera: Option<String>,
    /// Number of images, spread evenly.
    pub images: usize,
    /// Radius of the circle, m.
    pub radius_m: f64,
    /// Height of the circle above z = 0, m.
    pub height_m: f64,
    /// Azimuth of the first image from the middle, clockwise from north.
    #[serde(default)]
    pub start_deg: f64,
    /// Rolls about the optical axis, taken in turn.
    pub rolls_deg: Vec<f64>,
    /// Time between two images, s.
    pub interval_s: f64,
    /// Standard deviation of each coordinate of the point that is looked at, m.
    #[serde(default)]
    pub aim_sigma_m: f64,
    /// Standard deviation of each coordinate of a projection centre about its nominal place, m.
    #[serde(default)]
    pub position_sigma_m: f64,
}

/// Images at given places, flown in straight lines from each to the next. A strip ends where the path turns by more
/// than 45 degrees.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Route {
    /// Name of the image set.
    pub name: String,
    /// Camera's id; needed when there are several.
    pub camera: Option<String>,
    /// Ground speed, m/s.
    pub speed_mps: f64,
    /// Exposure time, s.
    pub exposure_s: Option<f64>,
    /// Side of the sensor across the heading.
    #[serde(default)]
    pub long_side: LongSide,
    /// Standard deviation of the crab angle of a strip.
    #[serde(default)]
    pub crab_sigma_deg: f64,
    /// Standard deviation of each coordinate of a projection centre about its place, m.
    #[serde(default)]
    pub position_sigma_m: f64,
    /// Standard deviation of each attitude angle.
    #[serde(default)]
    pub attitude_sigma_deg: f64,
    /// Standard deviation of each angular velocity; absent: not recorded.
    pub angular_rate_sigma_deg_s: Option<f64>,
    /// In the order of time: x, y and z (m), heading (degrees, clockwise from north), tilt towards the heading (degrees
    /// from straight down).
    pub exposures: Vec<[f64; 5]>,
}
