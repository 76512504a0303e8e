//! A rolling shutter: the rows are exposed one after the other while the platform moves on.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "rolling-shutter",
    summary: "rows exposed one after the other along the moving trajectory; the middle row at the image's time",
    parameters: &[parameter(
        "readout",
        "s",
        DefaultValue::Number(0.02),
        "from the top to the bottom row; negative: the bottom row is first",
    )],
    prepare,
};

struct RollingShutter {
    readout: f64,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let readout = setting.values.number("readout");
    setting.world.trajectory.need_velocities(&setting.world.images)?;
    unless(readout == 0.0, RollingShutter { readout })
}

impl Action for RollingShutter {
    fn row_delay(&self, row: f64) -> f64 {
        self.readout * row
    }
}
