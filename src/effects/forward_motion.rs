//! `forward-motion`: the image is the mean over the exposure, half an exposure after the pose that belongs to its time
//! stamp.
//!
//! ```text
//! C' = C + v t_e / 2        t_e exposure time, s; v velocity, world axes, m/s
//! ```
//!
//! The same shift for every point of an image: tie points alone never see it, GNSS or control do.
//!
//! Source: centroid of the motion blur; formula of the catalogue.
//!
//! Worked numbers, v = (0, 5, 0): t_e = 0.004 shifts C by (0, 0.01, 0), t_e = -0.002 by (0, -0.005, 0).

use super::common::{estimated, known_vector};
use super::formula::{Formula, Given, OBSERVED, Sum};
use super::{Context, Descriptor, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words};
use crate::math::Several;
use std::sync::LazyLock;

/// See the [module](self).
pub struct ForwardMotion;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "forward-motion".into(),
    stage: Stage::Exposure,
    kind: Kind::Physical,
    summary: "The image is the mean over the exposure: its projection centre is that of mid-exposure, not of the time \
                    stamp."
        .into(),
    formula: "C += v t_e / 2".into(),
    parameters: vec![estimated("t_e", "s", Scope::Global, 0.004).within(0.0, 0.1, "exposures from a moving platform")],
    needs: vec![Need::Velocity],
    confused_with: "gnss-delay: always (the same columns up to sign, unless control fixes the images)".into(),
    source: "Practice, without a publication: centroid of the motion blur".into(),
    picture: Picture::Row,
    words: Some(Words {
        what: "While the shutter is open the aircraft moves, so that every point is smeared along the motion. The \
               middle of the smear, not its beginning, is what is measured."
            .into(),
        remedy: "Shorten the exposure, or model it; recording the exposure time helps.".into(),
        tell: "images of different exposure times or speeds".into(),
    }),
});

impl Formula for ForwardMotion {
    const STAGE: Stage = Stage::Exposure;

    fn descriptor() -> &'static Descriptor {
        &DESCRIPTOR
    }

    #[inline(always)]
    fn observe(context: &Context<'_>) -> Result<[f64; OBSERVED], OutsideDomain> {
        let half = known_vector(&context.image.velocity)? * 0.5;
        Ok([half.x, half.y, half.z, 0.0, 0.0])
    }

    #[inline(always)]
    fn add<T: Several>(given: &Given<'_, T>, answer: &mut Sum<'_, T>) -> T {
        for axis in 0..3 {
            answer.out(3 + axis, given.observed(axis) * given.theta(0));
            answer.by_theta(3 + axis, 0, given.observed(axis));
        }
        given.constant(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ImageContext, laws};
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn worked_numbers() {
        let image = ImageContext { velocity: Vector3::new(0.0, 5.0, 0.0), ..Default::default() };
        assert_eq!(laws::value(&ForwardMotion, &image, &[0.0; 6], &[0.004])[3..], [0.0, 0.01, 0.0]);
        assert_eq!(laws::value(&ForwardMotion, &image, &[0.0; 6], &[-0.002])[3..], [0.0, -0.005, 0.0]);
    }
}
