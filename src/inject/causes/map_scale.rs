//! Coordinates in the grid of a map projection, used as if they were true to scale: the grid's point scale factor
//! stretches the plane coordinates about the middle of the survey, heights stay. A definition, as that of the grid
//! itself.

use super::map_frame::{COORDINATES, Coordinates, middle};
use super::*;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "map-scale",
    summary: "surveyed and GNSS coordinates with the scale of a map grid, about the middle of the survey",
    parameters: &[parameter("m", "1", DefaultValue::Number(4e-4), "scale of the grid, minus one"), COORDINATES],
    prepare,
};

struct MapScale {
    coordinates: Coordinates,
    scale: f64,
    middle: Vector3<f64>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let m = setting.values.number("m");
    let coordinates = Coordinates::of(setting)?;
    unless(m == 0.0, MapScale { coordinates, scale: 1.0 + m, middle: middle(setting.world) })
}

impl Action for MapScale {
    fn measured(&mut self, _world: &World, observations: &mut Observations) {
        self.coordinates.draw(observations, |place| {
            let plane = self.middle.xy() + (place - self.middle).xy() * self.scale;
            Vector3::new(plane.x, plane.y, place.z)
        });
    }
}
