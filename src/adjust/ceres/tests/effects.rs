//! Effects through the solver: built-in ones, and such as Rust alone knows, by the call back of the ABI.

use super::recovery::{RECOVERED_SIGMAS, assert_recovered};
use super::*;
use crate::effects::{self, Context, Scope, Stage};
use std::sync::Arc;

/// Effects of exposure and ray stage, as Rust alone knows them, in chains that couple the rotation into every stage.
struct Turning(effects::Descriptor, Stage);

impl effects::Effect for Turning {
    fn descriptor(&self) -> &effects::Descriptor {
        &self.0
    }
    fn eval(
        &self,
        _: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), effects::OutsideDomain> {
        // Linear in its input and in theta: out = identity + theta * A input, A of the entries below.
        let (n, m) = (self.1.inputs(), self.1.outputs());
        let a = |i: usize, k: usize| {
            0.01 * ((3 * i + 5 * k) as f64).sin() * if self.1 == Stage::Interior && i > 4 { 0.0 } else { 1.0 }
        };
        let offset = self.1.identity_offset();
        let mut shift = vec![0.0; m];
        for i in 0..m {
            shift[i] = (0..n).map(|k| a(i, k) * input[k]).sum();
            out[i] = input[offset + i] + theta[0] * shift[i];
        }
        if let Some(d) = d_input {
            effects::fill_identity(self.1, d);
            for i in 0..m {
                for k in 0..n {
                    d[i * n + k] += theta[0] * a(i, k);
                }
            }
        }
        if let Some(d) = d_theta {
            d.copy_from_slice(&shift);
        }
        Ok(())
    }
}

pub(super) fn turning(stage: Stage, scope: Scope) -> EffectRef {
    let mut descriptor = effects::find("focal-time").unwrap().descriptor().clone();
    descriptor.id = format!("turning-{}", stage.name()).into();
    descriptor.stage = stage;
    descriptor.parameters.truncate(1);
    descriptor.parameters[0].scope = scope;
    EffectRef::Plugin(Arc::new(Turning(descriptor, stage)))
}

/// A built-in effect in its Rust derivation that does not look like one.
struct Borrowed(String);

impl effects::Effect for Borrowed {
    fn descriptor(&self) -> &effects::Descriptor {
        effects::find(&self.0).unwrap().descriptor()
    }
    fn reads_place(&self) -> [bool; 2] {
        effects::find(&self.0).unwrap().reads_place()
    }
    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), effects::OutsideDomain> {
        effects::find(&self.0).unwrap().eval(context, input, theta, out, d_input, d_theta)
    }
}

/// Measurements that follow from the problem's own start values, by its own forward formula.
fn make_exact(problem: &mut Problem) -> State {
    let truth = problem.start.clone();
    let residuals = Ceres.evaluate(problem, &truth).expect("evaluates").residuals;
    for (k, observation) in Arc::make_mut(&mut problem.observations).iter_mut().enumerate() {
        observation.x -= residuals[2 * k] / observation.inverse_sigma;
        observation.y -= residuals[2 * k + 1] / observation.inverse_sigma;
    }
    let mut next = 2 * problem.observations.len();
    for observation in problem.control.iter_mut().chain(&mut problem.gnss) {
        for k in 0..3 {
            observation.position[k] -= residuals[next] * observation.sigma[k];
            next += 1;
        }
    }
    truth
}

#[test]
fn effects_of_three_stages_come_back() {
    let (_, mut problem) = problem();
    problem.pose_free = vec![[true; 6]; IMAGES];
    for i in 0..IMAGES {
        observe_image(&mut problem, i);
        observe_point(&mut problem, 9 * i);
    }
    add_effect(&mut problem, builtin("focal-time"), &[3.0, 0.0]);
    add_effect(&mut problem, builtin("local-flaw"), &[2.0, 2500.0, 2000.0, 700.0, 1.0]);
    add_effect(&mut problem, builtin("gnss-lever-arm"), &[0.05, -0.03, 0.1]);
    let truth = make_exact(&mut problem);
    disturb(&mut problem, 8);
    for (entry, value) in problem.theta.iter().zip(&mut problem.start.theta) {
        *value += if entry.free { 0.1 * entry.scale } else { 0.0 };
    }
    let solution = solve(&problem).unwrap();
    assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
    // The same through the ABI call back: Rust's own derivation of the same effects.
    let mut problem = problem;
    for instance in &mut problem.effects {
        instance.effect = EffectRef::Plugin(Arc::new(Borrowed(instance.effect.descriptor().id.to_string())));
    }
    let again = solve(&problem).unwrap();
    assert_recovered(&problem, &truth, &again, RECOVERED_SIGMAS);
}
