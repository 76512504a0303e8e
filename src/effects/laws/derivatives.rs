//! The law of derivatives: what is derived by hand against what the values say.

use super::sample::{Evaluation, Sample, evaluate, output};
use super::{Violation, samples, violation};
use crate::camera::{Interior, PARAMETER_COUNT};
use crate::effects::{Descriptor, Effect, IMAGE_INTERIOR, OutsideDomain, Role, Stage};
use crate::math::rotation::{exp, left_jacobian, log};
use nalgebra::Vector3;

/// Largest error of a derivative beside the doubt of the differences, relative to the largest of its column: far above
/// the rounding of the formula, far below any slip of a sign, a factor or a term.
pub const DERIVATIVE_TOLERANCE: f64 = 1e-6;

/// Step of the first difference, as a fraction of the variable's size.
const FIRST_STEP: f64 = 0.1;

/// Derivatives: what the effect adds to the identity's derivatives agrees with extrapolated central differences of
/// what it adds to the identity; columns of given parameters are zero.
pub fn derivatives(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let descriptor = effect.descriptor();
    let stage = descriptor.stage;
    let (n, m) = (stage.inputs(), stage.outputs());
    let turns = rotation_outputs(stage);
    // Whether a variable's column was ever nonzero, and whether the differences ever resolved it.
    let mut seen = vec![(false, false); n + descriptor.parameters.len()];
    for sample in samples(effect, seed) {
        let fail = |detail: String| Err(violation(effect, "derivatives", format!("{detail} at {sample}")));
        let Ok(analytic) = evaluate(effect, &sample) else { return fail("outside the domain".into()) };
        for variable in 0..seen.len() {
            let name = variable_name(descriptor, variable);
            let column = analytic_column(stage, &sample, &analytic, variable);
            if variable >= n && matches!(descriptor.parameters[variable - n].role, Role::Given(_)) {
                if column.iter().any(|value| *value != 0.0) {
                    return fail(format!("the column of the given parameter {name} is not zero"));
                }
                continue;
            }
            let size =
                if variable < n { input_size(stage, variable) } else { descriptor.parameters[variable - n].typical };
            let change = |step: f64| {
                let end = |step: f64| {
                    let mut moved = sample.clone();
                    *(if variable < n { &mut moved.input[variable] } else { &mut moved.theta[variable - n] }) += step;
                    output(effect, &moved).map(|out| (moved.input, out))
                };
                Ok::<_, OutsideDomain>(difference(stage, &end(step)?, &end(-step)?))
            };
            let Some((numeric, doubt)) = extrapolate(change, FIRST_STEP * size.abs(), &analytic.out) else {
                return fail(format!("{name}: the neighbourhood is outside the domain"));
            };
            for group in [0..turns, turns..m] {
                let largest = |values: &[f64]| values[group.clone()].iter().fold(0.0_f64, |most, v| most.max(v.abs()));
                let scale = largest(&column).max(largest(&numeric));
                seen[variable].0 |= largest(&column) > 0.0;
                seen[variable].1 |= largest(&doubt) < 1e-3 * scale;
                for row in group.clone() {
                    let (by_hand, by_differences) = (column[row], numeric[row]);
                    if (by_hand - by_differences).abs() > DERIVATIVE_TOLERANCE * scale + doubt[row] {
                        return fail(format!(
                            "output {row} by {name}: {by_hand:e} by hand, {by_differences:e} by differences"
                        ));
                    }
                }
            }
        }
    }
    match seen.iter().position(|(nonzero, resolved)| *nonzero && !*resolved) {
        Some(variable) => {
            let name = variable_name(descriptor, variable);
            Err(violation(effect, "derivatives", format!("{name}: too small beside rounding to be checked")))
        }
        None => Ok(()),
    }
}

fn variable_name(descriptor: &Descriptor, variable: usize) -> String {
    match variable.checked_sub(descriptor.stage.inputs()) {
        Some(parameter) => descriptor.parameters[parameter].name.to_string(),
        None => format!("input {variable}"),
    }
}

