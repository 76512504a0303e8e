//! Effects that read the row and the column: the place is that of the prediction, nothing of the measurement is in
//! it, and derivatives follow it.

use crate::adjust::noisy::noisy_half_dike;
use crate::common::{SOLVERS, effect};
use misclosure::adjust::Evaluation;
use misclosure::adjust::agreement::{JACOBIAN_REL, RESIDUAL_PX, jacobian_difference, residual_difference};
use misclosure::effects::{Context, Descriptor, Effect, OutsideDomain, Scope, Stage, fill_identity, find};
use misclosure::model::{Datum, EffectRef, EffectTerm, Model};
use misclosure::problem::Problem;
use std::sync::Arc;

/// Values of [`Placed`] at which the place moves by some hundredths of a pixel from pixel to pixel, many times what a
/// sensor does.
const SIZE: f64 = 0.7;
/// Differences of residuals in their hundreds over a step that moves image points by some hundredths of a pixel.
const DERIVATIVE: f64 = 1e-6;

/// Grows over the sensor, from column to column and from row to row, by waves: an effect whose place is not where its
/// slope was taken first.
struct Placed(Descriptor);

impl Placed {
    fn term(stage: Stage) -> EffectTerm {
        let mut descriptor = find("focal-time").expect("an effect").descriptor().clone();
        descriptor.id = format!("placed-{}", stage.name()).into();
        descriptor.stage = stage;
        descriptor.needs.clear();
        descriptor.parameters.truncate(1);
        descriptor.parameters[0].scope = Scope::Global;
        let effect = EffectRef::Plugin(Arc::new(Self(descriptor)));
        EffectTerm { effect, values: [("a".to_string(), SIZE)].into(), held: Vec::new() }
    }

    /// What one unit adds to each output.
    fn shape(&self, context: &Context<'_>) -> Vec<f64> {
        let (x, y) = (context.column_px / 900.0, context.row_px / 700.0);
        let of = |k: usize| (y + 0.3 * (k as f64 + 1.0) * x).sin();
        let size = |k: usize| match self.0.stage {
            Stage::Exposure if k < 3 => 2e-3,
            Stage::Image => 10.0,
            _ => 0.05,
        };
        (0..self.0.stage.outputs()).map(|k| size(k) * of(k)).collect()
    }
}

impl Effect for Placed {
    fn descriptor(&self) -> &Descriptor {
        &self.0
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
        let (shape, offset) = (self.shape(context), self.0.stage.identity_offset());
        for (k, shape) in shape.iter().enumerate() {
            out[k] = input[offset + k] + theta[0] * shape;
        }
        if let Some(matrix) = d_input {
            fill_identity(self.0.stage, matrix);
        }
        if let Some(matrix) = d_theta {
            matrix.copy_from_slice(&shape);
        }
        Ok(())
    }

    fn reads_place(&self) -> [bool; 2] {
        [true; 2]
    }
}

/// A block with noise and without, under a rolling shutter of a camera that turns (ten times slower than any, so that
/// the row follows visibly), under one that stands still, and under effects of every stage that has a place.
fn problems() -> Vec<Problem> {
    let mut block = noisy_half_dike();
    let model = |effects: Vec<EffectTerm>| Model { datum: Datum::All, effects, ..Model::default() };
    let shutter = || EffectTerm { values: [("t".to_string(), 0.5)].into(), ..effect("rolling-shutter") };
    let image = EffectTerm { values: [("q1".to_string(), 2e-12)].into(), ..effect("decentring-high") };
    let ray = EffectTerm { values: [("kappa".to_string(), 1e-6)].into(), ..effect("refraction") };
    let straight = Problem::new(&block, &model(vec![shutter(), image.clone(), ray.clone()])).expect("a problem");
    for (i, image) in block.images.iter_mut().enumerate() {
        image.angular_velocity = Some(nalgebra::Vector3::new(0.02, -0.03 * (i % 3) as f64, 0.05));
    }
    let every = [Stage::Exposure, Stage::Ray, Stage::Image].map(Placed::term).into_iter();
    let candidate = effect("rolling-shutter");
    let models = [
        vec![shutter(), image.clone(), ray.clone()],
        vec![Placed::term(Stage::Image)],
        vec![candidate, ray, image],
        every.chain([shutter()]).collect(),
    ];
    let turning = models.into_iter().map(|effects| Problem::new(&block, &model(effects)).expect("a problem"));
    [straight].into_iter().chain(turning).collect()
}

