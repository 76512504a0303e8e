//! `decentring-high`: decentring distortion of the next order, from lens elements off their axis.
//!
//! ```text
//! d = (dx, dy) = (x, y) - (dcx, dcy)        r2 = dx^2 + dy^2
//! x' = x + r2 (q1 (r2 + 2 dx^2) + 2 q2 dx dy)
//! y' = y + r2 (q2 (r2 + 2 dy^2) + 2 q1 dx dy)
//! ```
//!
//! `q1, q2` in px^-3: p1, p2 of the camera with a factor r2. `(x, y)` is the predicted point, the camera's distortion
//! included.
//!
//! Source: Brown (1966), decentering distortion of lenses.
//!
//! Worked numbers, dc (2500, 1900): q = (1e-15, 0) moves (3500, 1900) to (3500.003, 1900); q = (3e-15, -2e-15) moves
//! (3500, 3900) to (3500.065, 3899.93).

use super::common::estimated;
use super::formula::{Formula, Given, Sum};
use super::{Descriptor, IMAGE_INTERIOR, Kind, Picture, Scope, Stage, Words};
use crate::camera::{DCX, DCY};
use crate::math::Several;
use std::sync::LazyLock;

/// See the [module](self).
pub struct DecentringHigh;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "decentring-high".into(),
    stage: Stage::Image,
    kind: Kind::Physical,
    summary: "Decentring distortion of the next order: lens elements off their axis.".into(),
    formula: "(x, y) += r^2 (q1 (r^2+2dx^2) + 2 q2 dx dy, q2 (r^2+2dy^2) + 2 q1 dx dy)".into(),
    parameters: ["q1", "q2"]
        .map(|name| {
            estimated(name, "px^-3", Scope::Global, 1e-15)
                .up_to(1e-13, "10 px at 3200 px from the centre: all of a simple lens' decentring (Brown 1966)")
        })
        .to_vec(),
    needs: vec![],
    confused_with:
        "unflatness (nearly the same columns over flat ground), a wrong p1, p2 or centre of distortion that the \
                    model holds fixed"
            .into(),
    source: "Brown 1966".into(),
    picture: Picture::Sensor,
    words: Some(Words {
        what: "The elements of the lens are not exactly behind each other, and more than the usual two numbers \
               describe. The distortion is stronger on one side of the image."
            .into(),
        remedy: "Add the terms, or have the lens centred.".into(),
        tell: "images turned by 90 and 180 degrees, and measurements in all corners".into(),
    }),
});

impl Formula for DecentringHigh {
    const STAGE: Stage = Stage::Image;

    fn descriptor() -> &'static Descriptor {
        &DESCRIPTOR
    }

    #[inline(always)]
    fn add<T: Several>(given: &Given<'_, T>, answer: &mut Sum<'_, T>) -> T {
        let (q1, q2) = (given.theta(0), given.theta(1));
        let dx = given.input(0) - given.input(IMAGE_INTERIOR + DCX);
        let dy = given.input(1) - given.input(IMAGE_INTERIOR + DCY);
        let r2 = dx * dx + dy * dy;
        let (along_x, along_y, cross) = (r2 + dx * dx * 2.0, r2 + dy * dy * 2.0, dx * dy * 2.0);
        let shift = [q1 * along_x + q2 * cross, q2 * along_y + q1 * cross];
        for axis in 0..2 {
            answer.out(axis, r2 * shift[axis]);
        }
        if answer.wants_input() {
            let mixed = r2 * (q1 * dy + q2 * dx) * 2.0;
            let slopes = [
                [dx * shift[0] * 2.0 + r2 * (q1 * dx * 6.0 + q2 * dy * 2.0), dy * shift[0] * 2.0 + mixed],
                [dx * shift[1] * 2.0 + mixed, dy * shift[1] * 2.0 + r2 * (q2 * dy * 6.0 + q1 * dx * 2.0)],
            ];
            for i in 0..2 {
                for j in 0..2 {
                    answer.by_input(i, j, slopes[i][j]);
                    answer.by_input(i, IMAGE_INTERIOR + DCX + j, -slopes[i][j]);
                }
            }
        }
        for (i, row) in [[along_x, cross], [cross, along_y]].into_iter().enumerate() {
            for (p, value) in row.into_iter().enumerate() {
                answer.by_theta(i, p, r2 * value);
            }
        }
        given.constant(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ImageContext, laws};
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn worked_numbers() {
        let moved = |x: f64, y: f64, q: [f64; 2]| {
            let mut input = [0.0; 14];
            input[..7].copy_from_slice(&[x, y, 5000.0, 0.0, 0.0, 2500.0, 1900.0]);
            laws::value(&DecentringHigh, &ImageContext::default(), &input, &q)
        };
        assert_relative_eq!(moved(3500.0, 1900.0, [1e-15, 0.0])[..], [3500.003, 1900.0], epsilon = 1e-11);
        assert_relative_eq!(moved(3500.0, 3900.0, [3e-15, -2e-15])[..], [3500.065, 3899.93], epsilon = 1e-11);
    }
}
