//! The scenario as it is written down.

use super::image_sets::{Flight, Ring, Route};
use crate::block::Sigma;
use crate::camera::Camera;
use serde::Deserialize;
use std::collections::BTreeMap;

/// A scenario: everything a simulation needs but the seed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Name of the block.
    pub name: String,
    /// One sentence for people.
    #[serde(default)]
    pub about: String,
    /// Coordinate system, free text.
    #[serde(default = "local")]
    pub crs: String,
    /// Numbers that can be given from outside.
    #[serde(default)]
    pub parameters: BTreeMap<String, Parameter>,
    /// A-priori precision.
    pub sigma: SigmaModel,
    /// Cameras.
    #[serde(rename = "camera")]
    pub cameras: Vec<CameraModel>,
    /// Terrain.
    pub terrain: Terrain,
    /// Flights in strips, in the order in which they are flown.
    #[serde(default, rename = "flight")]
    pub flights: Vec<Flight>,
    /// Rings of convergent images, after the flights.
    #[serde(default, rename = "ring")]
    pub rings: Vec<Ring>,
    /// Images at given places. Routes are flown first, so that flights which are added to a mission follow it.
    #[serde(default, rename = "route")]
    pub routes: Vec<Route>,
    /// Time between two flights, s.
    #[serde(default)]
    pub pause_s: f64,
    /// Tie points.
    pub ties: Ties,
    /// Surveyed points.
    #[serde(default)]
    pub surveyed: Surveyed,
    /// Camera temperature; absent: not recorded.
    pub temperature: Option<Temperature>,
    /// GNSS; absent: not recorded.
    pub gnss: Option<GnssModel>,
}

fn local() -> String {
    "local".into()
}

/// A number of a scenario that can be given from outside. Limits without a decimal point are those of a whole number.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// What it is.
    pub about: String,
    /// Dotted paths of the values that it sets (`flight.0.tilt_deg`).
    pub sets: Vec<String>,
    /// Dotted paths of the values that it takes the place of.
    #[serde(default)]
    pub replaces: Vec<String>,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
}

/// A-priori standard deviations, as in `block.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SigmaModel {
    /// Tie-point image coordinate, px.
    pub tie_px: f64,
    /// Image coordinate of a surveyed point, px.
    pub mark_px: f64,
    /// Surveyed coordinate, horizontal, m.
    pub control_xy_m: f64,
    /// Surveyed height, m.
    pub control_z_m: f64,
    /// GNSS position, horizontal, m.
    pub gnss_xy_m: f64,
    /// GNSS height, m.
    pub gnss_z_m: f64,
}

/// A camera, as in `block.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // the names and units of block.toml
pub struct CameraModel {
    pub id: String,
    pub width_px: u32,
    pub height_px: u32,
    pub pixel_um: Option<f64>,
    pub f: f64,
    pub ppx: f64,
    pub ppy: f64,
    pub dcx: f64,
    pub dcy: f64,
    #[serde(default)]
    pub k1: f64,
    #[serde(default)]
    pub k2: f64,
    #[serde(default)]
    pub k3: f64,
    #[serde(default)]
    pub p1: f64,
    #[serde(default)]
    pub p2: f64,
    #[serde(default)]
    pub b1: f64,
    #[serde(default)]
    pub b2: f64,
}

/// Terrain; lengths run north-south, widths east-west, both about the origin. Surveyed points lie within length and
/// width, tie points also in the margin around.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Terrain {
    /// Trapezoid profile along the axis, on relief.
    Dike {
        /// m.
        length_m: f64,
        /// m.
        width_m: f64,
        /// Ground around with tie points only, m.
        margin_m: f64,
        /// Width of the crest, m.
        crest_width_m: f64,
        /// Height of the crest above the plain, m.
        crest_height_m: f64,
        /// Horizontal run of the slope per metre of height.
        slope_run: f64,
        /// Root mean square of the relief, m.
        relief_m: f64,
        /// Its typical wavelength, m.
        wavelength_m: f64,
        /// Single points stand up to this far above or below the surface, m.
        roughness_m: f64,
    },
    /// Relief alone.
    Plain {
        /// m.
        length_m: f64,
        /// m.
        width_m: f64,
        /// Ground around with tie points only, m.
        margin_m: f64,
        /// Root mean square of the relief, m.
        relief_m: f64,
        /// Its typical wavelength, m.
        wavelength_m: f64,
        /// Single points stand up to this far above or below the surface, m.
        roughness_m: f64,
    },
    /// Signalised targets that face upwards, anywhere in a box on the origin's plane.
    Targets {
        /// m.
        length_m: f64,
        /// m.
        width_m: f64,
        /// Height of the box, m.
        height_m: f64,
    },
}

