//! `gnss-shift`: the GNSS positions lie off by a constant: another datum, another geoid, a wrong antenna height or
//! base station.
//!
//! ```text
//! A = C + t        t = (tx, ty, tz), m, world axes, one for the block
//! ```
//!
//! One shift per flight is `gnss-drift` with its rates held at zero.
//!
//! Source: formula of the catalogue; shift parameters of GNSS-supported triangulation, Ackermann (1994).
//!
//! Worked numbers, C = (1, 2, 3): t = (0.04, -0.02, 0.06) gives (1.04, 1.98, 3.06), t = (0, 0, -1) gives (1, 2, 2).

use super::common::{add_block, estimated, hand_on, vector};
use super::{By, Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use nalgebra::Matrix3;
use std::sync::LazyLock;

/// See the [module](self).
pub struct GnssShift;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "gnss-shift".into(),
    stage: Stage::Position,
    kind: Kind::Physical,
    summary: "All GNSS positions are off by the same vector: datum, geoid, antenna height or base station.".into(),
    formula: "antenna = C + t".into(),
    parameters: ["tx", "ty", "tz"]
        .map(|name| {
            estimated(name, "m", Scope::Global, 0.05).up_to(
                110.0,
                "the geoid is at most 106 m from the ellipsoid (EGM2008); datums and antenna heights differ by less",
            )
        })
        .to_vec(),
    needs: vec![Need::Gnss],
    confused_with:
        "gnss-lever-arm (when every image has the same attitude); without control a shift moves the whole block \
                    and cannot be seen"
            .into(),
    source: "Ackermann 1994, shift parameters of GPS-supported aerial triangulation".into(),
    picture: Picture::Gnss(By::Time),
    words: Some(Words {
        what: "All positions of a flight are off by the same amount. Usually a base station with wrong coordinates or \
               another reference frame."
            .into(),
        remedy: "Check the coordinates of the base and the reference frame.".into(),
        tell: "control points, or a second flight with another base".into(),
    }),
});

impl Effect for GnssShift {
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
        let shift = vector(theta, 0);
        hand_on(Stage::Position, input, out);
        for axis in 0..3 {
            out[axis] += shift[axis];
        }
        if let Some(matrix) = d_input {
            fill_identity(Stage::Position, matrix);
        }

        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            add_block(matrix, 3, 0, 0, &Matrix3::identity());
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
        let input = [0.4, 0.5, 0.6, 1.0, 2.0, 3.0];
        let image = ImageContext::default();
        assert_eq!(laws::value(&GnssShift, &image, &input, &[0.04, -0.02, 0.06]), [1.04, 1.98, 3.06]);
        assert_eq!(laws::value(&GnssShift, &image, &input, &[0.0, 0.0, -1.0]), [1.0, 2.0, 2.0]);
    }
}
