//! Coordinates of a map used as if they were Cartesian: the ground really lies on a sphere.
//!
//! A point at map distance `s` and height `h` above the reference height lies on the radius that leaves the sphere at the
//! arc `s`: at `((R + h) sin(s/R), (R + h) cos(s/R) - R)` in the plane tangent at the block's centre. Cameras stay where they are.

use super::*;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "earth-curvature",
    summary: "points given in map coordinates lie on the curved Earth; cameras and GNSS are Cartesian",
    parameters: &[
        parameter("q", "1", DefaultValue::Number(1.0), "curvature in units of the Earth's"),
        parameter("radius", "m", DefaultValue::Number(6_371_000.0), "radius of the Earth"),
    ],
    prepare,
};

struct EarthCurvature {
    /// Of the curvature that acts.
    radius: f64,
    centre: Vector3<f64>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (q, radius) = (setting.values.size("q")?, setting.values.positive("radius")?);
    let world = setting.world;
    let mut centre = mean(world.images.iter().map(|image| image.pose.centre));
    let points = world.tie_points.iter().copied().chain(world.surveyed.iter().map(|point| point.position));
    // Heights count from the mean ground, so that the projection keeps the scale there.
    centre.z = mean(points).z;
    unless(q == 0.0, EarthCurvature { radius: radius / q, centre })
}

fn mean(points: impl Iterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let (sum, count) = points.fold((Vector3::zeros(), 0.0), |(sum, count), point| (sum + point, count + 1.0));
    if count == 0.0 { sum } else { sum / count }
}

impl Action for EarthCurvature {
    fn scene(&self, point: Vector3<f64>) -> Vector3<f64> {
        let from_centre = point - self.centre;
        let distance = from_centre.xy().norm();
        if distance == 0.0 {
            return point;
        }
        let (sin, cos) = (distance / self.radius).sin_cos();
        // cos - 1, without the loss of digits.
        let versine = sin * sin / (1.0 + cos);
        let height = from_centre.z;
        let stretch = (self.radius + height) * sin / distance;
        Vector3::new(
            self.centre.x + from_centre.x * stretch,
            self.centre.y + from_centre.y * stretch,
            self.centre.z + height * cos - self.radius * versine,
        )
    }
}
