//! Wrong matches: a part of the tie-point measurements is far off, in any direction.

use super::*;
use std::f64::consts::TAU;

pub(super) static CAUSE: Cause = Cause {
    id: "outliers",
    summary: "a part of the tie-point measurements far off in any direction, all over the block or in one image",
    parameters: &[
        parameter("fraction", "1", DefaultValue::Number(0.02), "of all tie-point measurements"),
        parameter("min", "px", DefaultValue::Number(5.0), "least size; uniform up to max"),
        parameter("max", "px", DefaultValue::Number(50.0), "largest size"),
        parameter("spread", "", DefaultValue::Choice("block", &["block", "image"]), "image: all of them in one image"),
        parameter("image", "", DefaultValue::Name("drawn at random"), "that image"),
    ],
    prepare,
};

struct Outliers {
    chosen: Vec<usize>,
    shifts: Vec<[f64; 2]>,
    notes: Vec<(String, String)>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (values, world) = (setting.values, setting.world);
    let fraction = values.size("fraction")?;
    ensure!(fraction <= 1.0, "parameter `fraction` must be 1 or less, it is {fraction}");
    let (min, max) = (values.size("min")?, values.size("max")?);
    ensure!(min <= max, "parameter `min` ({min}) is above `max` ({max})");
    let one_image = values.word("spread") == "image";
    ensure!(one_image || values.word("image").is_empty(), "`image` needs spread=image");
    let count = (fraction * world.ties.len() as f64).round() as usize;
    let random = &mut setting.random;
    let mut notes = Vec::new();
    let candidates: Vec<usize> = if one_image && !world.images.is_empty() {
        let image = match values.word("image") {
            "" => random.index(world.images.len()),
            name => image_named(world, name)?,
        };
        notes.push(("image".into(), world.images[image].name.clone()));
        (0..world.ties.len()).filter(|tie| world.ties[*tie].image.index() == image).collect()
    } else {
        (0..world.ties.len()).collect()
    };
    let chosen = random.choose(candidates, count);
    notes.push(("outliers".into(), chosen.len().to_string()));
    let shift = |_: &usize| {
        let (sin, cos) = random.uniform(0.0, TAU).sin_cos();
        let size = random.uniform(min, max);
        [size * cos, size * sin]
    };
    let shifts = chosen.iter().map(shift).collect();
    unless(count == 0 || max == 0.0, Outliers { chosen, shifts, notes })
}

impl Action for Outliers {
    fn measured(&mut self, _world: &World, observations: &mut Observations) {
        for (tie, [dx, dy]) in self.chosen.iter().zip(&self.shifts) {
            if let Ok(xy) = &mut observations.ties[*tie] {
                xy[0] += dx;
                xy[1] += dy;
            }
        }
    }

    fn outliers(&self) -> &[usize] {
        &self.chosen
    }

    fn notes(&self) -> Vec<(String, String)> {
        self.notes.clone()
    }
}
