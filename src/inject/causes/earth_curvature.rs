//! Coordinates of a map used as if they were Cartesian.
//!
//! The world is Cartesian and stays so; the survey, the receiver or both give its places in a map of a sphere. The
//! sphere touches the plane `z = height` in the middle of the surveyed points (of the antennas, without any). A place
//! is drawn at the arc from there to its foot on the sphere, in true azimuth (azimuthal equidistant), with its height
//! above the sphere. Every good map of a block is that one up to `s^3 / R^2`: 2 mm at 4 km.

use super::map_frame::{COORDINATES, Coordinates, middle};
use super::*;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "earth-curvature",
    summary: "surveyed and GNSS coordinates are those of a map of a sphere: arcs along it and heights above it",
    parameters: &[
        parameter("q", "1", DefaultValue::Number(1.0), "curvature in units of the Earth's"),
        parameter("radius", "m", DefaultValue::Number(6_371_000.0), "radius of the Earth"),
        parameter(
            "height",
            "m",
            DefaultValue::Optional("the mean height of the ground"),
            "height at which the map is true to scale",
        ),
        COORDINATES,
    ],
    prepare,
};

struct EarthCurvature {
    coordinates: Coordinates,
    sphere: Sphere,
}

/// A sphere and the point where it is drawn true.
struct Sphere {
    radius: f64,
    touching: Vector3<f64>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (q, radius) = (setting.values.size("q")?, setting.values.positive("radius")?);
    if q == 0.0 {
        return Ok(None);
    }
    let coordinates = Coordinates::of(setting)?;
    let world = setting.world;
    let ground: Vec<f64> = world
        .tie_points
        .iter()
        .map(|point| point.z)
        .chain(world.surveyed.iter().map(|point| point.position.z))
        .collect();
    let mean_ground = ground.iter().sum::<f64>() / (ground.len() as f64).max(1.0);
    let mut touching = middle(world);
    touching.z = setting.values.optional("height").unwrap_or(mean_ground);
    Ok(Some(Box::new(EarthCurvature { coordinates, sphere: Sphere { radius: radius / q, touching } })))
}

impl Sphere {
    /// Where a place of the world stands in the map.
    fn drawn(&self, place: Vector3<f64>) -> Vector3<f64> {
        let from_touching = place - self.touching;
        let distance = from_touching.xy().norm();
        if distance == 0.0 {
            return place;
        }
        let from_centre = (self.radius + from_touching.z).hypot(distance);
        let arc = self.radius * distance.atan2(self.radius + from_touching.z);
        // Distance from the sphere's centre less its radius, without the loss of digits: the difference of squares by
        // the sum.
        let sum = from_centre + self.radius;
        let rise = distance * (distance / sum) + from_touching.z * ((2.0 * self.radius + from_touching.z) / sum);
        let stretch = arc / distance;
        Vector3::new(
            self.touching.x + from_touching.x * stretch,
            self.touching.y + from_touching.y * stretch,
            self.touching.z + rise,
        )
    }
}

impl Action for EarthCurvature {
    fn measured(&mut self, _world: &World, observations: &mut Observations) {
        self.coordinates.draw(observations, |place| self.sphere.drawn(place));
    }
}
