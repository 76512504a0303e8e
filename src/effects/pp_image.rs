//! `pp-image`: the sensor floats, or the lens is loose, and every image has a principal point of its own.
//!
//! ```text
//! (ppx, ppy)' = (ppx, ppy) + (ax, ay)_i        (dcx, dcy)' = (dcx, dcy) + (ax, ay)_i
//! ax_i, ay_i ~ N(0, s^2), px, two values per image; s is what is reported, estimated as a variance component
//! ```
//!
//! Source: sensor-shift stabilisation; stochastic interior orientation as in photo-variant self-calibration, Moniwa
//! (1981).
//!
//! Worked numbers: pp (2500, 1900), dc (2540, 1950): a = (1, 0.5) gives pp (2501, 1900.5), dc (2541, 1950.5); a =
//! (-0.25, -2) gives pp (2499.75, 1898), dc (2539.75, 1948).

use super::common::{hand_on, random, shift_centres, shift_centres_column};
use super::{By, Context, Descriptor, Effect, Kind, OutsideDomain, Picture, Stage, Words, fill_identity};
use std::sync::LazyLock;

/// See the [module](self).
pub struct PpImage;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "pp-image".into(),
    stage: Stage::Interior,
    kind: Kind::Physical,
    summary: "Principal point and centre of distortion scatter from image to image: a stabilised sensor or a loose \
                    lens."
        .into(),
    formula: "(ppx, ppy) and (dcx, dcy) += e_i, e_i ~ N(0, s^2)".into(),
    parameters: ["ax", "ay"]
        .map(|name| {
            random(name, "px", 1.0, "s").within(0.0, 100.0, "travel of a sensor-shift stabiliser, 0.4 mm at 4 um")
        })
        .to_vec(),
    needs: vec![],
    confused_with:
        "pp-time and pp-flight (ordered in time, where this one scatters), the rotation of the image. It takes up \
                    nearly all of a shift where the ground is flat; relief or oblique images tell"
            .into(),
    source: "Moniwa 1980, photo-variant self-calibration".into(),
    picture: Picture::Shift(By::Order),
    words: Some(Words {
        what: "The optical axis moves from image to image, as with sensor-shift or lens-shift image stabilisation. \
               The principal point then differs from image to image."
            .into(),
        remedy: "Switch the stabilisation off; until then give each image its own principal point.".into(),
        tell: "images with and without stabilisation over the same ground".into(),
    }),
});

impl Effect for PpImage {
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
        shift_centres(out, [theta[0], theta[1]]);
        if let Some(matrix) = d_input {
            fill_identity(Stage::Interior, matrix);
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            for axis in 0..2 {
                shift_centres_column(matrix, 2, axis, axis, 1.0);
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
        let image = ImageContext::default();
        let mut input = [0.0; Stage::Interior.inputs()];
        input[..K1].copy_from_slice(&[5000.0, 2500.0, 1900.0, 2540.0, 1950.0]);
        let shifted = laws::value(&PpImage, &image, &input, &[1.0, 0.5]);
        assert_eq!(shifted[..5], [5000.0, 2501.0, 1900.5, 2541.0, 1950.5]);
        let shifted = laws::value(&PpImage, &image, &input, &[-0.25, -2.0]);
        assert_eq!(shifted[..5], [5000.0, 2499.75, 1898.0, 2539.75, 1948.0]);
    }
}