/// A size of an input, in the samples' world: the first difference is taken over a tenth of it.
fn input_size(stage: Stage, variable: usize) -> f64 {
    const INTERIOR: Interior = [1e3, 1e2, 1e2, 1e2, 1e2, 1e-9, 1e-16, 1e-23, 1e-7, 1e-7, 1e-3, 1e-3];
    const ANGLE: f64 = 0.3;
    const LENGTH: f64 = 10.0;
    const PIXELS: f64 = 100.0;
    match (stage, variable) {
        (Stage::Control | Stage::Frame, _) => LENGTH,
        (Stage::Interior, PARAMETER_COUNT..) => ANGLE,
        (Stage::Interior, _) => INTERIOR[variable],
        (Stage::Image, 0..2) => PIXELS,
        (Stage::Image, _) => INTERIOR[variable - IMAGE_INTERIOR],
        (_, 0..3) => ANGLE,
        _ => LENGTH,
    }
}

/// How many outputs, from the first, are a rotation.
fn rotation_outputs(stage: Stage) -> usize {
    if stage == Stage::Exposure { 3 } else { 0 }
}

/// A column of the derivatives without the identity's part; turns of the exposure stage as turns, with the identity's.
fn analytic_column(stage: Stage, sample: &Sample, analytic: &Evaluation, variable: usize) -> Vec<f64> {
    let (n, m, p) = (stage.inputs(), stage.outputs(), sample.theta.len());
    let mut column: Vec<f64> = match variable.checked_sub(n) {
        None => (0..m).map(|row| analytic.d_input[row * n + variable]).collect(),
        Some(parameter) => (0..m).map(|row| analytic.d_theta[row * p + parameter]).collect(),
    };
    let turns = rotation_outputs(stage);
    if let Some(row) = variable.checked_sub(stage.identity_offset())
        && (turns..m).contains(&row)
    {
        column[row] -= 1.0;
    }
    if turns == 3 {
        let turn =
            left_jacobian(&Vector3::from_column_slice(&analytic.out[..3])) * Vector3::from_column_slice(&column[..3]);
        column[..3].copy_from_slice(turn.as_slice());
    }
    column
}

/// What the effect adds at one end less what it adds at the other; each end is input and output. The rotation of the
/// exposure stage as the turn from one output to the other: near half a turn two rotation vectors stand for nearly the
/// same rotation.
fn difference(stage: Stage, plus: &(Vec<f64>, Vec<f64>), minus: &(Vec<f64>, Vec<f64>)) -> Vec<f64> {
    let offset = stage.identity_offset();
    let added = |end: &(Vec<f64>, Vec<f64>), row: usize| end.1[row] - end.0[offset + row];
    let mut change: Vec<f64> = (0..stage.outputs()).map(|row| added(plus, row) - added(minus, row)).collect();
    if rotation_outputs(stage) == 3 {
        let rotation = |end: &(Vec<f64>, Vec<f64>)| exp(&Vector3::from_column_slice(&end.1[..3]));
        change[..3].copy_from_slice(log(&(rotation(plus) * rotation(minus).transpose())).as_slice());
    }
    change
}

/// Derivative from central differences over `first`, `first / 2`, ..., extrapolated to step zero (Ridders 1982), and
/// how far it may be off: ten times the method's own estimate, and the rounding of the outputs. `None` if fewer than
/// four steps stay in the domain.
fn extrapolate(
    change: impl Fn(f64) -> Result<Vec<f64>, OutsideDomain>,
    first: f64,
    out: &[f64],
) -> Option<(Vec<f64>, Vec<f64>)> {
    const STEPS: i32 = 10;
    let m = out.len();
    let steps = (0..STEPS).map(|halvings| first / 2.0_f64.powi(halvings));
    let differences: Vec<(f64, Vec<f64>)> = steps.filter_map(|step| Some((step, change(step).ok()?))).collect();
    if differences.len() < 4 {
        return None;
    }
    let (mut best, mut doubt) = (vec![f64::NAN; m], vec![f64::INFINITY; m]);
    for row in 0..m {
        let mut previous: Vec<f64> = Vec::new();
        for (step, change) in &differences {
            let rounding = 4.0 * f64::EPSILON * out[row].abs().max(1e-3 * step) / step;
            let mut level = vec![change[row] / (2.0 * step)];
            let mut factor = 4.0;
            for column in 0..previous.len() {
                let better = (factor * level[column] - previous[column]) / (factor - 1.0);
                let off = (better - level[column]).abs().max((better - previous[column]).abs());
                if 10.0 * off + rounding < doubt[row] {
                    (best[row], doubt[row]) = (better, 10.0 * off + rounding);
                }
                level.push(better);
                factor *= 4.0;
            }
            previous = level;
        }
    }
    Some((best, doubt))
}
