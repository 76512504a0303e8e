//! `rolling-shutter`: the rows of the sensor are read one after the other while the platform moves and turns.
//!
//! ```text
//! dt = t (y / h - 1/2)        C' = C + (v + dv) dt        R' = exp(-[omega dt]x) R
//! ```
//!
//! `t` in seconds from the top row's reading to the bottom row's (negative: bottom to top), `y` the predicted row, `v`
//! the velocity in world axes, `omega` the angular velocity in camera axes (zero where not measured). The pose is that
//! of the middle row.
//!
//! `dv` is the error of the image's velocity. Velocities that were derived from positions have one, and an effect that
//! multiplies them as if they were exact is estimated too small, with too small a standard deviation; what they are
//! wrong by looks like a principal point that scatters from image to image.
//!
//! Sign of the turn: with `omega` in camera axes a direction b fixed in the camera moves in the world as `d (R^T b)/dt
//! = R^T (omega x b)`, so `d R^T/dt = R^T [omega]x`, `dR/dt = -[omega]x R`, and over dt `R(t + dt) = exp(-[omega dt]x)
//! R(t)`: a camera that turns to the right (omega_y > 0, y down) sees the world turn to the left.
//!
//! Source: Vautherin, Rutishauser, Schneider-Zapp, Choi, Chovancova, Glass, Strecha (2016), photogrammetric accuracy
//! and modeling of rolling shutter cameras.
//!
//! Worked numbers, v = (0, 5, 0), t = 0.02, h = 4000: row 4000 shifts C by (0, 0.05, 0), row 1000 by (0, -0.025, 0);
//! with omega = (0, 0, 0.5) and R = 1, row 4000 has the rotation vector (0, 0, -0.005).

use super::answer::{Answer, Inputs, Thetas, one_by_one};
use super::common::{add_block, add_column, estimated, known, known_vector, vector, velocity_error};
use super::formula::{Formula, Given, OBSERVED, Sum, of_eight, of_one};
use super::{Context, Descriptor, Effect, Kind, Need, OutsideDomain, Picture, Scope, Stage, Words};
use crate::math::Several;
use crate::math::lane::{LANES, Lane};
use crate::math::rotation::{exp, left_jacobian, left_jacobian_inverse, log};
use nalgebra::{Matrix3, Vector3};
use std::sync::LazyLock;

/// Error of a derived velocity, m/s: two positions that are 0.2 m off, 3 s apart.
const TYPICAL_ERROR: f64 = 0.1;
/// Parameters: the readout time and the errors of the velocity.
const PARAMETERS: usize = 4;

/// See the [module](self).
pub struct RollingShutter;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "rolling-shutter".into(),
    stage: Stage::Exposure,
    kind: Kind::Physical,
    summary: "The rows of the sensor are read one after the other while the platform moves (and turns, where the \
                    angular velocity is measured)."
        .into(),
    formula: "C += (v + dv) t (y/h - 1/2), R <- exp(-[omega t (y/h - 1/2)]x) R".into(),
    parameters: vec![
        estimated("t", "s", Scope::Global, 0.02)
            .up_to(0.2, "the slowest sensors take 0.1 s to read (Vautherin et al. 2016)"),
        velocity_error("dvx", TYPICAL_ERROR),
        velocity_error("dvy", TYPICAL_ERROR),
        velocity_error("dvz", TYPICAL_ERROR),
    ],
    needs: vec![Need::Velocity],
    confused_with:
        "forward-motion (the same shift in every row), an error of f or of the affinity when all images fly in \
                    one direction"
            .into(),
    source: "Vautherin et al. 2016".into(),
    picture: Picture::Row,
    words: Some(Words {
        what: "The sensor is read out row by row, and the aircraft flies on meanwhile. Points low in the image are \
               seen from a place some centimetres further on than points high in it."
            .into(),
        remedy: "Model it, fly slower, or use a camera with a mechanical or global shutter.".into(),
        tell: "flight lines at another speed, or flown in the opposite direction".into(),
    }),
});

