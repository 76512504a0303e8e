//! An autofocus that hunts: the focal length of each image is a little off, at random.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "focus-hunting",
    summary: "focal length at random in each image (autofocus)",
    parameters: &[parameter("size", "px", DefaultValue::Number(1.0), "standard deviation")],
    prepare,
};

struct FocusHunting {
    by_image: Vec<f64>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let size = setting.values.size("size")?;
    let by_image = setting.world.images.iter().map(|_| size * setting.random.normal()).collect();
    unless(size == 0.0, FocusHunting { by_image })
}

impl Action for FocusHunting {
    fn interior(&self, image: usize, interior: &mut Interior) {
        interior[F] += self.by_image[image];
    }
}
