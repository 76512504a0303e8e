//! `pp-flight`: the lens was refitted between flights, and sits elsewhere.
//!
//! ```text
//! (ppx, ppy)' = (ppx, ppy) + (ax, ay)_k        (dcx, dcy)' = (dcx, dcy) + (ax, ay)_k        px, first flight 0
//! ```
//!
//! Source: formula of the catalogue; a lens taken off and fitted again.
//!
//! Worked numbers: pp (2500, 1900), dc (2540, 1950): a = (2, -1) gives pp (2502, 1899), dc (2542, 1949); a = (-0.5,
//! 0.25) gives pp (2499.5, 1900.25), dc (2539.5, 1950.25).

use super::common::{estimated, hand_on, shift_centres, shift_centres_column};
use super::{By, Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use std::sync::LazyLock;

/// See the [module](self).
pub struct PpFlight;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "pp-flight".into(),
    stage: Stage::Interior,
    kind: Kind::Physical,
    summary: "Principal point and centre of distortion differ from flight to flight: the lens was refitted.".into(),
    formula: "(ppx, ppy) and (dcx, dcy) += (ax, ay)_k, first flight 0".into(),
    parameters: ["ax", "ay"]
        .map(|name| {
            estimated(name, "px", Scope::FlightButFirst, 3.0).up_to(50.0, "play of a lens mount, 0.2 mm at 4 um")
        })
        .to_vec(),
    needs: vec![Need::Flights],
    confused_with: "pp-time (a slope within the flights instead of a step between them)".into(),
    source: "Practice, without a publication: lens refitted between flights".into(),
    picture: Picture::Shift(By::Order),
    words: Some(Words {
        what: "The principal point differs from flight to flight, because the lens moved against the sensor. \
               Somebody took the lens off, or knocked the camera, in between."
            .into(),
        remedy: "Do not touch the lens between flights; calibrate each flight by itself.".into(),
        tell: "flights that overlap, with turned images".into(),
    }),
});

impl Effect for PpFlight {
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
        let shifted = laws::value(&PpFlight, &image, &input, &[2.0, -1.0]);
        assert_eq!(shifted[..5], [5000.0, 2502.0, 1899.0, 2542.0, 1949.0]);
        let shifted = laws::value(&PpFlight, &image, &input, &[-0.5, 0.25]);
        assert_eq!(shifted[..5], [5000.0, 2499.5, 1900.25, 2539.5, 1950.25]);
    }
}
