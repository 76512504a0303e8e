//! `map-scale`: the survey's horizontal coordinates carry the scale of a map projection (or of reductions to sea
//! level), heights do not.
//!
//! ```text
//! S_h = P_h + m (P_h - M_h)        S_z = P_z        M mean of the surveyed coordinates, control and check points alike
//! ```
//!
//! `m` without unit, -4e-4 for UTM on its central meridian. `P` is the true point, `S` what the
//! survey says; M is a constant of the block.
//!
//! Source: Ressl (2002), influence of map projections on direct georeferencing.
//!
//! Worked numbers, M = (10, 20, 3), m = 4e-4: P = (110, -80, 5) is surveyed as (110.04, -80.04, 5); P = (10, 20, 0) as
//! itself.

use super::common::{estimated, hand_on, known};
use super::{Context, Descriptor, Effect, Kind, Need, OutsideDomain, Scope, Stage, fill_identity};
use std::sync::LazyLock;

/// See the [module](self).
pub struct MapScale;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "map-scale".into(),
    stage: Stage::Control,
    kind: Kind::Physical,
    summary: "The survey's horizontal coordinates carry the scale of a map projection.".into(),
    formula: "S = P + m (P_h - mean P_h), horizontal part".into(),
    parameters: vec![estimated("m", "1", Scope::Global, 4e-4)],
    needs: vec![Need::Control, Need::Gnss],
    confused_with: "the scale of the block (when GNSS says nothing about it), gnss-shift".into(),
    source: "Ressl 2002".into(),
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
        let mean = context.block.survey_mean;
        let d = [known(input[0] - mean.x)?, known(input[1] - mean.y)?];
        hand_on(Stage::Control, input, out);
        for axis in 0..2 {
            out[axis] += theta[0] * d[axis];
        }
        if let Some(matrix) = d_input {
            fill_identity(Stage::Control, matrix);
            for axis in 0..2 {
                matrix[axis * 3 + axis] += theta[0];
            }
        }
        if let Some(matrix) = d_theta {
            matrix.copy_from_slice(&[d[0], d[1], 0.0]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{BlockContext, ImageContext};
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::Vector3;

    #[test]
    fn worked_numbers() {
        let block = BlockContext { survey_mean: Vector3::new(10.0, 20.0, 3.0), ..Default::default() };
        let image = ImageContext::default();
        let context = Context { block: &block, image: &image, column_px: f64::NAN, row_px: f64::NAN };
        for (point, surveyed) in [([110.0, -80.0, 5.0], [110.04, -80.04, 5.0]), ([10.0, 20.0, 0.0], [10.0, 20.0, 0.0])]
        {
            let mut out = [0.0; 3];
            MapScale.eval(&context, &point, &[4e-4], &mut out, None, None).unwrap();
            assert_relative_eq!(out[..], surveyed, epsilon = 1e-13);
        }
    }
}