fn evaluations(problem: &Problem) -> [Evaluation; 2] {
    SOLVERS.map(|solver| solver.evaluate(problem, &problem.start).expect("an evaluation"))
}

#[test]
fn both_solvers_find_the_same_place_and_derive_by_it() {
    for (number, problem) in problems().iter().enumerate() {
        let [a, b] = evaluations(problem);
        let (residuals, jacobian) = (residual_difference(problem, &a, &b), jacobian_difference(problem, &a, &b).0);
        assert!(residuals < RESIDUAL_PX, "problem {number}: residuals {residuals:e} px");
        assert!(jacobian < JACOBIAN_REL, "problem {number}: Jacobian {jacobian:e}");
    }
}

#[test]
fn what_was_measured_is_in_no_prediction() {
    for (number, problem) in problems().into_iter().enumerate() {
        let before = evaluations(&problem);
        let mut moved = problem.clone();
        let shift = |k: usize| [3.0 + (k % 7) as f64, -40.0 + (k % 11) as f64];
        for (k, observation) in Arc::make_mut(&mut moved.observations).iter_mut().enumerate() {
            (observation.x, observation.y) = (observation.x + shift(k)[0], observation.y + shift(k)[1]);
        }
        for (a, b) in before.iter().zip(&evaluations(&moved)) {
            for (k, observation) in problem.observations.iter().enumerate() {
                for i in 0..2 {
                    let change = (b.residuals[2 * k + i] - a.residuals[2 * k + i]) / observation.inverse_sigma;
                    assert!((change - shift(k)[i]).abs() < RESIDUAL_PX, "problem {number}: {change}");
                }
            }
            let difference = jacobian_difference(&problem, a, b).0;
            assert!(difference < JACOBIAN_REL, "problem {number}: {difference:e}");
        }
    }
}

/// By the parameters of effects and the camera: those of poses and points go the same way.
#[test]
fn derivatives_are_those_of_the_residuals() {
    for (number, problem) in problems().into_iter().enumerate() {
        let layout = problem.layout();
        let free = problem.free();
        for (solver, at) in SOLVERS.into_iter().zip(evaluations(&problem)) {
            let theta = (0..problem.theta.len()).map(|t| (layout.theta(t), problem.theta[t].scale * 1e-3));
            let camera = (0..12).map(|k| (layout.camera(0, k), problem.camera_scales[0][k] * 1e-2));
            for (unknown, step) in theta.chain(camera).filter(|(unknown, _)| free[*unknown]) {
                let residuals = |by: f64| {
                    let mut state = problem.start.clone();
                    match unknown.checked_sub(layout.theta(0)) {
                        Some(t) => state.theta[t] += by,
                        None => state.interiors[0][unknown] += by,
                    }
                    solver.evaluate(&problem, &state).expect("an evaluation").residuals
                };
                let (above, below) = (residuals(step), residuals(-step));
                let derivative = |row: usize| {
                    let entries = at.row_start[row]..at.row_start[row + 1];
                    entries.filter(|k| at.columns[*k] == unknown).map(|k| at.values[k]).sum::<f64>()
                };
                let rows = 2 * problem.observations.len();
                let largest = (0..rows).fold(0.0_f64, |most, row| most.max(derivative(row).abs()));
                for row in 0..rows {
                    let numeric = (above[row] - below[row]) / (2.0 * step);
                    assert!(
                        (numeric - derivative(row)).abs() <= DERIVATIVE * largest.max(1e-3),
                        "problem {number}, {}, row {row}: {} instead of {numeric}",
                        problem.unknown_name(unknown),
                        derivative(row)
                    );
                }
            }
        }
    }
}
