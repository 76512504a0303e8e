//! `refraction`: the air is denser below, rays are bent, and points are seen farther from the nadir than they are.
//!
//! ```text
//! d = P_h - C_h (horizontal)        H = C_z - P_z        tan^2 z = |d|^2 / H^2, z the nadir angle
//! P_h' = P_h + kappa H (1 + tan^2 z) d = P_h + kappa (H + |d|^2 / H) d
//! ```
//!
//! `kappa` in 1/m, 1.3e-8 in the standard atmosphere near the ground; positive: outwards. Domain: the point below the
//! camera, `H > 0`.
//!
//! Source: Saastamoinen (1972), introduction to practical computation of astronomical refraction; as used for aerial
//! images in Kraus.
//!
//! Worked numbers, C = (0, 0, 100), kappa = 1e-6: P = (50, 0, 0) is seen at (50.00625, 0, 0), P = (30, 40, 0) at
//! (30.00375, 40.005, 0).

use super::common::estimated;
use super::formula::{Formula, Given, Sum};
use super::{Descriptor, Kind, Picture, Scope, Stage, Words};
use crate::math::Several;
use std::sync::LazyLock;

/// See the [module](self).
pub struct Refraction;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "refraction".into(),
    stage: Stage::Ray,
    kind: Kind::Physical,
    summary: "Atmospheric refraction: rays are bent, points are seen farther from the nadir.".into(),
    formula: "P_h += kappa H (1 + tan^2 z) (P_h - C_h), H = C_z - P_z".into(),
    parameters: vec![estimated("kappa", "1/m", Scope::Global, 1.3e-8).within(
        0.0,
        5e-8,
        "1.3e-8 in the standard atmosphere at sea level; four times that in no weather (Saastamoinen 1972)",
    )],
    needs: vec![],
    confused_with:
        "radial distortion in nadir images (the same columns at one height: flights at two heights or oblique \
                    images tell)"
            .into(),
    source: "Saastamoinen 1972".into(),
    picture: Picture::Radius,
    words: Some(Words {
        what: "The air grows thinner with height and bends rays slightly. From some kilometres, or over hot ground, \
               points move outwards in the image."
            .into(),
        remedy: "Model it; record air pressure and temperature.".into(),
        tell: "images from two heights".into(),
    }),
});

impl Formula for Refraction {
    const STAGE: Stage = Stage::Ray;

    fn descriptor() -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// Holds where the camera is above the point.
    #[inline(always)]
    fn add<T: Several>(given: &Given<'_, T>, answer: &mut Sum<'_, T>) -> T {
        let kappa = given.theta(0);
        let d = [given.input(6) - given.input(3), given.input(7) - given.input(4)];
        let height = given.input(5) - given.input(8);
        // Of the nadir angle, by axis: one division for all.
        let inverse = given.constant(1.0) / height;
        let tangent = [d[0] * inverse, d[1] * inverse];
        let tan2 = tangent[0] * tangent[0] + tangent[1] * tangent[1];
        let factor = height * (given.constant(1.0) + tan2);
        for i in 0..2 {
            answer.out(i, kappa * factor * d[i]);
            answer.by_theta(i, 0, factor * d[i]);
            if answer.wants_input() {
                // By C (columns 3 to 5) the opposite of by P (6 to 8). d factor / d d = 2 d / H, d factor / d H = 1 -
                // tan^2 z.
                let steep = kappa * 2.0 * tangent[i];
                let mut slopes = [steep * d[0], steep * d[1]];
                slopes[i] = slopes[i] + kappa * factor;
                let by_height = -(kappa * (given.constant(1.0) - tan2) * d[i]);
                for (k, slope) in [slopes[0], slopes[1], by_height].into_iter().enumerate() {
                    answer.by_input(i, 3 + k, -slope);
                    answer.by_input(i, 6 + k, slope);
                }
            }
        }
        height
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Context, Effect, ImageContext, OutsideDomain, laws};
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn worked_numbers() {
        for (point, seen) in [([50.0, 0.0], [50.00625, 0.0, 0.0]), ([30.0, 40.0], [30.00375, 40.005, 0.0])] {
            let input = [0.0, 0.0, 0.0, 0.0, 0.0, 100.0, point[0], point[1], 0.0];
            let found = laws::value(&Refraction, &ImageContext::default(), &input, &[1e-6]);
            assert_relative_eq!(found[..], seen, epsilon = 1e-13);
        }
    }

    #[test]
    fn a_point_at_the_height_of_the_camera_is_outside_the_domain() {
        let context = Context {
            block: &Default::default(),
            image: &ImageContext::default(),
            column_px: 0.0,
            row_px: 0.0,
            surveyed: None,
        };
        let input = [0.0, 0.0, 0.0, 0.0, 0.0, 100.0, 50.0, 0.0, 100.0];
        assert_eq!(Refraction.eval(&context, &input, &[1e-6], &mut [0.0; 3], None, None), Err(OutsideDomain));
    }
}
