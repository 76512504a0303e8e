//! Forward motion: the shutter is open while the platform moves on, and the centroid of the trail is measured.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "forward-motion",
    summary: "image motion while the shutter is open, from the image's time on; the centroid of the trail is measured",
    parameters: &[parameter(
        "exposure",
        "s",
        DefaultValue::Optional("the images' own exposure times"),
        "how long the shutter is open",
    )],
    prepare,
};

struct ForwardMotion {
    exposures: Vec<f64>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let world = setting.world;
    world.trajectory.need_velocities(&world.images)?;
    let exposures = match setting.values.optional("exposure") {
        Some(_) => vec![setting.values.size("exposure")?; world.images.len()],
        None => {
            let exposure = |image: &crate::block::Image| {
                image
                    .exposure_s
                    .ok_or_else(|| anyhow::anyhow!("image `{}` has no exposure time; give `exposure`", image.name))
            };
            world.images.iter().map(exposure).collect::<Result<_>>()?
        }
    };
    unless(exposures.iter().all(|exposure| *exposure == 0.0), ForwardMotion { exposures })
}

impl Action for ForwardMotion {
    fn exposure(&self, image: usize) -> f64 {
        self.exposures[image]
    }
}
