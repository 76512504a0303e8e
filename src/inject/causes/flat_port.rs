//! A plane window in front of the lens, perpendicular to its axis: Snell's law at both faces.

use super::*;
use crate::block::Pose;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "flat-port",
    summary: "plane-parallel window in front of the lens, traced through both faces",
    parameters: &[
        parameter("thickness", "m", DefaultValue::Number(0.005), "thickness of the window"),
        parameter("index", "1", DefaultValue::Number(1.5), "refractive index of the window; air on both sides"),
        parameter("distance", "m", DefaultValue::Number(0.02), "from the projection centre to the window"),
    ],
    prepare,
};

/// Each step gains the ratio of the window's thickness to the distance of the point.
const STEPS: usize = 60;
/// Miss at the point, in units of its distance, at which the ray counts as found.
const TOLERANCE: f64 = 1e-14;

struct FlatPort {
    thickness: f64,
    index: f64,
    distance: f64,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    let port = FlatPort {
        thickness: values.size("thickness")?,
        index: values.number("index"),
        distance: values.size("distance")?,
    };
    ensure!(port.index >= 1.0, "parameter `index` must be 1 or more, it is {}", port.index);
    unless(port.thickness == 0.0 || port.index == 1.0, port)
}

/// Direction of a ray behind a face whose normal is the z axis; `ratio` is the index before over the index behind.
/// `None` if reflected.
fn refract(direction: Vector3<f64>, ratio: f64) -> Option<Vector3<f64>> {
    let (x, y) = (direction.x * ratio, direction.y * ratio);
    let z2 = 1.0 - x * x - y * y;
    (z2 > 0.0).then(|| Vector3::new(x, y, z2.sqrt()))
}

impl FlatPort {
    /// Where the ray that leaves the projection centre in a direction (camera axes) reaches a depth.
    fn trace(&self, direction: Vector3<f64>, depth: f64) -> Option<Vector3<f64>> {
        let advance = |from: Vector3<f64>, direction: Vector3<f64>, dz: f64| from + direction * (dz / direction.z);
        let inside = refract(direction, 1.0 / self.index)?;
        let outside = refract(inside, self.index)?;
        let first_face = advance(Vector3::zeros(), direction, self.distance);
        let second_face = advance(first_face, inside, self.thickness);
        Some(advance(second_face, outside, depth - self.distance - self.thickness))
    }
}

impl Action for FlatPort {
    fn medium(&self, pose: &Pose, point: Vector3<f64>) -> Option<Vector3<f64>> {
        let target = pose.cam_from_world(&point);
        if target.z <= self.distance + self.thickness {
            // In front of nothing, or behind the camera: left to the projection to say.
            return if target.z <= 0.0 { Some(point) } else { None };
        }
        let mut aim = target;
        for _ in 0..STEPS {
            let miss = target - self.trace(aim.normalize(), target.z)?;
            aim.x += miss.x;
            aim.y += miss.y;
            if miss.xy().norm() <= TOLERANCE * target.norm() {
                return Some(pose.rotation.inverse() * aim + pose.centre);
            }
        }
        None
    }
}
