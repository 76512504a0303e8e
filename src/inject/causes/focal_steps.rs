//! A lens refocused between flights: one focal length per flight.

use super::*;

pub(super) static CAUSE: Cause = Cause {
    id: "focal-steps",
    summary: "another focal length in each flight (refocused in between)",
    parameters: &[
        parameter(
            "size",
            "px",
            DefaultValue::Number(3.0),
            "standard deviation of the steps, zero for the first flight",
        ),
        parameter("steps", "px", DefaultValue::List("drawn at random"), "change by flight, one value each: 0/3/-2"),
    ],
    prepare,
};

struct FocalSteps {
    by_image: Vec<f64>,
    notes: Vec<(String, String)>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (values, world) = (setting.values, setting.world);
    let steps = steps_by_flight(values.list("steps"), values.size("size")?, world, &mut setting.random)?;
    let action = FocalSteps {
        by_image: world.images.iter().map(|image| steps[image.flight.index()]).collect(),
        notes: notes_by_flight(world, "f", "px", &steps),
    };
    unless(steps.iter().all(|step| *step == 0.0), action)
}

impl Action for FocalSteps {
    fn interior(&self, image: usize, interior: &mut Interior) {
        interior[F] += self.by_image[image];
    }

    fn notes(&self) -> Vec<(String, String)> {
        self.notes.clone()
    }
}
