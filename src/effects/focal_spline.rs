//! `focal-spline`: a smooth curve of the focal length over each flight, whatever its cause.
//!
//! ```text
//! f' = f + sum_i a_i B_i(s)        s = t_flight / span_flight, 0 at the first image of the flight, 1 at the last
//! ```
//!
//! `B_i` are the six uniform cubic B-splines over three equal spans of `[0, 1]` (the file `spline.rs`), `a_i` in
//! pixels, one set per flight. A flight of no duration has `s = 0`. Equal coefficients everywhere are a change of f
//! itself: an estimator that holds f free drops that direction. Empirical: it takes the shape away and names no cause.
//!
//! Source: B-splines after de Boor (1978).
//!
//! Worked numbers: f = 5000 and all coefficients 2 gives 5002 at any time (the splines sum to one); a_0 = 6 alone
//! gives 5001 at s = 0.

use super::common::{estimated, hand_on, known};
use super::{Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, fill_identity, spline};
use crate::camera::F;
use std::sync::LazyLock;

/// Coefficients per flight.
const COEFFICIENTS: usize = 6;

/// See the [module](self).
pub struct FocalSpline;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "focal-spline".into(),
    stage: Stage::Interior,
    kind: Kind::Empirical,
    summary: "A smooth curve of the focal length over each flight, without a named cause.".into(),
    formula: "f += sum_i a_i B_i(t_flight / span_flight), uniform cubic B-splines".into(),
    parameters: (0..COEFFICIENTS).map(|i| estimated(format!("a_{i}"), "px", Scope::Flight, 3.0)).collect(),
    needs: vec![Need::Time],
    confused_with: "every focal-* effect: it covers them all and explains none".into(),
    source: "de Boor 1978, A Practical Guide to Splines".into(),
    picture: Picture::Sensor,
    words: None,
});

impl Effect for FocalSpline {
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
        let image = context.image;
        let span = known(image.flight_span_s)?;
        let s = if span == 0.0 { 0.0 } else { known(image.flight_time_s / span)? };
        let (first, weights, _) = spline::weights(s, COEFFICIENTS);
        hand_on(Stage::Interior, input, out);
        out[F] += (0..4).map(|k| theta[first + k] * weights[k]).sum::<f64>();
        if let Some(matrix) = d_input {
            fill_identity(Stage::Interior, matrix);
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            matrix[first..first + 4].copy_from_slice(&weights);
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
        let mut input = [0.0; Stage::Interior.inputs()];
        input[F] = 5000.0;
        for flight_time_s in [0.0, 13.0, 40.0, 77.0, 100.0] {
            let image = ImageContext { flight_time_s, flight_span_s: 100.0, ..Default::default() };
            assert_relative_eq!(laws::value(&FocalSpline, &image, &input, &[2.0; 6])[0], 5002.0, epsilon = 1e-11);
        }
        let image = ImageContext { flight_time_s: 0.0, flight_span_s: 100.0, ..Default::default() };
        assert_eq!(laws::value(&FocalSpline, &image, &input, &[6.0, 0.0, 0.0, 0.0, 0.0, 0.0])[0], 5001.0);
    }
}
