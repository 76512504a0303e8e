//! `focal-flight`: the lens was refocused, or switched on anew, between flights.
//!
//! ```text
//! f' = f + a_k        one value per flight k, px; the first flight's is zero, it defines f
//! ```
//!
//! Source: a refocus between flights is the classical reason for calibrating flight by flight; formula of the
//! catalogue.
//!
//! Worked numbers: f = 5000 with a = 5 gives 5005, with a = -4 gives 4996.

use super::common::{estimated, hand_on};
use super::{By, Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use crate::camera::F;
use std::sync::LazyLock;

/// See the [module](self).
pub struct FocalFlight;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "focal-flight".into(),
    stage: Stage::Interior,
    kind: Kind::Physical,
    summary: "The focal length differs from flight to flight: the lens was refocused, or settled again.".into(),
    formula: "f += a_k, first flight 0".into(),
    parameters: vec![
        estimated("a", "px", Scope::FlightButFirst, 3.0)
            .up_to(100.0, "from infinity to 20 m a lens of 35 mm moves 61 um (f^2 / distance), 15 px; six times that"),
    ],
    needs: vec![Need::Flights],
    confused_with: "focal-time (a slope within the flights instead of a step between them), focal-temperature".into(),
    source: "Practice, without a publication: refocus between flights".into(),
    picture: Picture::Scale(By::Order),
    words: Some(Words {
        what:
            "The focal length differs from flight to flight. Between flights the camera was switched off, refocused or \
               cooled down."
                .into(),
        remedy: "Lock the focus for all flights, or calibrate each flight by itself.".into(),
        tell: "flights that overlap, and cross flights at another height".into(),
    }),
});

impl Effect for FocalFlight {
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
        for (a, f) in [(5.0, 5005.0), (-4.0, 4996.0)] {
            assert_eq!(laws::value(&FocalFlight, &ImageContext::default(), &input, &[a])[0], f);
        }
    }
}
