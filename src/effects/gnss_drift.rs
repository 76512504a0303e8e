//! `gnss-drift`: the GNSS positions of each flight are off by a vector that grows with time, as with float ambiguities.
//!
//! ```text
//! A = C + a_k + b_k t        t = time since the first image of flight k, s; a_k (m) and b_k (m/s) per flight, world axes
//! ```
//!
//! Source: shift and drift parameters of GNSS-supported triangulation, Ackermann (1994).
//!
//! Worked numbers, C = (1, 2, 3), a = (0.1, 0, -0.2), b = (0, 0.001, 0): t = 0 gives (1.1, 2, 2.8), t = 100 gives
//! (1.1, 2.1, 2.8).

use super::common::{add_block, estimated, hand_on, known, vector};
use super::{By, Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use nalgebra::Matrix3;
use std::sync::LazyLock;

/// How large they can be, m and m/s, and why.
const SHIFT: (f64, &str) = (110.0, "the geoid is at most 106 m from the ellipsoid (EGM2008)");
const RATE: (f64, &str) = (0.02, "float ambiguities: decimetres over a strip of some ten seconds (Ackermann 1994)");

/// See the [module](self).
pub struct GnssDrift;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "gnss-drift".into(),
    stage: Stage::Position,
    kind: Kind::Physical,
    summary: "The GNSS positions of each flight are off by a shift and a linear drift, as with unresolved ambiguities."
        .into(),
    formula: "antenna = C + a_k + b_k t_flight".into(),
    parameters: [
        ("ax", "m", 0.05, SHIFT),
        ("ay", "m", 0.05, SHIFT),
        ("az", "m", 0.05, SHIFT),
        ("bx", "m/s", 2e-4, RATE),
        ("by", "m/s", 2e-4, RATE),
        ("bz", "m/s", 2e-4, RATE),
    ]
    .map(|(name, unit, typical, (limit, source))| estimated(name, unit, Scope::Flight, typical).up_to(limit, source))
    .to_vec(),
    needs: vec![Need::Time, Need::Gnss],
    confused_with:
        "gnss-shift (its constant part), a bend of the block (corridors flown once need control or crossing \
                    flights)"
            .into(),
    source: "Ackermann 1994, drift parameters of GPS-supported aerial triangulation".into(),
    picture: Picture::Gnss(By::Time),
    words: Some(Words {
        what: "The positions wander steadily during a flight. Positions without corrections, or a weak satellite \
               geometry, do this."
            .into(),
        remedy: "Use differential or kinematic processing; else model it.".into(),
        tell: "control points at both ends of the flight".into(),
    }),
});

impl Effect for GnssDrift {
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
        let time = known(context.image.flight_time_s)?;
        let error = vector(theta, 0) + vector(theta, 3) * time;
        hand_on(Stage::Position, input, out);
        for axis in 0..3 {
            out[axis] += error[axis];
        }
        if let Some(matrix) = d_input {
            fill_identity(Stage::Position, matrix);
        }

        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            add_block(matrix, 6, 0, 0, &Matrix3::identity());
            add_block(matrix, 6, 0, 3, &(Matrix3::identity() * time));
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
        for (flight_time_s, antenna) in [(0.0, [1.1, 2.0, 2.8]), (100.0, [1.1, 2.1, 2.8])] {
            let image = ImageContext { flight_time_s, ..Default::default() };
            let theta = [0.1, 0.0, -0.2, 0.0, 0.001, 0.0];
            let found = laws::value(&GnssDrift, &image, &[0.4, 0.5, 0.6, 1.0, 2.0, 3.0], &theta);
            assert_relative_eq!(found[..], antenna, epsilon = 1e-14);
        }
    }
}
