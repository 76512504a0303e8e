//! `gravity-sag`: the lens hangs in its mount, and shifts as the camera is turned against gravity.
//!
//! ```text
//! (ppx, ppy)' = (ppx, ppy) + S g        (dcx, dcy)' = (dcx, dcy) + S g
//! g = R (0, 0, -1): unit vector of gravity in the camera frame; world z is up
//! S = [sx_x sx_y sx_z; sy_x sy_y sy_z], px: sx_y is the shift in x that gravity along the camera's y causes
//! ```
//!
//! In nadir images g = (0, 0, 1) always, and only `pp` sees S; the columns that a block cannot separate from the
//! camera are dropped by the estimator, not here.
//!
//! Source: formula of the catalogue.
//!
//! Worked numbers: pp (2500, 1900), dc (2540, 1950), S = [1 2 3; 4 5 6]: a nadir camera, r = (pi, 0, 0), has g = (0,
//! 0, 1) and pp (2503, 1906), dc (2543, 1956); a level camera, r = (pi/2, 0, 0), has g = (0, 1, 0) and pp (2502,
//! 1905), dc (2542, 1955).

use super::common::{estimated, hand_on, shift_centres, shift_centres_column, vector};
use super::{Context, Descriptor, Effect, Kind, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use crate::camera::PARAMETER_COUNT;
use crate::math::rotation::{exp, left_jacobian, skew};
use nalgebra::Vector3;
use std::sync::LazyLock;

/// See the [module](self).
pub struct GravitySag;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "gravity-sag".into(),
    stage: Stage::Interior,
    kind: Kind::Physical,
    summary: "The lens hangs in its mount: principal point and centre of distortion depend on how the camera is held \
                    against gravity."
        .into(),
    formula: "(ppx, ppy) and (dcx, dcy) += S R (0, 0, -1)".into(),
    parameters: ["sx_x", "sx_y", "sx_z", "sy_x", "sy_y", "sy_z"]
        .map(|name| estimated(name, "px", Scope::Global, 2.0).up_to(50.0, "play of a lens mount, 0.2 mm at 4 um"))
        .to_vec(),
    needs: vec![],
    confused_with:
        "the principal point itself (all of it when every image is held alike), pp-flight (when each flight has \
                    its own tilt)"
            .into(),
    source: "Practice, without a publication: lens sag".into(),
    picture: Picture::Sensor,
    words: Some(Words {
        what: "Lens and mount give way under their weight. The principal point then depends on how the camera is held."
            .into(),
        remedy: "Support the lens, or model it.".into(),
        tell: "images with the camera turned about its axis".into(),
    }),
});

impl Effect for GravitySag {
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
        let r = vector(input, PARAMETER_COUNT);
        let gravity = exp(&r) * -Vector3::z();
        let rows = [vector(theta, 0), vector(theta, 3)];
        hand_on(Stage::Interior, input, out);
        shift_centres(out, rows.map(|row| row.dot(&gravity)));
        if let Some(matrix) = d_input {
            fill_identity(Stage::Interior, matrix);
            // exp([J dr]x) g = g - [g]x J dr.
            let by_r = -skew(&gravity) * left_jacobian(&r);
            for axis in 0..2 {
                let slope = rows[axis].transpose() * by_r;
                for k in 0..3 {
                    shift_centres_column(matrix, Stage::Interior.inputs(), axis, PARAMETER_COUNT + k, slope[k]);
                }
            }
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            for axis in 0..2 {
                for k in 0..3 {
                    shift_centres_column(matrix, 6, axis, 3 * axis + k, gravity[k]);
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ImageContext, laws};
    use super::*;
    use crate::camera::K1;
    use approx::assert_relative_eq;

    #[test]
    fn worked_numbers() {
        let pi = std::f64::consts::PI;
        let cases =
            [(pi, [5000.0, 2503.0, 1906.0, 2543.0, 1956.0]), (0.5 * pi, [5000.0, 2502.0, 1905.0, 2542.0, 1955.0])];
        for (angle, shifted) in cases {
            let mut input = [0.0; Stage::Interior.inputs()];
            input[..K1].copy_from_slice(&[5000.0, 2500.0, 1900.0, 2540.0, 1950.0]);
            input[PARAMETER_COUNT] = angle;
            let theta = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
            let found = laws::value(&GravitySag, &ImageContext::default(), &input, &theta);
            assert_relative_eq!(found[..5], shifted, epsilon = 1e-11);
        }
    }
}
