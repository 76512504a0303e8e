//! Derivatives of an effect from its values alone: what the native solver uses of effects that have one derivation.
//!
//! A five-point formula of what the effect adds to the identity, so that the null law holds exactly.

use super::*;
use crate::camera;
use std::f64::consts::PI;

/// Step of the numerical derivatives, as a share of the sizes in [`input_sizes`]: a five-point formula loses 1e-12 of
/// its order and 1e-13 / 1e-3 by rounding.
const STEP: f64 = 1e-3;

/// Change of a value, as a share of it, that leaves a derivative eleven digits.
const VISIBLE: f64 = 1e-5;
/// Steps grow by this, so many times at most.
const GROWTH: f64 = 10.0;
/// See [`GROWTH`].
const MOST_DECADES: usize = 7;

/// Sizes over which effects change: rotation, rad; positions, m; image coordinates, px.
const ANGLE: f64 = 1.0;
const POSITION_M: f64 = 100.0;
const IMAGE_PX: f64 = 300.0;

/// Step along the place of a measurement, px: whatever changes over the rows of a sensor repeats over a hundred of them
/// or more, of which the five-point formula loses 1e-6, and a step of one part in ten million of a centre's coordinates
/// shows nine digits.
const PLACE_STEP_PX: f64 = 2.0;

/// Where the image size is not known.
const HALF_DIAGONAL_PX: f64 = 3000.0;

/// Derivatives by the input (`matrix`, m x n) of an effect of `descriptor` with values `values`, which gives `out`
/// there.
pub(super) fn by_input(
    descriptor: &Descriptor,
    context: &Context<'_>,
    values: Values<'_>,
    input: &[f64],
    out: &[f64],
    matrix: &mut [f64],
) -> Result<(), OutsideDomain> {
    let (stage, n) = (descriptor.stage, input.len());
    let (m, offset) = (stage.outputs(), stage.identity_offset());
    // Only what the effect adds to the identity is differentiated numerically.
    let values = near(stage, values, out);
    let added = |x: &[f64], out: &mut [f64]| {
        values(x, out)?;
        out.iter_mut().zip(&x[offset..]).for_each(|(out, x)| *out -= x);
        Ok(())
    };
    let sizes = input_sizes(stage, context);
    for k in 0..n {
        differentiate(&added, input, k, STEP * sizes[k], m, matrix)?;
    }
    for i in 0..m {
        matrix[i * n + offset + i] += 1.0;
    }
    Ok(())
}

/// Derivatives by the parameters (`matrix`, m x p); columns of given ones are zero.
pub(super) fn by_theta(
    descriptor: &Descriptor,
    values: Values<'_>,
    theta: &[f64],
    out: &[f64],
    matrix: &mut [f64],
) -> Result<(), OutsideDomain> {
    let stage = descriptor.stage;
    let values = &near(stage, values, out);
    matrix.fill(0.0);
    for (k, parameter) in descriptor.parameters.iter().enumerate() {
        if matches!(parameter.role, Role::Given(_)) {
            continue;
        }
        let mut step = STEP * parameter.typical.abs().max(theta[k].abs());
        if !matches!(parameter.role, Role::Searched(_)) {
            step = visible_step(values, theta, k, step, stage.outputs(), together(stage));
        }
        differentiate(values, theta, k, step, stage.outputs(), matrix)?;
    }
    Ok(())
}

/// Derivatives (m) of what `values` gives at a `place` by its column (`axis` 0) or row (1).
pub(super) fn by_place(
    descriptor: &Descriptor,
    values: Values<'_>,
    place: [f64; 2],
    axis: usize,
    derivative: &mut [f64],
) -> Result<(), OutsideDomain> {
    let m = derivative.len();
    let mut out = vec![0.0; m];
    values(&place, &mut out)?;
    let mut matrix = vec![0.0; m * place.len()];
    differentiate(&near(descriptor.stage, values, &out), &place, axis, PLACE_STEP_PX, m, &mut matrix)?;
    for (i, to) in derivative.iter_mut().enumerate() {
        *to = matrix[i * place.len() + axis];
    }
    Ok(())
}

