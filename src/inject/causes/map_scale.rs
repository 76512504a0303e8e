//! Survey in a map projection, used as if it were true to scale. A definition: an even scale about the survey's centre.

use super::*;
use nalgebra::Vector2;

pub(super) static CAUSE: Cause = Cause {
    id: "map-scale",
    summary: "surveyed coordinates with the scale of a map grid, about their mean (control and check points alike)",
    parameters: &[parameter("m", "1", DefaultValue::Number(4e-4), "scale of the grid, minus one")],
    prepare,
};

struct MapScale {
    m: f64,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let m = setting.values.number("m");
    ensure!(!setting.world.surveyed.is_empty(), "the block has no surveyed points");
    unless(m == 0.0, MapScale { m })
}

impl Action for MapScale {
    fn measured(&mut self, world: &World, observations: &mut Observations) {
        let sum: Vector2<f64> = world.surveyed.iter().map(|point| point.position.xy()).sum();
        let mean = sum / world.surveyed.len() as f64;
        for (position, truth) in observations.surveyed.iter_mut().zip(&world.surveyed) {
            let change = (truth.position.xy() - mean) * self.m;
            position.x += change.x;
            position.y += change.y;
        }
    }
}
