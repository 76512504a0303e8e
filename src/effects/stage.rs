//! Stages of the measurement chain: what an effect gets there, and what it gives.

use crate::camera::PARAMETER_COUNT;

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
    /// `[coordinate 3]` -> the same 3 in the system of the survey: of control and check points after the control stage,
    /// of antennas after the position stage. [`Context::surveyed`](super::Context::surveyed) says which of them.
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

/// Fills `matrix` (m x n, row-major) with the derivative of the identity of `stage`.
pub fn fill_identity(stage: Stage, matrix: &mut [f64]) {
    matrix.fill(0.0);
    for k in 0..stage.outputs() {
        matrix[k * stage.inputs() + stage.identity_offset() + k] = 1.0;
    }
}
