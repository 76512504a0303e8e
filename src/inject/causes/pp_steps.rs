//! A lens taken off and fitted again between flights: principal point and centre of distortion by flight.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "pp-steps",
    summary: "another principal point and centre of distortion in each flight (lens refitted)",
    parameters: &[
        parameter(
            "size",
            "px",
            DefaultValue::Number(3.0),
            "standard deviation of each coordinate, zero for the first flight",
        ),
        parameter("x", "px", DefaultValue::List("drawn at random"), "change by flight, one value each: 0/3/-2"),
        parameter("y", "px", DefaultValue::List("drawn at random"), "change by flight, one value each"),
    ],
    prepare,
};

struct PpSteps {
    by_image: Vec<[f64; 2]>,
    notes: Vec<(String, String)>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (values, world) = (setting.values, setting.world);
    let size = values.size("size")?;
    let x = steps_by_flight(values.list("x"), size, world, &mut setting.random)?;
    let y = steps_by_flight(values.list("y"), size, world, &mut setting.random)?;
    let mut notes = notes_by_flight(world, "x", "px", &x);
    notes.extend(notes_by_flight(world, "y", "px", &y));
    let flights = world.images.iter().map(|image| image.flight.index());
    let by_image = flights.map(|flight| [x[flight], y[flight]]).collect();
    unless(x.iter().chain(&y).all(|step| *step == 0.0), PpSteps { by_image, notes })
}

impl Action for PpSteps {
    fn interior(&self, image: usize, interior: &mut Interior) {
        let [x, y] = self.by_image[image];
        shift_sensor(interior, x, y);
    }

    fn notes(&self) -> Vec<(String, String)> {
        self.notes.clone()
    }
}
