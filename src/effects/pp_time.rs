//! `pp-time`: the principal point drifts linearly over the block's time, and the centre of distortion with it: sensor
//! or lens moves sideways as the camera warms up.
//!
//! ```text
//! (ppx, ppy)' = (ppx, ppy) + (ax, ay) tau        (dcx, dcy)' = (dcx, dcy) + (ax, ay) tau
//! tau = (t - mean t) / (max t - min t) over the block's images
//! ```
//!
//! `ax, ay` in pixels over the whole span; positive: to the right and down with time.
//!
//! Source: warm-up drift, e.g. Smith, Cope (2010), effects of temperature on digital cameras.
//!
//! Worked numbers: pp (2500, 1900), dc (2540, 1950), a = (4, -3): tau = 0.5 gives pp (2502, 1898.5), dc (2542,
//! 1948.5); tau = -0.25 gives pp (2499, 1900.75), dc (2539, 1950.75).

use super::common::{estimated, hand_on, known, shift_centres, shift_centres_column};
use super::{By, Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use std::sync::LazyLock;

/// See the [module](self).
pub struct PpTime;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "pp-time".into(),
    stage: Stage::Interior,
    kind: Kind::Physical,
    summary: "Principal point and centre of distortion drift linearly with time over the whole block.".into(),
    formula: "(ppx, ppy) and (dcx, dcy) += (ax, ay) tau".into(),
    parameters: ["ax", "ay"]
        .map(|name| {
            estimated(name, "px", Scope::Global, 3.0)
                .up_to(30.0, "three times what cameras showed in warming up (Smith, Cope 2010)")
        })
        .to_vec(),
    needs: vec![Need::Time],
    confused_with: "pp-flight (a step between flights instead of a slope within them)".into(),
    source: "Smith, Cope 2010, effects of temperature variation on single-lens-reflex digital cameras".into(),
    picture: Picture::Shift(By::Time),
    words: Some(Words {
        what:
            "The point where the optical axis meets the sensor wandered during the flight. A sagging mount or a lens \
               that warms up on one side does this."
                .into(),
        remedy: "Check lens and mount for play; model it.".into(),
        tell: "flights in opposite directions, and turned images".into(),
    }),
});

impl Effect for PpTime {
    fn descriptor(&self) -> &Descriptor {
        &DESCRIPTOR
    }

    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        let tau = known(context.image.tau)?;

        hand_on(Stage::Interior, input, out);
        shift_centres(out, [theta[0] * tau, theta[1] * tau]);
        if let Some(matrix) = d_input {
            fill_identity(Stage::Interior, matrix);
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            for axis in 0..2 {
                shift_centres_column(matrix, 2, axis, axis, tau);
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
    #[test]
    fn worked_numbers() {
        let mut input = [0.0; Stage::Interior.inputs()];
        input[..K1].copy_from_slice(&[5000.0, 2500.0, 1900.0, 2540.0, 1950.0]);
        let cases =
            [(0.5, [5000.0, 2502.0, 1898.5, 2542.0, 1948.5]), (-0.25, [5000.0, 2499.0, 1900.75, 2539.0, 1950.75])];
        for (tau, shifted) in cases {
            let image = ImageContext { tau, ..Default::default() };
            assert_eq!(laws::value(&PpTime, &image, &input, &[4.0, -3.0])[..5], shifted);
        }
    }
}
