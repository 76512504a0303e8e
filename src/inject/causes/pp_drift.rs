//! A sensor that creeps while the camera warms up: principal point and centre of distortion move evenly with time.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "pp-drift",
    summary: "principal point and centre of distortion that move evenly from the first to the last image",
    parameters: &[
        parameter("x", "px", DefaultValue::Number(3.0), "over the block's span"),
        parameter("y", "px", DefaultValue::Number(0.0), "over the block's span"),
        parameter("against", "", DefaultValue::Choice("time", &["time", "order"]), "by time, or by place in the table"),
    ],
    prepare,
};

struct PpDrift {
    x: f64,
    y: f64,
    progress: Vec<f64>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    let (x, y) = (values.number("x"), values.number("y"));
    let progress = progress(setting.world, values.word("against"))?;
    unless(x == 0.0 && y == 0.0, PpDrift { x, y, progress })
}

impl Action for PpDrift {
    fn interior(&self, image: usize, interior: &mut Interior) {
        shift_sensor(interior, self.x * self.progress[image], self.y * self.progress[image]);
    }
}
