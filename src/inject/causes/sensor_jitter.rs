//! A stabilised sensor: it stands elsewhere in each image, at random.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "sensor-jitter",
    summary: "sensor shifted at random in each image (stabilised sensor)",
    parameters: &[parameter("size", "px", DefaultValue::Number(1.0), "standard deviation of each coordinate")],
    prepare,
};

struct SensorJitter {
    by_image: Vec<[f64; 2]>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let size = setting.values.size("size")?;
    let random = &mut setting.random;
    let by_image = setting.world.images.iter().map(|_| [size * random.normal(), size * random.normal()]).collect();
    unless(size == 0.0, SensorJitter { by_image })
}

impl Action for SensorJitter {
    fn interior(&self, image: usize, interior: &mut Interior) {
        let [x, y] = self.by_image[image];
        shift_sensor(interior, x, y);
    }
}
