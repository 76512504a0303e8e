//! `radial-high`: radial distortion of a higher order than the camera's three terms, as in wide-angle lenses.
//!
//! ```text
//! d = (x, y) - (dcx, dcy)        r = |d|        (x', y') = (x, y) + k4 r^8 d
//! ```
//!
//! `k4` in px^-8; positive: outwards. `(x, y)` is the predicted point, the camera's distortion included.
//!
//! Source: Brown (1971), close-range camera calibration.
//!
//! Worked numbers, dc (2500, 1900), k4 = 1e-31: (5500, 1900) goes to (5501.9683, 1900); (2500, -100) goes to (2500,
//! -100.0512).

use super::common::estimated;
use super::formula::{Formula, Given, Sum};
use super::{Descriptor, IMAGE_INTERIOR, Kind, Picture, Scope, Stage, Words};
use crate::camera::{DCX, DCY};
use crate::math::Several;
use std::sync::LazyLock;

/// See the [module](self).
pub struct RadialHigh;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "radial-high".into(),
    stage: Stage::Image,
    kind: Kind::Physical,
    summary: "Radial distortion beyond the camera's third term.".into(),
    formula: "(x, y) += k4 r^8 d".into(),
    parameters: vec![
        estimated("k4", "px^-8", Scope::Global, 1e-31)
            .up_to(3e-30, "100 px at 3200 px from the centre: a fisheye beside the camera's three terms"),
    ],
    needs: vec![],
    confused_with: "unflatness, image-grid and image-fourier; most of it goes into k1, k2, k3 where these are free"
        .into(),
    source: "Brown 1971".into(),
    picture: Picture::Radius,
    words: Some(Words {
        what: "The lens distorts more at its edge than the usual three numbers can say. Wide lenses, and images \
               already corrected by the camera, need a further one."
            .into(),
        remedy: "Add the term; do not measure in the outermost corners; use images that the camera did not correct."
            .into(),
        tell: "measurements in the corners of the images".into(),
    }),
});

impl Formula for RadialHigh {
    const STAGE: Stage = Stage::Image;

    fn descriptor() -> &'static Descriptor {
        &DESCRIPTOR
    }

    #[inline(always)]
    fn add<T: Several>(given: &Given<'_, T>, answer: &mut Sum<'_, T>) -> T {
        let k4 = given.theta(0);
        let dx = given.input(0) - given.input(IMAGE_INTERIOR + DCX);
        let dy = given.input(1) - given.input(IMAGE_INTERIOR + DCY);
        let d = [dx, dy];
        let r2 = dx * dx + dy * dy;
        let r6 = r2 * r2 * r2;
        let r8 = r6 * r2;
        for i in 0..2 {
            answer.out(i, k4 * r8 * d[i]);
            answer.by_theta(i, 0, r8 * d[i]);
        }
        if answer.wants_input() {
            for i in 0..2 {
                for j in 0..2 {
                    let mut slope = r6 * d[i] * d[j] * 8.0;
                    if i == j {
                        slope = slope + r8;
                    }
                    let slope = k4 * slope;
                    answer.by_input(i, j, slope);
                    answer.by_input(i, IMAGE_INTERIOR + DCX + j, -slope);
                }
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
        let moved = |x: f64, y: f64| {
            let mut input = [0.0; 14];
            input[..7].copy_from_slice(&[x, y, 5000.0, 0.0, 0.0, 2500.0, 1900.0]);
            laws::value(&RadialHigh, &ImageContext::default(), &input, &[1e-31])
        };
        assert_relative_eq!(moved(5500.0, 1900.0)[..], [5501.9683, 1900.0], epsilon = 1e-11);
        assert_relative_eq!(moved(2500.0, -100.0)[..], [2500.0, -100.0512], epsilon = 1e-11);
    }

    #[test]
    fn what_is_typical_is_the_displacement_at_the_corner() {
        let corner = |half_diagonal: f64| DESCRIPTOR.parameters[0].typical_on(half_diagonal) * half_diagonal.powi(9);
        assert_relative_eq!(corner(900.0), corner(3200.0), max_relative = 1e-12);
        assert_eq!(DESCRIPTOR.parameters[0].typical_on(3200.0), 1e-31);
    }
}
