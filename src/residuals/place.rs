//! Where each measurement lies: on the sensor, in time, in space. Taken at the *predicted* image point: columns at the
//! measured one would correlate with the noise.

use crate::camera::{DCX, DCY};
use crate::problem::{ImageObservation, Problem, State};
use nalgebra::Vector3;

/// Below this sine of the nadir angle (0.06 degrees) the direction away from the nadir is not defined.
const SMALLEST_NADIR_SINE: f64 = 1e-3;

/// One measurement's place.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Image.
    pub image: usize,
    /// Camera.
    pub camera: usize,
    /// Flight.
    pub flight: usize,
    /// Predicted, px.
    pub x: f64,
    /// Predicted, px.
    pub y: f64,
    /// From the middle of the sensor, in half diagonals.
    pub u: f64,
    /// From the middle of the sensor, in half diagonals.
    pub v: f64,
    /// Distance from the centre of distortion, px.
    pub radius: f64,
    /// Unit vector away from the centre of distortion; zero there.
    pub radial: [f64; 2],
    /// Row, -1 at the top to 1 at the bottom.
    pub row: f64,
    /// Depth in front of the camera, m.
    pub depth: f64,
    /// Angle between the ray and straight down, rad.
    pub nadir: f64,
    /// Azimuth of the ray, clockwise from north, rad.
    pub azimuth: f64,
    /// Unit vector in the image in which the nadir angle grows; zero at the nadir.
    pub outward: [f64; 2],
    /// Unit vector in the image along the camera's motion; zero where it is not known.
    pub along: [f64; 2],
}

fn unit([x, y]: [f64; 2]) -> [f64; 2] {
    let length = x.hypot(y);
    if length > 0.0 { [x / length, y / length] } else { [0.0; 2] }
}

impl Place {
    /// Of a measurement with the predicted image point `[x, y]` of `point`.
    pub fn new(
        problem: &Problem,
        state: &State,
        observation: &ImageObservation,
        [x, y]: [f64; 2],
        point: &Vector3<f64>,
    ) -> Self {
        let image = observation.image as usize;
        let context = &problem.image_contexts[image];
        let interior = &state.interiors[context.camera as usize];
        let pose = &state.poses[image];
        let half = 0.5 * context.width_px.hypot(context.height_px);
        let from_centre = [x - interior[DCX], y - interior[DCY]];
        let ray = point - pose.centre;
        let in_camera = pose.rotation * ray;
        let motion = pose.rotation * context.velocity;
        // How the image point moves when the ray turns away from the nadir.
        let length = ray.norm();
        let cosine = (-ray.z / length).clamp(-1.0, 1.0);
        let turn = pose.rotation * (ray / length * cosine + Vector3::z());
        let slope = |k: usize| turn[k] - in_camera[k] / in_camera.z * turn.z;
        let outward = if turn.norm() > SMALLEST_NADIR_SINE { unit([slope(0), slope(1)]) } else { [0.0; 2] };
        Self {
            image,
            camera: context.camera as usize,
            flight: context.flight as usize,
            x,
            y,
            u: (x - 0.5 * context.width_px) / half,
            v: (y - 0.5 * context.height_px) / half,
            radius: from_centre[0].hypot(from_centre[1]),
            radial: unit(from_centre),
            row: 2.0 * y / context.height_px - 1.0,
            depth: in_camera.z,
            nadir: cosine.acos(),
            azimuth: ray.x.atan2(ray.y),
            outward,
            along: if motion.x.is_finite() { unit([motion.x, motion.y]) } else { [0.0; 2] },
        }
    }
}

/// A linear scaling of a quantity to -1..1 over its range; `None` where it is unknown somewhere or the same everywhere.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    middle: f64,
    half: f64,
}

/// Ranges below this share of the values' size are rounding.
const SMALLEST_SPAN: f64 = 1e-9;

impl Span {
    /// Of all values.
    pub fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values {
            if !value.is_finite() {
                return None;
            }
            (low, high) = (low.min(value), high.max(value));
        }
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        (half > SMALLEST_SPAN * middle.abs().max(1.0)).then_some(Self { middle, half })
    }

    /// Scaled value.
    pub fn scale(&self, value: f64) -> f64 {
        (value - self.middle) / self.half
    }

    /// Which of `bins` equal parts a value lies in.
    pub fn bin(&self, value: f64, bins: usize) -> usize {
        (((self.scale(value) + 1.0) * 0.5 * bins as f64) as usize).min(bins - 1)
    }

    /// Middle of a bin, in the quantity's own unit.
    pub fn middle_of(&self, bin: usize, bins: usize) -> f64 {
        self.middle + self.half * (2.0 * (bin as f64 + 0.5) / bins as f64 - 1.0)
    }
}

/// Legendre polynomials of degree 1 to 3.
pub fn legendre(x: f64) -> [f64; 3] {
    [x, 1.5 * x * x - 0.5, 2.5 * x * x * x - 1.5 * x]
}

/// Number of [`patterns`].
pub const PATTERNS: usize = 13;

/// The first so many are constant or linear over the sensor.
pub const LINEAR_PATTERNS: usize = 6;

/// Smooth displacement patterns over the sensor: shift, scale, rotation, shears, the quadratic terms, cubic radial.
pub fn patterns(u: f64, v: f64) -> [[f64; 2]; PATTERNS] {
    let r2 = u * u + v * v;
    [
        [1.0, 0.0],
        [0.0, 1.0],
        [u, v],
        [-v, u],
        [u, -v],
        [v, u],
        [u * u, 0.0],
        [u * v, 0.0],
        [v * v, 0.0],
        [0.0, u * u],
        [0.0, u * v],
        [0.0, v * v],
        [r2 * u, r2 * v],
    ]
}
