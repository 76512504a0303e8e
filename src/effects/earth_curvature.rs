//! `earth-curvature`: coordinates of a map were used as if they were Cartesian; the true surface falls away from the
//! tangent plane.
//!
//! ```text
//! P_z' = P_z - q D^2 / (2 Re)        D horizontal distance from the block's centre, Re = 6371000 m
//! ```
//!
//! `q` without unit: 1 for coordinates of a map used as if Cartesian, 0 where they are Cartesian. The block's centre
//! is the mean of the projection centres' start values, a constant.
//!
//! Source: Kraus, Photogrammetry; formula of the catalogue.
//!
//! Worked numbers, block's centre (0, 0, 50): P = (1000, 0, 5), q = 1 is at height 4.9215193847; P = (600, 800, 0), q
//! = 0.5 is at -0.0392403077.

use super::common::{estimated, hand_on, known};
use super::{Context, Descriptor, Effect, Kind, OutsideDomain, Scope, Stage, fill_identity};
use std::sync::LazyLock;

/// Mean radius of the Earth, m.
const EARTH_RADIUS_M: f64 = 6_371_000.0;

/// See the [module](self).
pub struct EarthCurvature;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "earth-curvature".into(),
    stage: Stage::Ray,
    kind: Kind::Physical,
    summary: "Map coordinates used as if Cartesian: the true surface falls away from the tangent plane.".into(),
    formula: "P_z -= q D^2 / (2 Re), Re = 6371000 m".into(),
    parameters: vec![estimated("q", "1", Scope::Global, 1.0)],
    needs: vec![],
    confused_with:
        "a bend of the block from radial distortion or a focal drift; a block of a kilometre bends by 2 cm only".into(),
    source: "Kraus, Photogrammetry".into(),
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
        let centre = context.block.centre;
        let d = [known(input[6] - centre.x)?, known(input[7] - centre.y)?];
        let drop = (d[0] * d[0] + d[1] * d[1]) / (2.0 * EARTH_RADIUS_M);
        hand_on(Stage::Ray, input, out);
        out[2] -= theta[0] * drop;
        if let Some(matrix) = d_input {
            fill_identity(Stage::Ray, matrix);
            for axis in 0..2 {
                matrix[2 * 9 + 6 + axis] -= theta[0] * d[axis] / EARTH_RADIUS_M;
            }
        }
        if let Some(matrix) = d_theta {
            matrix.copy_from_slice(&[0.0, 0.0, -drop]);
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
        for (point, q, height) in
            [([1000.0, 0.0, 5.0], 1.0, 4.921_519_384_7), ([600.0, 800.0, 0.0], 0.5, -0.039_240_307_7)]
        {
            let input = [0.0, 0.0, 0.0, 10.0, 20.0, 50.0, point[0], point[1], point[2]];
            let found = laws::value(&EarthCurvature, &ImageContext::default(), &input, &[q]);
            assert_relative_eq!(found[..], [point[0], point[1], height], epsilon = 1e-10);
        }
    }
}
