//! A receiver whose clock is late: it reports where the antenna was a moment after the exposure.

use super::*;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "gnss-delay",
    summary: "GNSS positions taken from the trajectory a moment after the exposure",
    parameters: &[parameter("dt", "s", DefaultValue::Number(0.02), "delay; negative: before the exposure")],
    prepare,
};

struct GnssDelay {
    moved: Vec<Vector3<f64>>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (dt, world) = (setting.values.number("dt"), setting.world);
    world.need_gnss()?;
    world.trajectory.need_velocities(&world.images)?;
    let moved = (0..world.images.len())
        .map(|image| world.trajectory.pose(image, dt).centre - world.images[image].pose.centre)
        .collect();
    unless(dt == 0.0, GnssDelay { moved })
}

impl Action for GnssDelay {
    fn antenna(&self, image: usize, antenna: &mut Vector3<f64>) {
        *antenna += self.moved[image];
    }
}
