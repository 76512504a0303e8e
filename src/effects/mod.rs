//! The effect contract: what nature does to a measurement beyond the plain camera.
//!
//! An effect acts at one [`Stage`] of the measurement chain:
//!
//! ```text
//! (r, C) --exposure--> (r', C');   P --ray--> P';   (X, Y, Z) = R' (P' - C')
//! interior --interior--> interior';   (x, y) = fraser(interior', X, Y, Z) --image--> (x', y')
//! antenna: (r, C) --position--> A --frame--> A';   control and check points: P --control--> S --frame--> S'
//! ```
//!
//! Several effects of one stage act one after the other, in the order of the model. Ray effects get the pose that the exposure stage made;
//! interior effects get the image's own `r`, not the row's `r'`, so that an image has one interior orientation. Two laws hold for every
//! effect: at the nominal parameters it is exactly the identity (*null law*), and it has no state and is thread-safe (*purity*).

pub mod abi;
mod common;
pub mod formula;
pub mod laws;
mod numeric;
pub mod plugin;
mod registry;
mod spline;

// One file per effect, by name; the order of the catalogue is that of `registry.rs`.
pub mod decentring_high;
pub mod earth_curvature;
pub mod flat_port;
pub mod focal_flight;
pub mod focal_image;
pub mod focal_spline;
pub mod focal_temperature;
pub mod focal_time;
pub mod forward_motion;
pub mod gnss_delay;
pub mod gnss_drift;
pub mod gnss_lever_arm;
pub mod gnss_shift;
pub mod gravity_sag;
pub mod image_fourier;
pub mod image_grid;
pub mod local_flaw;
pub mod map_scale;
pub mod pp_flight;
pub mod pp_image;
pub mod pp_time;
pub mod radial_high;
pub mod refraction;
pub mod rolling_shutter;
pub mod unflatness;

pub use registry::{catalogue, find};

use crate::camera::PARAMETER_COUNT;
use crate::math::lane::{LANES, Lane};
use formula::Answer;
use nalgebra::Vector3;
use std::borrow::Cow;

/// Position of the interior orientation in the input of an image effect, after x and y.
pub const IMAGE_INTERIOR: usize = 2;

/// Where in the measurement chain an effect acts; fixes its inputs and outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u32)]
pub enum Stage {
    /// `[r 3 (rotation vector of R, world to camera), C 3]` -> the same 6.
    Exposure = 0,
    /// `[r 3, C 3, P 3]` -> `P 3`: the object point as the straight ray sees it.
    Ray = 1,
    /// `[interior 12, r 3]` -> `interior 12`.
    Interior = 2,
    /// `[x, y, interior 12]` -> `x, y`: the predicted image point and the interior orientation after its own stage.
    Image = 3,
    /// `[r 3, C 3]` -> antenna 3 (the identity is `C`).
    Position = 4,
    /// `[P 3]` -> surveyed coordinates 3, of control and check points.
    Control = 5,
    /// `[coordinate 3]` -> the same 3 in the system of the survey: of control and check points after the control stage, of antennas
    /// after the position stage. [`Context::surveyed`] says which of them.
    Frame = 6,
}

impl Stage {
    /// Every stage, in chain order.
    pub const ALL: [Stage; 7] =
        [Stage::Exposure, Stage::Ray, Stage::Interior, Stage::Image, Stage::Position, Stage::Control, Stage::Frame];

    /// Number of input values.
    pub const fn inputs(self) -> usize {
        match self {
            Stage::Exposure | Stage::Position => 6,
            Stage::Ray => 9,
            Stage::Interior => PARAMETER_COUNT + 3,
            Stage::Image => IMAGE_INTERIOR + PARAMETER_COUNT,
            Stage::Control | Stage::Frame => 3,
        }
    }

    /// Number of output values.
    pub const fn outputs(self) -> usize {
        match self {
            Stage::Exposure => 6,
            Stage::Ray | Stage::Position | Stage::Control | Stage::Frame => 3,
            Stage::Interior => PARAMETER_COUNT,
            Stage::Image => 2,
        }
    }

