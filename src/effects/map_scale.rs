//! `map-scale`: horizontal coordinates carry the scale of a map projection (or of reductions to sea level), heights do
//! not.
//!
//! ```text
//! (x, y) = P from the survey's centre        S = P + m (x, y, 0)
//! ```
//!
//! `m` without unit: the projection's point scale less one (-4e-4 for UTM on its central meridian), and `-h / Re` of
//! coordinates taken at the height `h` and drawn at sea level. `P` is Cartesian, of a point or an antenna, and `S` what
//! the map says of it. `in` says which coordinates are of the map: `both` (default), `control` or `gnss`. Where all
//! are, heights alone tell `m` from the scale of the block.
//!
//! Source: Ressl (2002), influence of map projections on direct georeferencing.
//!
//! Worked numbers, survey's centre (10, 20, 3), m = 4e-4: P = (110, -80, 5) is surveyed as (110.04, -80.04, 5); P =
//! (10, 20, 0) as itself.

use super::common::{acting_in, acts, estimated, hand_on, known_vector, vector};
use super::{Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use std::sync::LazyLock;

/// See the [module](self).
pub struct MapScale;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "map-scale".into(),
    stage: Stage::Frame,
    kind: Kind::Physical,
    summary: "Horizontal coordinates carry the scale of a map projection, heights do not.".into(),
    formula: "S = P + m (x, y, 0), P from the survey's centre".into(),
    parameters: vec![
        estimated("m", "1", Scope::Global, 4e-4)
            .up_to(3e-3, "UTM within its zone -4e-4 to 1e-3; sea level seen from 10 km -1.6e-3 (Ressl 2002)"),
        acting_in(),
    ],
    needs: vec![Need::Vertical],
    confused_with:
        "the scale of the block (where neither heights nor other coordinates fix that), earth-curvature, gnss-shift"
            .into(),
    source: "Ressl 2002".into(),
    picture: Picture::Surveyed,
    words: Some(Words {
        what:
            "Coordinates of a map are not distances on the ground. The projection and the height change the scale by \
               some tenths of a part in a thousand. The block is measured in true lengths."
                .into(),
        remedy: "Work in a local system, or reduce the coordinates before the adjustment.".into(),
        tell: "the name of the coordinate system in block.toml".into(),
    }),
});

impl Effect for MapScale {
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
        let p = known_vector(&(vector(input, 0) - context.block.survey_centre))?;
        let acts = acts(context, theta[1])?;
        let m = if acts { theta[0] } else { 0.0 };
        hand_on(Stage::Frame, input, out);
        for axis in 0..2 {
            out[axis] += m * p[axis];
        }
        if let Some(matrix) = d_input {
            fill_identity(Stage::Frame, matrix);
            for axis in 0..2 {
                matrix[axis * 3 + axis] += m;
            }
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            if acts {
                (matrix[0], matrix[2]) = (p.x, p.y);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::SurveyedKind::{Antenna, Point};
    use super::*;
    use crate::effects::common::surveyed_coordinate;
    use approx::assert_relative_eq;

    #[test]
    fn worked_numbers() {
        let centre = [10.0, 20.0, 3.0];
        for (point, expected) in [([110.0, -80.0, 5.0], [110.04, -80.04, 5.0]), ([10.0, 20.0, 0.0], [10.0, 20.0, 0.0])]
        {
            for (kind, other) in [(Point, 2.0), (Antenna, 1.0)] {
                let at = |acting_in| surveyed_coordinate(&MapScale, centre, kind, point, &[4e-4, acting_in]).unwrap();
                assert_relative_eq!(at(0.0)[..], expected, epsilon = 1e-13);
                assert_relative_eq!(at(3.0 - other)[..], expected, epsilon = 1e-13);
                assert_eq!(at(other), point);
            }
        }
    }
}
