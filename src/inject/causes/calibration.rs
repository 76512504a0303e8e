//! A wrong initial calibration: the camera that the adjustment starts from, or holds fixed, is not the one that took
//! the images.

use super::*;
use crate::block::Block;
use crate::camera::{PARAMETER_COUNT, PARAMETERS};

pub(super) static CAUSE: Cause = Cause {
    id: "calibration",
    summary: "wrong initial calibration of every camera: adds to the block's start values, measurements stay",
    parameters: &[
        parameter("f", "px", DefaultValue::Number(0.0), "focal length"),
        parameter("ppx", "px", DefaultValue::Number(0.0), "principal point"),
        parameter("ppy", "px", DefaultValue::Number(0.0), "principal point"),
        parameter("dcx", "px", DefaultValue::Number(0.0), "centre of distortion"),
        parameter("dcy", "px", DefaultValue::Number(0.0), "centre of distortion"),
        parameter("k1", "px^-2", DefaultValue::Number(0.0), "radial distortion"),
        parameter("k2", "px^-4", DefaultValue::Number(0.0), "radial distortion"),
        parameter("k3", "px^-6", DefaultValue::Number(0.0), "radial distortion"),
        parameter("p1", "px^-1", DefaultValue::Number(0.0), "decentring"),
        parameter("p2", "px^-1", DefaultValue::Number(0.0), "decentring"),
        parameter("b1", "1", DefaultValue::Number(0.0), "affinity"),
        parameter("b2", "1", DefaultValue::Number(0.0), "shear"),
    ],
    prepare,
};

struct Calibration {
    change: Interior,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let change = PARAMETERS.map(|name| setting.values.number(name));
    unless(change == [0.0; PARAMETER_COUNT], Calibration { change })
}

impl Action for Calibration {
    fn record(&self, block: &mut Block) {
        for camera in &mut block.cameras {
            for (value, change) in camera.interior.iter_mut().zip(self.change) {
                *value += change;
            }
        }
    }
}
