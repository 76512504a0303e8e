//! A quick fit: by the native solver alone, as exact as decisions need.

use super::{RunError, pinned};
use crate::adjust::native::Native;
use crate::adjust::{AdjustError, CovarianceOf, Options, Solution, Solver};
use crate::block::Block;
use crate::effects::Need;
use crate::model::Model;
use crate::null_model::SharedBase;
use crate::problem::{Problem, State};
use std::collections::BTreeSet;
use std::ops::ControlFlow;

/// A model fitted to a block.
#[derive(Clone)]
pub struct Fit {
    /// The model.
    pub model: Model,
    /// Its problem.
    pub problem: Problem,
    /// Its solution.
    pub solution: Solution,
    /// What its null models have in common.
    pub null_base: SharedBase,
}

impl Fit {
    /// A fit that nothing was asked of yet.
    pub fn new(model: Model, problem: Problem, solution: Solution) -> Self {
        Self { model, problem, solution, null_base: SharedBase::default() }
    }

    /// Problem and solution, for an adjustment that starts near.
    pub fn solved(&self) -> (&Problem, &State) {
        (&self.problem, &self.solution.state)
    }

    /// `v'Pv`, priors of random values included.
    pub fn chi_square(&self) -> f64 {
        2.0 * self.solution.cost
    }
}

/// Change of chi-square at which a quick fit stops: parameters are then known to a tenth of their sigma, and what is
/// left of the gradient the null model takes out of every score. The model that is handed on is solved to the last
/// digit, by both solvers.
const CHI_SQUARE_CHANGE: f64 = 1e-2;

/// Steps that gain less than this after which such a fit ends: what they promise together is a tenth of a unit, where
/// decisions take a dozen.
const IDLE_STEPS: usize = 4;

/// Iterations of a fit that starts near its solution, at the most: four to six are usual.
pub const FEW_ITERATIONS: usize = 10;

/// Options of a fit that decides.
fn deciding(options: &Options) -> Options {
    Options {
        chi_square_change: options.chi_square_change.max(CHI_SQUARE_CHANGE),
        idle_steps: Some(IDLE_STEPS),
        covariance: CovarianceOf::Nothing,
        ..options.clone()
    }
}

/// Fits with the native solver.
///
/// `near`: an earlier fit of the same images, to start from; another model's solution is nearer than the block's
/// approximations.
pub fn fit(block: &Block, model: &Model, near: Option<&Fit>, options: &Options) -> Result<Fit, RunError> {
    let without_motion = match near {
        Some(_) => None,
        None => fit_without_motion(block, model, options)?,
    };
    let problem = Problem::near(block, model, near.or(without_motion.as_ref()).map(Fit::solved))?;
    Ok(solve(model, problem, options)?)
}

/// A fit of `block` without the effects of `model` that need velocities. Where a block lacks them they come from its
/// adjusted projection centres: positions of a file are off by up to half a metre, and their velocities by per cents.
/// `None` where velocities are measured, where no effect needs them, or where there is no such fit: then the positions
/// of the block give them.
///
/// # Errors
/// A wish to stop.
pub fn fit_without_motion(block: &Block, model: &Model, options: &Options) -> Result<Option<Fit>, RunError> {
    if block.images.iter().all(|image| image.velocity.is_some()) {
        return Ok(None);
    }
    let mut without = model.clone();
    without.effects.retain(|term| !term.effect.descriptor().needs.contains(&Need::Velocity));
    if without.effects.len() == model.effects.len() {
        return Ok(None);
    }
    match fit(block, &without, None, options) {
        Ok(fit) => Ok(Some(fit)),
        Err(error) if options.stop.is_raised() => Err(error),
        Err(_) => Ok(None),
    }
}

/// Fits a problem from its start values.
///
/// A searched parameter (a place on the sensor, a width, a lag) that leaves the domain of its search describes another
/// shape than the one that was found there (a flaw wider than the sensor is a distortion of the lens), one that a
/// single measurement holds says nothing of the others, and one that the measurements do not determine ends the fit: in
/// each case the searched parameters of that effect are held where they started.
pub fn solve(model: &Model, problem: Problem, options: &Options) -> Result<Fit, AdjustError> {
    let solved = solve_as_it_is(&problem, options);
    let lost = match &solved {
        Ok(solution) => {
            let mut lost = lost_effects(&problem, &solution.state.theta);
            lost.append(&mut pinned::effects(&problem, &solution.state, options.threads)?);
            lost
        }
        Err(_) => problem.searched().iter().map(|t| problem.theta[*t].effect).collect(),
    };
    if lost.is_empty() {
        return Ok(Fit::new(model.clone(), problem, solved?));
    }
    let (held_model, held) = hold_search(model, &problem, &lost);
    match (solve_as_it_is(&held, options), solved) {
        (Ok(solution), _) => Ok(Fit::new(held_model, held, solution)),
        (Err(_), solved) => Ok(Fit::new(model.clone(), problem, solved?)),
    }
}

