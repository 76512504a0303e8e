//! A camera that vibrates in its mount while a rolling shutter reads it. No effect of the catalogue describes it.

use super::*;
use crate::block::Pose;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::TAU;

pub(super) static CAUSE: Cause = Cause {
    id: "vibration",
    summary: "camera shaking in its mount at one frequency, read row by row; not in the catalogue",
    parameters: &[
        parameter("frequency", "Hz", DefaultValue::Number(80.0), "frequency"),
        parameter(
            "angle",
            "rad",
            DefaultValue::Number(1e-4),
            "amplitude of the rotation about the camera's x and y axes",
        ),
        parameter(
            "position_m",
            "m",
            DefaultValue::Number(0.0),
            "amplitude of the shift along the camera's x and y axes",
        ),
        parameter(
            "readout",
            "s",
            DefaultValue::Number(0.02),
            "readout from the top to the bottom row, added to that of rolling-shutter: give 0 where both are named",
        ),
    ],
    prepare,
};

struct Vibration {
    times: Vec<f64>,
    frequency: f64,
    angle: f64,
    position: f64,
    readout: f64,
    phases: [f64; 4],
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    let vibration = Vibration {
        times: setting.world.times()?,
        frequency: values.positive("frequency")?,
        angle: values.size("angle")?,
        position: values.size("position_m")?,
        readout: values.number("readout"),
        phases: std::array::from_fn(|_| setting.random.uniform(0.0, TAU)),
    };
    setting.world.trajectory.need_velocities(&setting.world.images)?;
    unless(vibration.angle == 0.0 && vibration.position == 0.0, vibration)
}

impl Action for Vibration {
    fn row_delay(&self, row: f64) -> f64 {
        self.readout * row
    }

    fn motion(&self, image: usize, dt: f64, pose: &mut Pose) {
        let wave = |phase: f64| (TAU * self.frequency * (self.times[image] + dt) + phase).sin();
        let [roll, pitch, x, y] = self.phases.map(wave);
        let shift = Vector3::new(x, y, 0.0) * self.position;
        pose.centre += pose.rotation.inverse() * shift;
        pose.rotation = UnitQuaternion::from_scaled_axis(Vector3::new(roll, pitch, 0.0) * self.angle) * pose.rotation;
    }
}