/// `values`, a rotation vector among them that which is near the one in `out`: at half a turn, where every camera that
/// looks straight down is, two vectors stand for nearly the same rotation, and an effect may give either.
fn near<'a>(
    stage: Stage,
    values: Values<'a>,
    out: &'a [f64],
) -> impl Fn(&[f64], &mut [f64]) -> Result<(), OutsideDomain> + 'a {
    move |x, at| {
        values(x, at)?;
        if stage == Stage::Exposure {
            let apart = at.iter().zip(out).take(3).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            let angle = at[..3].iter().map(|r| r * r).sum::<f64>().sqrt();
            if apart > PI {
                at[..3].iter_mut().for_each(|r| *r *= 1.0 - 2.0 * PI / angle);
            }
        }
        Ok(())
    }
}

/// Sizes over which effects of `stage` change, by input.
fn input_sizes(stage: Stage, context: &Context<'_>) -> Vec<f64> {
    let diagonal = 0.5 * context.image.width_px.hypot(context.image.height_px);
    let h = if diagonal.is_finite() { diagonal } else { HALF_DIAGONAL_PX };
    // Coefficients by what moves a point at the sensor's edge by as much as an image coordinate's size.
    let mut interior = [IMAGE_PX; camera::PARAMETER_COUNT];
    for (k, power) in [(5, -3), (6, -5), (7, -7), (8, -2), (9, -2), (10, -1), (11, -1)] {
        interior[k] *= h.powi(power);
    }
    let (angles, position, image) = ([ANGLE; 3], [POSITION_M; 3], [IMAGE_PX; 2]);
    match stage {
        Stage::Exposure | Stage::Position => [angles, position].concat(),
        Stage::Ray => [angles, position, position].concat(),
        Stage::Interior => [&interior[..], &angles].concat(),
        Stage::Image => [&image[..], &interior].concat(),
        Stage::Control | Stage::Frame => position.to_vec(),
    }
}

/// Values of an effect as a function of its input or of its parameters.
pub(super) type Values<'a> = &'a dyn Fn(&[f64], &mut [f64]) -> Result<(), OutsideDomain>;

/// Derivative of `f` (m outputs) by `x[k]`, five-point formula, into column `k` of the row-major `matrix`.
fn differentiate(
    f: Values<'_>,
    x: &[f64],
    k: usize,
    step: f64,
    m: usize,
    matrix: &mut [f64],
) -> Result<(), OutsideDomain> {
    let mut at = x.to_vec();
    let mut out = vec![0.0; m];
    let mut sum = vec![0.0; m];
    for (offset, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
        at[k] = x[k] + offset * step;
        f(&at, &mut out)?;
        for i in 0..m {
            sum[i] += weight * out[i];
        }
    }
    for i in 0..m {
        matrix[i * x.len() + k] = sum[i] / (12.0 * step);
    }
    Ok(())
}

/// Outputs that have one unit and stand together: by the largest of them their rounding is judged.
const fn together(stage: Stage) -> usize {
    match stage {
        Stage::Interior => 1,
        Stage::Image => 2,
        Stage::Exposure | Stage::Ray | Stage::Position | Stage::Control | Stage::Frame => 3,
    }
}