fn solve_as_it_is(problem: &Problem, options: &Options) -> Result<Solution, AdjustError> {
    Native.solve(problem, &deciding(options), &mut |_| ControlFlow::Continue(()))
}

/// Effects of which a searched parameter left its domain.
fn lost_effects(problem: &Problem, theta: &[f64]) -> BTreeSet<u32> {
    let left = |t: &usize| {
        let inside = |value: f64| problem.searched_bounds(*t).is_none_or(|(low, high)| (low..=high).contains(&value));
        // Whoever starts one outside wants it there.
        inside(problem.start.theta[*t]) && !inside(theta[*t])
    };
    problem.searched().iter().filter(|t| left(t)).map(|t| problem.theta[*t].effect).collect()
}

/// Model and problem with the searched parameters of some effects held at their start values.
fn hold_search(model: &Model, problem: &Problem, effects: &BTreeSet<u32>) -> (Model, Problem) {
    let (mut model, mut problem) = (model.clone(), problem.clone());
    for t in problem.searched() {
        let entry = &mut problem.theta[t];
        if effects.contains(&entry.effect) {
            let term = &mut model.effects[entry.effect as usize];
            let name = entry.short_name(&term.effect.descriptor().id).to_string();
            term.values.insert(name.clone(), problem.start.theta[t]);
            term.held.push(name);
            (entry.free, entry.prior_sigma) = (false, None);
        }
    }
    (model, problem)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{EffectRef, EffectTerm};
    use crate::scenario::{Scenario, simulate};
    use std::collections::BTreeMap;

    /// A bulge about the middle of the sensor, three times wider than any flaw that is searched, and how the fit of a
    /// flaw takes it.
    #[test]
    fn width_that_leaves_its_domain_is_held_where_it_started() {
        let scenario = Scenario::preset("closerange", &BTreeMap::from([("points".into(), 60.0)])).expect("a preset");
        let mut block = simulate(&scenario, 1).expect("a block").block;
        let camera = &block.cameras[0];
        let [width, height] = [f64::from(camera.width_px), f64::from(camera.height_px)];
        let wide = 0.75 * width.hypot(height);
        for row in block.ties.iter_mut().chain(&mut block.marks) {
            let q = [row.x - 0.5 * width, row.y - 0.5 * height].map(|along| along / wide);
            let bulge = 20.0 * (-q[0] * q[0] - q[1] * q[1]).exp();
            (row.x, row.y) = (row.x + bulge * q[0], row.y + bulge * q[1]);
        }
        let effect = EffectRef::Builtin(crate::effects::find("local-flaw").expect("an effect"));
        let start = 0.2 * width.hypot(height);
        let values = [("lambda", 1.0), ("sigma", start), ("smooth", 1.0)];
        let values = values.map(|(name, value)| (name.to_string(), value)).into();
        let model = Model {
            effects: vec![EffectTerm { effect, values, held: vec!["centre_x".into(), "centre_y".into()] }],
            free: [false; 12],
            ..Model::default()
        };
        let problem = Problem::new(&block, &model).expect("a problem");
        let options = Options { threads: 1, ..Options::default() };
        let free = solve_as_it_is(&problem, &options).expect("a fit");
        assert_eq!(lost_effects(&problem, &free.state.theta), BTreeSet::from([0]), "{:?}", free.state.theta);

        let fitted = solve(&model, problem, &options).expect("a fit");
        assert_eq!(fitted.solution.state.theta[3], start, "the width stays");
        assert!(fitted.solution.state.theta[0] > 1.0, "its height is estimated: {:?}", fitted.solution.state.theta);
        assert_eq!(fitted.model.effects[0].held, ["centre_x", "centre_y", "sigma"]);
        let again = fit(&block, &fitted.model, None, &options).expect("a fit");
        assert!((again.chi_square() - fitted.chi_square()).abs() < 1e-3 * fitted.chi_square(), "the model repeats it");
    }
}