    /// Position in the input of the values that the identity hands on: output `k` is input `identity_offset() + k`.
    pub const fn identity_offset(self) -> usize {
        match self {
            Stage::Exposure | Stage::Interior | Stage::Image | Stage::Control | Stage::Frame => 0,
            Stage::Ray => 6,
            Stage::Position => 3,
        }
    }

    /// Name in the catalogue.
    pub const fn name(self) -> &'static str {
        match self {
            Stage::Exposure => "exposure",
            Stage::Ray => "ray",
            Stage::Interior => "interior",
            Stage::Image => "image",
            Stage::Position => "position",
            Stage::Control => "control",
            Stage::Frame => "frame",
        }
    }
}

/// Names a cause, or only takes a shape away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A physical cause.
    Physical,
    /// A shape without a cause: may serve a fit, explains nothing.
    Empirical,
}

/// How many values a parameter has in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Scope {
    /// One.
    Global = 0,
    /// One per camera.
    Camera = 1,
    /// One per flight.
    Flight = 2,
    /// One per flight, the first flight's held at the nominal value.
    FlightButFirst = 3,
    /// One per image.
    Image = 4,
}

/// How a parameter gets its value.
#[derive(Debug, Clone, PartialEq)]
pub enum Role {
    /// Estimated from its start value; a score test needs no other.
    Estimated,
    /// Estimated, but the effect is nonlinear in it: a score test scans the domain before it estimates.
    Searched(Domain),
    /// Given by the user, never estimated; some values have names (`against=order` is 1).
    Given(Cow<'static, [(&'static str, f64)]>),
    /// One value per image, drawn from a normal distribution of mean zero whose standard deviation is the effect's one
    /// reported parameter, estimated as a variance component; the name here is that of the standard deviation.
    Random(&'static str),
}

/// Search domain of a nonlinear parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Domain {
    /// The sensor's width, px.
    SensorX,
    /// The sensor's height, px.
    SensorY,
    /// Between two fractions of the sensor's half diagonal, px.
    SensorFraction(f64, f64),
    /// Between two values in the parameter's unit.
    Range(f64, f64),
}

impl Domain {
    /// Least and largest value, in the parameter's unit, on a sensor of `width_px` x `height_px`.
    pub fn bounds(&self, width_px: f64, height_px: f64) -> (f64, f64) {
        let half_diagonal = 0.5 * width_px.hypot(height_px);
        match *self {
            Self::SensorX => (0.0, width_px),
            Self::SensorY => (0.0, height_px),
            Self::SensorFraction(low, high) => (low * half_diagonal, high * half_diagonal),
            Self::Range(low, high) => (low, high),
        }
    }
}

/// What a parameter can be if the cause that its effect names is at work. What is estimated beyond looks like that cause, and is another.
#[derive(Debug, Clone, PartialEq)]
pub struct Plausible {
    /// Least value, in the parameter's unit.
    pub min: f64,
    /// Greatest value, in the parameter's unit.
    pub max: f64,
    /// Where the limits come from.
    pub source: Cow<'static, str>,
}

/// One parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name, as on the command line.
    pub name: Cow<'static, str>,
    /// Unit.
    pub unit: Cow<'static, str>,
    /// Number of values.
    pub scope: Scope,
    /// Value at which the effect is the identity, whatever the searched and given ones are; for those, the default.
    pub nominal: f64,
    /// A size met in practice, same unit; scales the parameter inside the solvers and must not be zero. Of coefficients in px^-n that on a
    /// sensor of half a diagonal of [`HALF_DIAGONAL_PX`], like their plausible range.
    pub typical: f64,
    /// How it gets its value.
    pub role: Role,
    /// Range of physically possible values; of a random parameter that of its standard deviation. `None` for what is given or
    /// searched, for coefficients of a mere shape, and for plug-ins, whose table has no place for it.
    pub plausible: Option<Plausible>,
}

/// Half the diagonal of the sensor that typical sizes and plausible ranges of coefficients in px^-n are stated for.
pub const HALF_DIAGONAL_PX: f64 = 3200.0;

