//! A sensor exposed in steps on the wafer: its pixels are displaced periodically. No effect of the catalogue describes
//! it.

use super::*;
use std::f64::consts::TAU;

pub(super) static CAUSE: Cause = Cause {
    id: "sensor-stitch",
    summary: "pixels displaced periodically over the sensor (stitching); not in the catalogue",
    parameters: &[
        parameter("amplitude", "px", DefaultValue::Number(0.5), "largest displacement"),
        parameter("wavelength", "px", DefaultValue::Number(400.0), "period"),
        parameter(
            "axis",
            "",
            DefaultValue::Choice("both", &["both", "x", "y"]),
            "coordinate that is displaced, along itself",
        ),
    ],
    prepare,
};

struct SensorStitch {
    amplitude: [f64; 2],
    wavelength: f64,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    let amplitude = values.size("amplitude")?;
    let along = |axis: &str| if ["both", axis].contains(&values.word("axis")) { amplitude } else { 0.0 };
    let stitch = SensorStitch { amplitude: [along("x"), along("y")], wavelength: values.positive("wavelength")? };
    unless(amplitude == 0.0, stitch)
}

impl Action for SensorStitch {
    fn sensor(&self, _camera: usize, _interior: &Interior, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let wave = |value: f64| (TAU * value / self.wavelength).sin();
        Some([x + self.amplitude[0] * wave(x), y + self.amplitude[1] * wave(y)])
    }
}
