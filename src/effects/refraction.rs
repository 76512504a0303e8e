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

use super::common::{estimated, hand_on, vector};
use super::{Context, Descriptor, Effect, Kind, OutsideDomain, Scope, Stage, fill_identity};
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
});

impl Effect for Refraction {
    fn descriptor(&self) -> &Descriptor {
        &DESCRIPTOR
    }

    fn eval(
        &self,
        _: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        let kappa = theta[0];
        let from_centre = vector(input, 6) - vector(input, 3);
        let (d, height) = ([from_centre.x, from_centre.y], -from_centre.z);
        if height.is_nan() || height <= 0.0 {
            return Err(OutsideDomain);
        }
        let tan2 = (d[0] * d[0] + d[1] * d[1]) / (height * height);
        let factor = height * (1.0 + tan2);
        hand_on(Stage::Ray, input, out);
        for axis in 0..2 {
            out[axis] += kappa * factor * d[axis];
        }
        if let Some(matrix) = d_input {
            fill_identity(Stage::Ray, matrix);
            for i in 0..2 {
                // By C (columns 3 to 5) the opposite of by P (6 to 8). d factor / d d = 2 d / H, d factor / d H = 1 -
                // tan^2 z.
                let mut slopes = [kappa * 2.0 * d[i] * d[0] / height, kappa * 2.0 * d[i] * d[1] / height, 0.0];
                slopes[i] += kappa * factor;
                slopes[2] = -kappa * (1.0 - tan2) * d[i];
                for (k, slope) in slopes.into_iter().enumerate() {
                    matrix[i * 9 + 3 + k] -= slope;
                    matrix[i * 9 + 6 + k] += slope;
                }
            }
        }
        if let Some(matrix) = d_theta {
            matrix.copy_from_slice(&[factor * d[0], factor * d[1], 0.0]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ImageContext, laws};
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