impl Parameter {
    /// Typical size (above zero) on a sensor of this half diagonal. A coefficient in px^-n moves points by its size times the (n + 1)th power of
    /// the distance from the centre: what is typical, and what physics allows, is the displacement at the corner.
    pub fn typical_on(&self, half_diagonal_px: f64) -> f64 {
        let power = self.unit.strip_prefix("px^-").and_then(|n| n.parse::<i32>().ok());
        self.typical.abs() * power.map_or(1.0, |n| (HALF_DIAGONAL_PX / half_diagonal_px).powi(n + 1))
    }

    /// What is expected where `value` is none that a given parameter can have; `None` where it is one, or any number is.
    pub fn expected_instead_of(&self, value: f64) -> Option<String> {
        let Role::Given(named) = &self.role else { return None };
        if named.is_empty() || named.iter().any(|(_, number)| *number == value) {
            return None;
        }
        let all: Vec<String> = named.iter().map(|(name, number)| format!("{number} ({name})")).collect();
        Some(all.join(" or "))
    }
}

/// A measured quantity that an effect needs of the block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u32)]
pub enum Need {
    /// `time_s` of every image.
    Time = 0,
    /// `temperature_c` of every image.
    Temperature = 1,
    /// At least two flights.
    Flights = 2,
    /// `vx, vy, vz`, or times from which they are derived by flight.
    Velocity = 3,
    /// GNSS positions, in a datum that uses them.
    Gnss = 4,
    /// Control points, in a datum that uses them.
    Control = 5,
    /// Surveyed coordinates, and with them heights against the gravity direction: a datum that is not free.
    Vertical = 6,
}

/// What an effect is: its page in the catalogue follows from this.
#[derive(Debug, Clone, PartialEq)]
pub struct Descriptor {
    /// Fixed id, as on the command line.
    pub id: Cow<'static, str>,
    /// Where it acts.
    pub stage: Stage,
    /// Cause or shape.
    pub kind: Kind,
    /// What happens, in a sentence or two.
    pub summary: Cow<'static, str>,
    /// The formula, in the symbols of CONVENTIONS.md.
    pub formula: Cow<'static, str>,
    /// Its parameters, in the order of `theta`.
    pub parameters: Vec<Parameter>,
    /// What the block must have.
    pub needs: Vec<Need>,
    /// Effects that it is easily confused with, and what tells them apart.
    pub confused_with: Cow<'static, str>,
    /// Literature.
    pub source: Cow<'static, str>,
}

/// Observed constants of the whole block.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BlockContext {
    /// Mean of the projection centres' start values, m.
    pub centre: Vector3<f64>,
    /// Mean of the surveyed coordinates of the control points in the datum; without any, of the antenna positions in the datum; m.
    /// Check points are never in it: they take part in no estimation.
    pub survey_centre: Vector3<f64>,
    /// Number of images, flights, cameras.
    pub counts: [u32; 3],
    /// Mean temperature over the images that have one, degrees Celsius; NaN when none has.
    pub mean_temperature_c: f64,
    /// `[time_s, temperature_c]` of the images that have both, in order of time.
    pub temperature_history: Vec<[f64; 2]>,
}

/// Observed constants of one image; NaN where not known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageContext {
    /// Position of image, flight and camera in their lists.
    pub image: u32,
    /// See `image`.
    pub flight: u32,
    /// See `image`.
    pub camera: u32,
    /// Sensor size, px.
    pub width_px: f64,
    /// Sensor size, px.
    pub height_px: f64,
    /// Exposure time, s.
    pub time_s: f64,
    /// `(t - mean t) / (max t - min t)` over the block's images.
    pub tau: f64,
    /// The same from the image's place in the table instead of its time.
    pub tau_order: f64,
    /// `t - (first t of the flight)`, s.
    pub flight_time_s: f64,
    /// Length of the flight in time, s.
    pub flight_span_s: f64,
    /// Camera temperature, degrees Celsius.
    pub temperature_c: f64,
    /// Platform velocity, m/s, world axes; derived from times and poses where it is not measured.
    pub velocity: Vector3<f64>,
    /// Angular velocity, rad/s, camera axes; zero where it is not measured.
    pub angular_velocity: Vector3<f64>,
    /// Exposure time, s.
    pub exposure_s: f64,
    /// Focus distance, m.
    pub focus_m: f64,
}

