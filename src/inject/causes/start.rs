//! Bad approximations: the poses, points and centres of distortion that the adjustment starts from.

use super::*;
use crate::block::Block;
use crate::camera::{DCX, DCY};
use nalgebra::{UnitQuaternion, Vector3};

pub(super) static CAUSE: Cause = Cause {
    id: "start",
    summary: "perturbed start values of poses, points and cameras, normally distributed; measurements stay",
    parameters: &[
        parameter(
            "position_m",
            "m",
            DefaultValue::Number(1.0),
            "standard deviation of each coordinate of a projection centre",
        ),
        parameter(
            "angle_deg",
            "deg",
            DefaultValue::Number(1.0),
            "standard deviation of the rotation about each camera axis",
        ),
        parameter("points_m", "m", DefaultValue::Number(0.0), "standard deviation of each coordinate of a tie point"),
        parameter(
            "centre_share",
            "",
            DefaultValue::Number(0.0),
            "standard deviation of each coordinate of a centre of distortion, as a share of the sensor",
        ),
        parameter("seed", "", DefaultValue::Optional("the seed of the whole"), "seed of these numbers alone"),
    ],
    prepare,
};

struct Start {
    centres: Vec<Vector3<f64>>,
    rotations: Vec<Vector3<f64>>,
    points: Vec<Vector3<f64>>,
    /// Shares of the sensor's width and height, by camera.
    distortion_centres: Vec<Vector3<f64>>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    let (position, angle, points) =
        (values.size("position_m")?, values.size("angle_deg")?.to_radians(), values.size("points_m")?);
    let share = values.size("centre_share")?;
    if let Some(seed) = values.optional("seed") {
        ensure!(seed >= 0.0 && seed.fract() == 0.0, "parameter `seed` must be a whole number, it is {seed}");
        setting.random = Random::new(seed as u64, CAUSE.id, 0);
    }
    let mut draw = |count: usize, size: f64| (0..count).map(|_| setting.random.normal3() * size).collect::<Vec<_>>();
    let images = setting.world.images.len();
    let start = Start {
        centres: draw(images, position),
        rotations: draw(images, angle),
        points: draw(setting.world.tie_points.len(), points),
        distortion_centres: draw(setting.world.cameras.len(), share),
    };
    unless([position, angle, points, share] == [0.0; 4], start)
}

impl Action for Start {
    fn record(&self, block: &mut Block) {
        for ((image, centre), rotation) in block.images.iter_mut().zip(&self.centres).zip(&self.rotations) {
            image.pose.centre += centre;
            image.pose.rotation = UnitQuaternion::from_scaled_axis(*rotation) * image.pose.rotation;
        }
        for (camera, share) in block.cameras.iter_mut().zip(&self.distortion_centres) {
            camera.interior[DCX] += share.x * f64::from(camera.width_px);
            camera.interior[DCY] += share.y * f64::from(camera.height_px);
        }
        for (point, shift) in block.tie_points.iter_mut().zip(&self.points) {
            if let Some(position) = &mut point.position {
                *position += shift;
            }
        }
    }
}
