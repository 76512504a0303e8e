//! GNSS whose ambiguities are wrong: in each flight the positions start off and then drift evenly.

use super::*;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "gnss-drift",
    summary: "GNSS positions off and drifting, at random in each flight (wrong ambiguities)",
    parameters: &[
        parameter(
            "offset_m",
            "m",
            DefaultValue::Number(0.1),
            "standard deviation of each coordinate at the start of a flight",
        ),
        parameter("rate", "m/s", DefaultValue::Number(0.001), "standard deviation of each coordinate's drift"),
    ],
    prepare,
};

struct GnssDrift {
    by_image: Vec<Vector3<f64>>,
    notes: Vec<(String, String)>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (values, world) = (setting.values, setting.world);
    world.need_gnss()?;
    let (offset_m, rate) = (values.size("offset_m")?, values.size("rate")?);
    let times = world.times()?;
    let mut by_image = vec![Vector3::zeros(); times.len()];
    let mut notes = Vec::new();
    for (flight, name) in world.flights.iter().enumerate() {
        let (offset, drift) = (setting.random.normal3() * offset_m, setting.random.normal3() * rate);
        let images = || world.images.iter().enumerate().filter(|(_, image)| image.flight.index() == flight);
        let start = images().map(|(index, _)| times[index]).fold(f64::INFINITY, f64::min);
        for (index, _) in images() {
            by_image[index] = offset + drift * (times[index] - start);
        }
        notes.push((format!("offset[{name}]"), format!("{} {} {} m", offset.x, offset.y, offset.z)));
        notes.push((format!("drift[{name}]"), format!("{} {} {} m/s", drift.x, drift.y, drift.z)));
    }
    unless(offset_m == 0.0 && rate == 0.0, GnssDrift { by_image, notes })
}

impl Action for GnssDrift {
    fn antenna(&self, image: usize, antenna: &mut Vector3<f64>) {
        *antenna += self.by_image[image];
    }

    fn notes(&self) -> Vec<(String, String)> {
        self.notes.clone()
    }
}
