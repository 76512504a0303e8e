//! A lens that hangs in its mount like a mass on springs: gravity, seen in camera axes, pulls its image across the
//! sensor, and along the axis changes the focal length.

use super::*;
use crate::camera::{DCX, F, PPX};
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "lens-sag",
    summary: "lens pulled aside by gravity: principal point and centre of distortion follow the camera's attitude",
    parameters: &[
        parameter("lateral", "px", DefaultValue::Number(2.0), "shift of the image when the optical axis is level"),
        parameter("axial", "px", DefaultValue::Number(0.0), "change of the focal length when the axis points down"),
        parameter("moves", "", DefaultValue::Choice("both", &["both", "pp", "dc"]), "what moves with the lens"),
    ],
    prepare,
};

struct LensSag {
    lateral: f64,
    axial: f64,
    pp: f64,
    dc: f64,
    /// Unit gravity in camera axes, by image.
    gravity: Vec<Vector3<f64>>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    let down = -Vector3::z();
    let moves = |what: &str| f64::from(u8::from(["both", what].contains(&values.word("moves"))));
    let sag = LensSag {
        lateral: values.number("lateral"),
        axial: values.number("axial"),
        pp: moves("pp"),
        dc: moves("dc"),
        gravity: setting.world.images.iter().map(|image| image.pose.rotation * down).collect(),
    };
    unless(sag.lateral == 0.0 && sag.axial == 0.0, sag)
}

impl Action for LensSag {
    fn interior(&self, image: usize, interior: &mut Interior) {
        let gravity = self.gravity[image];
        interior[F] += self.axial * gravity.z;
        for axis in 0..2 {
            interior[PPX + axis] += self.pp * self.lateral * gravity[axis];
            interior[DCX + axis] += self.dc * self.lateral * gravity[axis];
        }
    }
}