/// Tie points.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ties {
    /// Number.
    pub count: Option<usize>,
    /// Or number per square metre of terrain with margin.
    pub per_m2: Option<f64>,
    /// How likely an image that sees a point also measures it.
    pub detection: Detection,
}

/// A point has a probability `best * u^decay` of its own (`u` uniform in 0..1) to be found in each image that sees it.
/// Points found once are no tie points and drawn again. A decay above 1 gives many points of low multiplicity and a
/// long thin tail, as in real blocks.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Detection {
    /// Probability of the most distinctive point.
    pub best: f64,
    /// Exponent.
    pub decay: f64,
}

/// Surveyed points.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surveyed {
    /// Control points.
    #[serde(default)]
    pub control: Control,
    /// Check points.
    #[serde(default)]
    pub check: Points,
}

/// Control points: each is put as far from the others as a place can be found.
pub type Control = Points;

/// A number of surveyed points.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Points {
    /// Number.
    pub count: usize,
    /// Images in which a point is marked at most; absent: all that see it.
    pub max_marks: Option<usize>,
}

/// Temperature of the camera: `start + rise (1 - exp(-t / time_constant))`, t from the first exposure.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Temperature {
    /// At the first exposure, degrees Celsius.
    pub start_c: f64,
    /// Rise after a long time, K.
    pub rise_k: f64,
    /// Time constant, s.
    pub time_constant_s: f64,
}

/// GNSS positions, in the projection centres.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GnssModel {
    /// Standard deviation given with each position, horizontal, m; absent: the block's.
    pub sigma_xy_m: Option<f64>,
    /// Standard deviation given with each height, m; absent: the block's.
    pub sigma_z_m: Option<f64>,
}

impl From<SigmaModel> for Sigma {
    fn from(s: SigmaModel) -> Self {
        let SigmaModel { tie_px, mark_px, control_xy_m, control_z_m, gnss_xy_m, gnss_z_m } = s;
        Sigma { tie_px, mark_px, control_xy_m, control_z_m, gnss_xy_m, gnss_z_m }
    }
}

impl From<&CameraModel> for Camera {
    fn from(c: &CameraModel) -> Self {
        Camera {
            id: c.id.clone(),
            width_px: c.width_px,
            height_px: c.height_px,
            pixel_um: c.pixel_um,
            interior: [c.f, c.ppx, c.ppy, c.dcx, c.dcy, c.k1, c.k2, c.k3, c.p1, c.p2, c.b1, c.b2],
        }
    }
}

impl Terrain {
    /// Length, width and margin, m.
    pub fn extent(&self) -> [f64; 3] {
        match *self {
            Terrain::Dike { length_m, width_m, margin_m, .. } | Terrain::Plain { length_m, width_m, margin_m, .. } => {
                [length_m, width_m, margin_m]
            }
            Terrain::Targets { length_m, width_m, .. } => [length_m, width_m, 0.0],
        }
    }
}

impl Scenario {
    /// Number of tie points.
    pub fn tie_count(&self) -> usize {
        let [length, width, margin] = self.terrain.extent();
        let area = (length + 2.0 * margin) * (width + 2.0 * margin);
        self.ties.count.unwrap_or_else(|| (self.ties.per_m2.unwrap_or(0.0) * area).round() as usize)
    }

    /// Names of the image sets in the order in which they are flown: routes, flights, rings.
    pub(super) fn image_sets(&self) -> impl Iterator<Item = &String> {
        let (routes, rings) = (self.routes.iter().map(|r| &r.name), self.rings.iter().map(|r| &r.name));
        routes.chain(self.flights.iter().map(|f| &f.name)).chain(rings)
    }

    /// Position in `cameras` of the one named, or of the only one.
    pub(super) fn camera_index(&self, id: Option<&str>) -> Option<usize> {
        match id {
            Some(id) => self.cameras.iter().position(|camera| camera.id == id),
            None => (self.cameras.len() == 1).then_some(0),
        }
    }
}
