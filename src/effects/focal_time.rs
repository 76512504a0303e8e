//! `focal-time`: the focal length drifts linearly over the block's time, as a lens does that settles or warms up.
//!
//! ```text
//! f' = f + a tau        tau = (t - mean t) / (max t - min t) over the block's images, without unit
//! ```
//!
//! `a` is in pixels over the block's whole span; positive: the focal length grows with time. With `against=order` tau
//! is taken from the image's place in the table (`tau_order`) instead of its time.
//!
//! Source: gradual change of focal length, Zhou et al. (2019).
//!
//! Worked numbers: f = 5000, a = 8, tau = 0.25 gives 5002; f = 5000, a = -3, `against=order`, tau_order = -0.5 gives
//! 5001.5.

use super::common::{estimated, given, hand_on, known};
use super::{By, Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use crate::camera::F;
use std::sync::LazyLock;

/// See the [module](self).
pub struct FocalTime;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "focal-time".into(),
    stage: Stage::Interior,
    kind: Kind::Physical,
    summary: "The focal length drifts linearly with time over the whole block.".into(),
    formula: "f += a tau (against=order: a tau_order)".into(),
    parameters: vec![
        estimated("a", "px", Scope::Global, 5.0).up_to(100.0, "30 K of warming at 3 px/K (Daakir et al. 2019)"),
        given("against", "1", 0.0, &[("time", 0.0), ("order", 1.0)]),
    ],
    needs: vec![Need::Time],
    confused_with: "focal-flight (a step between flights instead of a slope within them), focal-temperature (when \
                    temperature follows time)"
        .into(),
    source: "Zhou et al. 2019, gradual change of focal length".into(),
    picture: Picture::Scale(By::Time),
    words: Some(Words {
        what: "The focal length changed steadily during the flight, as lenses do while they warm up or settle. Images \
               from the beginning and the end then disagree on scale."
            .into(),
        remedy: "Let the camera reach its temperature before the flight, and switch autofocus off; else model it."
            .into(),
        tell: "a recorded temperature, or a second flight with a warm camera".into(),
    }),
});

impl Effect for FocalTime {
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
        let tau = known(if theta[1] == 0.0 { context.image.tau } else { context.image.tau_order })?;
        hand_on(Stage::Interior, input, out);
        out[F] += theta[0] * tau;
        if let Some(matrix) = d_input {
            fill_identity(Stage::Interior, matrix);
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            matrix[0] = tau;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ImageContext, laws};
    use super::*;

    #[test]
    fn worked_numbers() {
        let image = ImageContext { tau: 0.25, tau_order: -0.5, ..Default::default() };
        let mut input = [0.0; Stage::Interior.inputs()];
        input[F] = 5000.0;
        assert_eq!(laws::value(&FocalTime, &image, &input, &[8.0, 0.0])[0], 5002.0);
        assert_eq!(laws::value(&FocalTime, &image, &input, &[-3.0, 1.0])[0], 5001.5);
    }
}
