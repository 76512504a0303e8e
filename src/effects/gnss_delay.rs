//! `gnss-delay`: the receiver stamps the exposure late or early, and the antenna position is that of another moment.
//!
//! ```text
//! A = C + v dt        dt, s; positive: the recorded position is that of dt after the exposure; v velocity, world axes, m/s
//! ```
//!
//! Source: formula of the catalogue; trigger delay as in Cramer, Stallmann, Haala (2000).
//!
//! Worked numbers, C = (1, 2, 3), v = (0, 5, 0): dt = 0.02 gives (1, 2.1, 3), dt = -0.01 gives (1, 1.95, 3).

use super::common::{add_column, estimated, hand_on, known_vector};
use super::{By, Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use std::sync::LazyLock;

/// See the [module](self).
pub struct GnssDelay;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "gnss-delay".into(),
    stage: Stage::Position,
    kind: Kind::Physical,
    summary: "The antenna position is that of a moment before or after the exposure.".into(),
    formula: "antenna = C + v dt".into(),
    parameters: vec![
        estimated("dt", "s", Scope::Global, 0.02)
            .up_to(2.0, "a camera's clock or trigger; beyond, whole seconds are counted wrongly"),
    ],
    needs: vec![Need::Velocity, Need::Gnss],
    confused_with:
        "gnss-lever-arm along the track (when the heading follows the flight and the speed is constant), forward- \
                    motion"
            .into(),
    source: "Cramer, Stallmann, Haala 2000, direct georeferencing".into(),
    picture: Picture::Gnss(By::Heading),
    words: Some(Words {
        what:
            "The time of the positions and the time of the exposures differ. Every position is then too far ahead or \
               behind by the distance flown meanwhile."
                .into(),
        remedy: "Use the camera's flash or event signal for the time tag; else model it.".into(),
        tell: "flight lines at different speeds".into(),
    }),
});

impl Effect for GnssDelay {
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
        let velocity = known_vector(&context.image.velocity)?;
        hand_on(Stage::Position, input, out);
        for axis in 0..3 {
            out[axis] += velocity[axis] * theta[0];
        }
        if let Some(matrix) = d_input {
            fill_identity(Stage::Position, matrix);
        }

        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            add_column(matrix, 1, 0, 0, &velocity);
        }
        Ok(())
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
        let input = [0.4, 0.5, 0.6, 1.0, 2.0, 3.0];
        assert_eq!(laws::value(&GnssDelay, &image, &input, &[0.02]), [1.0, 2.1, 3.0]);
        assert_eq!(laws::value(&GnssDelay, &image, &input, &[-0.01]), [1.0, 1.95, 3.0]);
    }
}
