//! `focal-image`: the autofocus hunts, and every image has a focal length of its own.
//!
//! ```text
//! f' = f + a_i        a_i ~ N(0, s^2), px, one value per image; s is what is reported, estimated as a variance component
//! ```
//!
//! Source: autofocus hunting; stochastic interior orientation as in photo-variant self-calibration, Moniwa (1981).
//!
//! Worked numbers: f = 5000 with a = 1.5 gives 5001.5, with a = -0.25 gives 4999.75.

use super::common::{hand_on, random};
use super::{By, Context, Descriptor, Effect, Kind, OutsideDomain, Picture, Stage, Words, fill_identity};
use crate::camera::F;
use std::sync::LazyLock;

/// See the [module](self).
pub struct FocalImage;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "focal-image".into(),
    stage: Stage::Interior,
    kind: Kind::Physical,
    summary: "The focal length scatters from image to image: the autofocus hunts.".into(),
    formula: "f += a_i, a_i ~ N(0, s^2)".into(),
    parameters: vec![random("a", "px", 1.0, "s").within(
        0.0,
        20.0,
        "depth of focus at f/8 and a pixel's blur: 2 N pixels, 16 px",
    )],
    needs: vec![],
    confused_with: "focal-time, focal-flight and focal-spline (ordered in time, where this one scatters), pp-image"
        .into(),
    source: "Moniwa 1980, photo-variant self-calibration".into(),
    picture: Picture::Scale(By::Order),
    words: Some(Words {
        what:
            "The focal length jumps from image to image. That is what autofocus, a loose lens or image stabilisation \
               does."
                .into(),
        remedy: "Switch autofocus and stabilisation off and fix the lens; until then give each image its own focal \
                 length."
            .into(),
        tell: "GNSS positions of good height, which hold the distance to the ground".into(),
    }),
});

impl Effect for FocalImage {
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
        hand_on(Stage::Interior, input, out);
        out[F] += theta[0];
        if let Some(matrix) = d_input {
            fill_identity(Stage::Interior, matrix);
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            matrix[0] = 1.0;
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
        let mut input = [0.0; Stage::Interior.inputs()];
        input[F] = 5000.0;
        for (a, f) in [(1.5, 5001.5), (-0.25, 4999.75)] {
            assert_eq!(laws::value(&FocalImage, &ImageContext::default(), &input, &[a])[0], f);
        }
    }
}