/// A step of parameter `k` that the values show: a value is what it was without the effect and what that adds, and the
/// rounding of the one hides a small other. For parameters in which values are linear, the step may be as large as it
/// takes. `group`: see [`together`].
fn visible_step(f: Values<'_>, x: &[f64], k: usize, step: f64, m: usize, group: usize) -> f64 {
    let changed = |step: f64| -> Result<bool, OutsideDomain> {
        let (mut low, mut high) = (vec![0.0; m], vec![0.0; m]);
        let mut at = x.to_vec();
        at[k] = x[k] - step;
        f(&at, &mut low)?;
        at[k] = x[k] + step;
        f(&at, &mut high)?;
        // A point at x = 2, y = 3000 px that moves by 1e-4 px in both is seen in x, but its y has lost eight digits.
        let largest =
            |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |most: f64, value| most.max(value.abs()));
        let seen = |(a, b): (&[f64], &[f64])| {
            let change = largest(&mut a.iter().zip(b).map(|(a, b)| a - b));
            change > 0.0 && change >= VISIBLE * largest(&mut a.iter().chain(b).copied())
        };
        Ok(low.chunks(group).zip(high.chunks(group)).any(seen))
    };
    let mut larger = step;
    for _ in 0..MOST_DECADES {
        // At the edge of a domain a step stays inside.
        match changed(larger) {
            Ok(true) => return larger,
            Ok(false) if changed(GROWTH * larger).is_ok() => larger *= GROWTH,
            _ => break,
        }
    }
    // What still shows nothing is as good as zero, and a small step would leave its rounding. The last decade may end
    // at the edge of a domain.
    (larger / GROWTH).max(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bend of the sensor, c P_2(x) P_1(y) out of its plane: at the left edge x is small and y is not, and at the
    /// zeros of the polynomials nothing moves. Solvers agree on a column to 1e-9 of its largest entry.
    #[test]
    fn steps_leave_no_rounding_at_edges_and_where_nothing_moves() {
        let scatter = |k: usize, share: f64| (k as f64 * share).fract();
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for k in 0..4000 {
            let x = 5120.0 * scatter(k, 0.754_877_666) * if k % 9 == 0 { 1e-3 } else { 1.0 };
            let y = 3840.0 * scatter(k, 0.569_840_291);
            let (s, t) = (2.0 * x / 5120.0 - 1.0, 2.0 * y / 3840.0 - 1.0);
            let slope = [(x - 2540.0) / 5500.0, (y - 1945.0) / 5500.0].map(|radius| radius * (1.5 * s * s - 0.5) * t);
            let f = |theta: &[f64], out: &mut [f64]| {
                (out[0], out[1]) = (x + slope[0] * theta[0], y + slope[1] * theta[0]);
                Ok(())
            };
            let step = visible_step(&f, &[0.3], 0, STEP * 0.5, 2, together(Stage::Image));
            let mut found = [0.0; 2];
            differentiate(&f, &[0.3], 0, step, 2, &mut found).unwrap();
            for (found, expected) in found.iter().zip(slope) {
                (worst, largest) = (worst.max((found - expected).abs()), largest.max(expected.abs()));
            }
        }
        assert!(worst < 1e-9 * largest, "{:e}", worst / largest);
    }

    /// A camera that looks straight down has half a turn: next to it the vector of the same rotation may be the other
    /// one.
    #[test]
    fn rotations_are_differentiated_at_half_a_turn() {
        let effect = find("rolling-shutter").unwrap();
        let angular_velocity = nalgebra::Vector3::new(0.3, -0.2, 0.1);
        let velocity = nalgebra::Vector3::new(5.0, 1.0, 0.0);
        let image =
            ImageContext { width_px: 5120.0, height_px: 3840.0, velocity, angular_velocity, ..ImageContext::default() };
        let block = BlockContext::default();
        let context = Context { block: &block, image: &image, column_px: 100.0, row_px: 3000.0, surveyed: None };
        let theta = [0.02, 0.1, -0.2, 0.05];
        for heading in 0..12 {
            let (sin, cos) = (0.5 * f64::from(heading)).sin_cos();
            for short in [0.0, 1e-6, 1e-3, 0.1] {
                let angle = PI - short;
                let input = [angle * cos, angle * sin, 0.0, 10.0, 20.0, 60.0];
                let (mut out, mut d_input, mut d_theta) = ([0.0; 6], [0.0; 36], [0.0; 24]);
                effect.eval(&context, &input, &theta, &mut out, Some(&mut d_input), Some(&mut d_theta)).unwrap();
                let (mut by_input_found, mut by_theta_found) = ([0.0; 36], [0.0; 24]);
                let descriptor = effect.descriptor();
                let values = |x: &[f64], at: &mut [f64]| effect.eval(&context, x, &theta, at, None, None);
                by_input(descriptor, &context, &values, &input, &out, &mut by_input_found).unwrap();
                let values = |x: &[f64], at: &mut [f64]| effect.eval(&context, &input, x, at, None, None);
                by_theta(descriptor, &values, &theta, &out, &mut by_theta_found).unwrap();
                let pairs = by_input_found.iter().zip(&d_input).chain(by_theta_found.iter().zip(&d_theta));
                for (found, by_hand) in pairs {
                    assert!((found - by_hand).abs() < 1e-9 * by_hand.abs().max(1.0), "{found} {by_hand} at {input:?}");
                }
            }
        }
    }
}
