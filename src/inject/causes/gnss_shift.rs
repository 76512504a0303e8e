//! GNSS in another datum, or with a wrong geoid or antenna height: all positions are shifted.

use super::*;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "gnss-shift",
    summary: "GNSS positions shifted, all or those of one flight (datum, geoid, antenna height)",
    parameters: &[
        parameter("x", "m", DefaultValue::Number(0.0), "shift"),
        parameter("y", "m", DefaultValue::Number(0.0), "shift"),
        parameter("z", "m", DefaultValue::Number(0.1), "shift"),
        parameter("flight", "", DefaultValue::Name("every flight"), "the flight that is shifted"),
    ],
    prepare,
};

struct GnssShift {
    by_image: Vec<Vector3<f64>>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (values, world) = (setting.values, setting.world);
    world.need_gnss()?;
    let shift = Vector3::new(values.number("x"), values.number("y"), values.number("z"));
    let flight = values.word("flight");
    ensure!(flight.is_empty() || world.flights.iter().any(|name| name == flight), "the block has no flight `{flight}`");
    let shifted = |name: &str| flight.is_empty() || name == flight;
    let of = |image: &crate::block::Image| {
        if shifted(&world.flights[image.flight.index()]) { shift } else { Vector3::zeros() }
    };
    unless(shift == Vector3::zeros(), GnssShift { by_image: world.images.iter().map(of).collect() })
}

impl Action for GnssShift {
    fn antenna(&self, image: usize, antenna: &mut Vector3<f64>) {
        *antenna += self.by_image[image];
    }
}
