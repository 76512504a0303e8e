//! `gnss-lever-arm`: the antenna does not stand in the projection centre.
//!
//! ```text
//! A = C + R^T l        l = (lx, ly, lz), m, in the camera frame (x right, y down, z forward): from camera to antenna
//! ```
//!
//! Source: direct georeferencing, e.g. Cramer, Stallmann, Haala (2000).
//!
//! Worked numbers: `R = 1`, C = (1, 2, 3), l = (0.05, -0.03, 0.1) gives (1.05, 1.97, 3.1); a nadir camera, r = (pi, 0,
//! 0), with an antenna 0.1 m behind it, l = (0, 0, -0.1), gives (1, 2, 3.1): the antenna is above.

use super::common::{add_block, add_column, estimated, vector};
use super::{By, Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use crate::math::rotation::{exp, left_jacobian, skew};
use std::sync::LazyLock;

/// See the [module](self).
pub struct GnssLeverArm;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "gnss-lever-arm".into(),
    stage: Stage::Position,
    kind: Kind::Physical,
    summary: "The antenna stands at a fixed place in the camera frame, not in the projection centre.".into(),
    formula: "antenna = C + R^T l".into(),
    parameters: ["lx", "ly", "lz"]
        .map(|name| {
            estimated(name, "m", Scope::Global, 0.1).up_to(3.0, "from the camera to any place on a small aircraft")
        })
        .to_vec(),
    needs: vec![Need::Gnss],
    confused_with:
        "gnss-delay (when the heading follows the flight: crossing or opposite headings with the camera turned \
                    tell), gnss-shift (when every image has the same attitude)"
            .into(),
    source: "Cramer, Stallmann, Haala 2000, direct georeferencing".into(),
    picture: Picture::Gnss(By::Heading),
    words: Some(Words {
        what:
            "The antenna is not where the camera is. The positions that GNSS gives are those of the antenna, and the \
               offset turns with the aircraft."
                .into(),
        remedy: "Measure the offset between antenna and camera and enter it; else model it.".into(),
        tell: "flight lines in opposite and in crossing directions at different speeds".into(),
    }),
});

impl Effect for GnssLeverArm {
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
        let (r, centre, lever) = (vector(input, 0), vector(input, 3), vector(theta, 0));
        let world_from_cam = exp(&r).transpose();
        out.copy_from_slice((centre + world_from_cam * lever).as_slice());
        if let Some(matrix) = d_input {
            fill_identity(Stage::Position, matrix);
            // R^T exp(-[J dr]x) l = R^T l + R^T [l]x J dr.
            add_block(matrix, 6, 0, 0, &(world_from_cam * skew(&lever) * left_jacobian(&r)));
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            for axis in 0..3 {
                add_column(matrix, 3, 0, axis, &world_from_cam.column(axis).into_owned());
            }
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
        let image = ImageContext::default();
        let level = laws::value(&GnssLeverArm, &image, &[0.0, 0.0, 0.0, 1.0, 2.0, 3.0], &[0.05, -0.03, 0.1]);
        assert_relative_eq!(level.as_slice(), [1.05, 1.97, 3.1].as_slice(), epsilon = 1e-14);
        let pi = std::f64::consts::PI;
        let nadir = laws::value(&GnssLeverArm, &image, &[pi, 0.0, 0.0, 1.0, 2.0, 3.0], &[0.0, 0.0, -0.1]);
        assert_relative_eq!(nadir.as_slice(), [1.0, 2.0, 3.1].as_slice(), epsilon = 1e-14);
    }
}
