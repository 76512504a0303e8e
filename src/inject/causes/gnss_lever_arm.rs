//! An antenna that does not stand at the projection centre: carried along by the camera's rotation.

use super::*;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "gnss-lever-arm",
    summary: "antenna at a fixed place in the camera's frame, added to that of the truth",
    parameters: &[
        parameter("x", "m", DefaultValue::Number(0.0), "to the right of the image"),
        parameter("y", "m", DefaultValue::Number(0.1), "down the image"),
        parameter("z", "m", DefaultValue::Number(-0.1), "along the optical axis"),
    ],
    prepare,
};

struct GnssLeverArm {
    by_image: Vec<Vector3<f64>>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (values, world) = (setting.values, setting.world);
    world.need_gnss()?;
    let arm = Vector3::new(values.number("x"), values.number("y"), values.number("z"));
    let by_image = world.images.iter().map(|image| image.pose.rotation.inverse() * arm).collect();
    unless(arm == Vector3::zeros(), GnssLeverArm { by_image })
}

impl Action for GnssLeverArm {
    fn antenna(&self, image: usize, antenna: &mut Vector3<f64>) {
        *antenna += self.by_image[image];
    }
}