impl Default for ImageContext {
    fn default() -> Self {
        let unknown = f64::NAN;
        Self {
            image: 0,
            flight: 0,
            camera: 0,
            width_px: unknown,
            height_px: unknown,
            time_s: unknown,
            tau: unknown,
            tau_order: unknown,
            flight_time_s: unknown,
            flight_span_s: unknown,
            temperature_c: unknown,
            velocity: Vector3::repeat(unknown),
            angular_velocity: Vector3::zeros(),
            exposure_s: unknown,
            focus_m: unknown,
        }
    }
}

/// Which kind of surveyed coordinate an effect of the frame stage is asked about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum SurveyedKind {
    /// A control or check point.
    Point = 0,
    /// An antenna.
    Antenna = 1,
}

/// Observed constants of one measurement.
#[derive(Debug, Clone, Copy)]
pub struct Context<'a> {
    /// The block's.
    pub block: &'a BlockContext,
    /// The image's.
    pub image: &'a ImageContext,
    /// Observed column (x) of the image measurement, px; NaN where the stage has none.
    pub column_px: f64,
    /// Observed row (y) of the image measurement, px; NaN where the stage has none.
    pub row_px: f64,
    /// What the coordinate at the frame stage belongs to; `None` at the other stages.
    pub surveyed: Option<SurveyedKind>,
}

/// The effect cannot be evaluated there (outside its domain).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("outside the effect's domain")]
pub struct OutsideDomain;

/// A functional effect. Shapes: `n = stage.inputs()`, `m = stage.outputs()`, `p = parameters.len()`.
pub trait Effect: Send + Sync {
    /// What it is.
    fn descriptor(&self) -> &Descriptor;

    /// `out (m) = e(input (n), theta (p))`; where asked for, `d_input` (m x n) and `d_theta` (m x p), both row-major, are
    /// overwritten whole. Columns of `d_theta` of given parameters are zero.
    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain>;

    /// The same of eight measurements, each with its own `theta`; `input` and answer have one [`Lane`] a number. Here it asks one by one; an effect
    /// whose [`formula`] is written for any number answers them side by side.
    ///
    /// # Errors
    /// The place of the first that lies outside the effect's domain.
    fn eval_eight(
        &self,
        contexts: &[Context<'_>; LANES],
        input: &[Lane],
        thetas: &[&[f64]; LANES],
        answer: Answer<'_, Lane>,
    ) -> Result<(), usize> {
        formula::one_by_one(self, contexts, input, thetas, answer)
    }

    /// The same effect behind the C ABI, for effects that came as a plug-in; `None` for built-in ones, which have a
    /// derivation in each language.
    fn c_abi(&self) -> Option<*const std::ffi::c_void> {
        None
    }

    /// A plug-in with its library's own derivatives in the place of numerical ones of its values, which cost ten times as much; `None` for
    /// every other effect. For the iterations of a solver: what these find is compared by whoever takes the numerical ones.
    fn with_own_derivatives(&self) -> Option<std::sync::Arc<dyn Effect>> {
        None
    }

    /// The file of a plug-in.
    fn origin(&self) -> Option<&plugin::Origin> {
        None
    }

    /// What a plug-in did where it gave no values, since this was last asked: an adjustment knows only that there are none.
    fn take_fault(&self) -> Option<plugin::Fault> {
        None
    }
}

/// Fills `matrix` (m x n, row-major) with the derivative of the identity of `stage`.
pub fn fill_identity(stage: Stage, matrix: &mut [f64]) {
    matrix.fill(0.0);
    for k in 0..stage.outputs() {
        matrix[k * stage.inputs() + stage.identity_offset() + k] = 1.0;
    }
}
