//! `earth-curvature`: coordinates of a map are used as if they were Cartesian. A map has its heights above a curved
//! surface, and draws what stands high as wide as its foot.
//!
//! ```text
//! (x, y, z) = P from the survey's centre, z above its mean height        Re = 6371000 m
//! S = P + q (-x z / Re, -y z / Re, (x^2 + y^2) / (2 Re))
//! ```
//!
//! `q` without unit: 1 for coordinates of a map used as if Cartesian, 0 where they are Cartesian. `P` is Cartesian, of
//! a point or an antenna, and `S` what the map says of it. `in` says which coordinates are of the map: `both`
//! (default), `control` or `gnss`. Terms beyond are smaller by `x / Re` and `z / Re`.
//!
//! Source: Kraus, Photogrammetry, on the curvature of the Earth; linearised here.
//!
//! Worked numbers, survey's centre (10, 20, 3): P = (1010, 20, 103), q = 1 is at (1009.9843038770, 20, 103.0784806153)
//! in the map; P = (610, 820, -97), q = 0.5 at (610.0047088369, 820.0062784492, -96.9607596923).

use super::common::{acting_in, acts, estimated, hand_on, known_vector, vector};
use super::{Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use std::sync::LazyLock;

/// Mean radius of the Earth, m.
const EARTH_RADIUS_M: f64 = 6_371_000.0;

/// See the [module](self).
pub struct EarthCurvature;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "earth-curvature".into(),
    stage: Stage::Frame,
    kind: Kind::Physical,
    summary:
        "Map coordinates used as if Cartesian: heights count from a curved surface, and what stands high is drawn as \
              wide as its foot."
            .into(),
    formula: "S = P + q (-x z / Re, -y z / Re, (x^2 + y^2) / (2 Re)), P from the survey's centre, Re = 6371000 m"
        .into(),
    parameters: vec![
        estimated("q", "1", Scope::Global, 1.0).within(
            0.0,
            1.2,
            "1 by definition; a fifth for refraction and an unlike radius of the ellipsoid",
        ),
        acting_in(),
    ],
    needs: vec![Need::Vertical],
    confused_with:
        "refraction (kappa = -1 / (2 Re) is nearly the same in flat nadir blocks), a bend of the block from radial \
                    distortion or a focal drift. A block of a kilometre bends by 2 cm only"
            .into(),
    source: "Kraus, Photogrammetry".into(),
    picture: Picture::Surveyed,
    words: Some(Words {
        what: "Heights of a map are above a curved surface, and the images know of no such thing. At a kilometre from \
               the centre that is 8 cm."
            .into(),
        remedy: "Work in a local system of three dimensions, or correct the heights.".into(),
        tell: "the name of the coordinate system in block.toml, and control points over the whole area".into(),
    }),
});

impl Effect for EarthCurvature {
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
        let curvature = if acts { theta[0] / EARTH_RADIUS_M } else { 0.0 };
        let by_curvature = [-p.x * p.z, -p.y * p.z, 0.5 * (p.x * p.x + p.y * p.y)];
        hand_on(Stage::Frame, input, out);
        for (value, slope) in out.iter_mut().zip(by_curvature) {
            *value += curvature * slope;
        }
        if let Some(matrix) = d_input {
            fill_identity(Stage::Frame, matrix);
            for axis in 0..2 {
                matrix[axis * 3 + axis] -= curvature * p.z;
                matrix[axis * 3 + 2] -= curvature * p[axis];
                matrix[2 * 3 + axis] += curvature * p[axis];
            }
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            if acts {
                for (row, slope) in by_curvature.into_iter().enumerate() {
                    matrix[2 * row] = slope / EARTH_RADIUS_M;
                }
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
        for (point, q, expected) in [
            ([1010.0, 20.0, 103.0], 1.0, [1_009.984_303_877_0, 20.0, 103.078_480_615_3]),
            ([610.0, 820.0, -97.0], 0.5, [610.004_708_836_9, 820.006_278_449_2, -96.960_759_692_3]),
        ] {
            for (kind, values_of_in) in [(Point, [0.0, 1.0]), (Antenna, [0.0, 2.0])] {
                for acting_in in values_of_in {
                    let found = surveyed_coordinate(&EarthCurvature, centre, kind, point, &[q, acting_in]);
                    assert_relative_eq!(found.unwrap()[..], expected, epsilon = 1e-10);
                }
            }
        }
    }

    #[test]
    fn acts_where_it_is_told_to() {
        let (centre, point) = ([10.0, 20.0, 3.0], [1010.0, 20.0, 103.0]);
        let at = |kind, acting_in| surveyed_coordinate(&EarthCurvature, centre, kind, point, &[1.0, acting_in]);
        assert_eq!(at(Antenna, 1.0), Ok(point));
        assert_eq!(at(Point, 2.0), Ok(point));
        assert_eq!(at(Point, 3.0), Err(OutsideDomain), "no such name");
    }
}