impl Effect for RollingShutter {
    fn descriptor(&self) -> &Descriptor {
        &DESCRIPTOR
    }

    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        mut d_input: Option<&mut [f64]>,
        mut d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        let turning = known_vector(&context.image.angular_velocity)?;
        let place = place_of_row(context)?;
        of_one::<Movement>(
            context,
            input,
            theta,
            &mut Answer { out: &mut *out, d_input: d_input.as_deref_mut(), d_theta: d_theta.as_deref_mut() },
        )?;
        if turning == Vector3::zeros() {
            return Ok(());
        }
        let turn = turning * -(theta[0] * place);
        let r = vector(input, 0);
        let turned = turn != Vector3::zeros();
        if turned {
            out[..3].copy_from_slice(log(&(exp(&turn) * exp(&r))).as_slice());
        }
        // By the turn of the new rotation, camera axes; where nothing is asked by it, it is dear and not needed.
        let wanted = d_input.is_some() || d_theta.is_some();
        let by_turn = if wanted { left_jacobian_inverse(&vector(out, 0)) } else { Matrix3::zeros() };
        if let (Some(matrix), true) = (d_input, turned) {
            add_block(matrix, 6, 0, 0, &(by_turn * exp(&turn) * left_jacobian(&r) - Matrix3::identity()));
        }
        if let Some(matrix) = d_theta {
            add_column(matrix, PARAMETERS, 0, 0, &(by_turn * turning * -place));
        }
        Ok(())
    }

    fn reads_place(&self) -> [bool; 2] {
        [false, true]
    }

    /// `dt` grows by `t / h` from row to row: `C'` moves by `v` times that, and the new rotation turns by `-omega`
    /// times that, camera axes.
    fn by_place(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        axis: usize,
        derivative: &mut [f64],
    ) -> Result<(), OutsideDomain> {
        let by_row = if axis == 1 { known(theta[0] / context.image.height_px)? } else { 0.0 };
        let (velocity, turning) = (&context.image.velocity, known_vector(&context.image.angular_velocity)?);
        derivative[..3].fill(0.0);
        for k in 0..3 {
            derivative[3 + k] = (velocity[k] + theta[1 + k]) * by_row;
        }
        if by_row != 0.0 && turning != Vector3::zeros() {
            let turned = log(&(exp(&(turning * -(theta[0] * place_of_row(context)?))) * exp(&vector(input, 0))));
            derivative[..3].copy_from_slice((left_jacobian_inverse(&turned) * turning * -by_row).as_slice());
        }
        Ok(())
    }

    fn eval_eight(
        &self,
        contexts: &[Context<'_>; LANES],
        input: &[Lane],
        thetas: &Thetas<'_>,
        answer: &mut Answer<'_, Lane>,
    ) -> Result<Inputs, usize> {
        // Of a camera that turns, too, each has a rotation of its own.
        match contexts.iter().all(|context| context.image.angular_velocity == Vector3::zeros()) {
            true => of_eight::<Movement>(contexts, input, thetas, answer),
            false => one_by_one(self, contexts, input, thetas, answer),
        }
    }
}

/// Place of the row between the middle of the readout and its end, -1/2 to 1/2.
fn place_of_row(context: &Context<'_>) -> Result<f64, OutsideDomain> {
    Ok(known(context.row_px / context.image.height_px)? - 0.5)
}

/// The effect of a camera that does not turn.
struct Movement;

impl Formula for Movement {
    const STAGE: Stage = Stage::Exposure;

    fn descriptor() -> &'static Descriptor {
        &DESCRIPTOR
    }

    #[inline(always)]
    fn observe(context: &Context<'_>) -> Result<[f64; OBSERVED], OutsideDomain> {
        let velocity = &context.image.velocity;
        Ok([velocity.x, velocity.y, velocity.z, context.row_px, context.image.height_px])
    }

    /// Holds where all that was observed is known: otherwise, zero times it is no number.
    #[inline(always)]
    fn add<T: Several>(given: &Given<'_, T>, answer: &mut Sum<'_, T>) -> T {
        let place = given.observed(3) / given.observed(4) - given.constant(0.5);
        let dt = given.theta(0) * place;
        let mut observed = place;
        for axis in 0..3 {
            answer.out(3 + axis, (given.observed(axis) + given.theta(1 + axis)) * dt);
            answer.by_theta(3 + axis, 0, (given.observed(axis) + given.theta(1 + axis)) * place);
            answer.by_theta(3 + axis, 1 + axis, dt);
            observed = observed + given.observed(axis);
        }
        given.constant(1.0) + observed * 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::{BlockContext, ImageContext, laws};
    use super::*;
    use approx::assert_relative_eq;

    fn at(row_px: f64, image: &ImageContext, input: [f64; 6], t: f64) -> [f64; 6] {
        let context = Context { block: &BlockContext::default(), image, column_px: 0.0, row_px, surveyed: None };
        let mut out = [0.0; 6];
        RollingShutter.eval(&context, &input, &[t, 0.0, 0.0, 0.0], &mut out, None, None).unwrap();
        out
    }

    #[test]
    fn worked_numbers() {
        let mut image = ImageContext { height_px: 4000.0, velocity: Vector3::new(0.0, 5.0, 0.0), ..Default::default() };
        let moved = at(4000.0, &image, [0.0; 6], 0.02);
        assert_relative_eq!(moved[..], [0.0, 0.0, 0.0, 0.0, 0.05, 0.0], epsilon = 1e-15);
        let moved = at(1000.0, &image, [0.0; 6], 0.02);
        assert_relative_eq!(moved[..], [0.0, 0.0, 0.0, 0.0, -0.025, 0.0], epsilon = 1e-15);
        image.angular_velocity = Vector3::new(0.0, 0.0, 0.5);
        assert_relative_eq!(at(4000.0, &image, [0.0; 6], 0.02)[..3], [0.0, 0.0, -0.005], epsilon = 1e-15);
    }

    #[test]
    fn a_camera_that_turns_right_sees_the_world_turn_left() {
        let image = ImageContext {
            height_px: 4000.0,
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::new(0.0, 0.5, 0.0),
            ..Default::default()
        };
        let later = at(4000.0, &image, [0.0; 6], 0.02);
        let seen = exp(&vector(&later, 0)) * Vector3::z();
        assert!(seen.x < 0.0, "{seen}");
    }

    #[test]
    fn the_middle_row_has_the_pose() {
        let image = ImageContext { height_px: 4000.0, velocity: Vector3::new(1.0, 2.0, 3.0), ..Default::default() };
        let input = [0.1, 0.2, 0.3, 1.0, 2.0, 3.0];
        assert_eq!(laws::value(&RollingShutter, &image, &input, &[0.5, 0.0, 0.0, 0.0])[..], input);
    }
}
