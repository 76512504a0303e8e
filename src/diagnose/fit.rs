//! The base of a diagnosis: a converged model with believable weights.

use super::candidate::{Candidate, candidates};
use super::scan::best_place;
use super::score::{Base, ScreenError, Screening, screen};
use super::variants;
use super::weights;
use crate::adjust::native::{Native, Predictor};
use crate::adjust::{AdjustError, CovarianceOf, Options, Solution, Solver};
use crate::block::Block;
use crate::model::{EffectRef, Model, SigmaFactors};
use crate::problem::{Problem, ProblemError};
use crate::run::{self, FittedModel, RunError};
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// A model fitted to a block.
#[derive(Clone)]
pub struct Fit {
    /// The model, start values those of the solution.
    pub model: Model,
    /// Its problem.
    pub problem: Problem,
    /// Its solution.
    pub solution: Solution,
}

/// Fits with the native solver: the diagnosis refits many models, and the steps that it keeps are solved by both solvers afterwards.
///
/// `near`: an earlier fit of the same images, to start from; another model's solution is nearer than the block's approximations.
pub fn fit(block: &Block, model: &Model, near: Option<&Fit>, options: &Options) -> Result<Fit, RunError> {
    let mut problem = Problem::new(block, model)?;
    if let Some(near) = near {
        problem.start_from(&near.problem, &near.solution.state);
    }
    let options = run::options_for(&problem, options);
    run::estimate_variance_components(&mut problem, &Native, &options)?;
    let solution = Native.solve(&problem, &options, &mut |_| ControlFlow::Continue(()))?;
    Ok(Fit { model: model.clone(), problem, solution })
}

/// Rounds of weight estimation: the second changes a factor by the square of what the first changed it.
const WEIGHT_ROUNDS: usize = 3;
/// Relative change of a factor below which the weights stand: it changes statistics by twice that.
const WEIGHT_CHANGE: f64 = 0.02;

/// Fits `model` and estimates the variance factor of each group of observations. The factors stay in the model.
pub fn fit_with_weights(
    block: &Block,
    model: &Model,
    near: Option<&Fit>,
    plugins: &[EffectRef],
    options: &Options,
    significance: f64,
) -> Result<Fit, DiagnoseError> {
    let options = Options { covariance: CovarianceOf::Everything, ..options.clone() };
    let mut model = model.clone();
    let mut last = None;
    for _ in 0..WEIGHT_ROUNDS {
        let fitted = fit(block, &model, last.as_ref().or(near), &options)?;
        let factors = estimate_factors(block, &fitted, plugins, &options, significance)?;
        let before = model.sigma_factors;
        let change = |a: f64, b: f64| (a / b - 1.0).abs();
        let changed = change(factors.image, before.image)
            .max(change(factors.control, before.control))
            .max(change(factors.gnss, before.gnss));
        if changed < WEIGHT_CHANGE {
            return Ok(fitted);
        }
        model.sigma_factors = factors;
        last = Some(fitted);
    }
    Ok(fit(block, &model, last.as_ref(), &options)?)
}

fn estimate_factors(
    block: &Block,
    fitted: &Fit,
    plugins: &[EffectRef],
    options: &Options,
    significance: f64,
) -> Result<SigmaFactors, DiagnoseError> {
    let Fit { model, problem, solution } = fitted;
    let chi_square = 2.0 * solution.cost;
    let before = model.sigma_factors;
    let Some(covariance) = solution.covariance.as_ref().filter(|c| !c.points.is_empty()) else {
        // Too large for the covariance of every pose: the images dominate, and theirs is the factor of the whole.
        let factor = (chi_square / problem.redundancy().2 as f64).sqrt();
        return Ok(SigmaFactors { image: before.image * factor, ..before });
    };
    let predictor = FittedModel { predictor: Predictor::new(problem, &solution.state)? };
    let groups = weights::groups(problem, &solution.state, chi_square, covariance, &predictor);
    let mut explained = [(0.0, 0.0); 3];
    if !(problem.gnss.is_empty() && problem.control.is_empty()) {
        let base = Base { block, model, problem, state: &solution.state, threads: options.threads, significance };
        let mut list = candidates(block, problem, model, plugins);
        list.retain(|candidate| {
            use crate::effects::Stage;
            let stage = candidate.term().map(|term| term.effect.descriptor().stage);
            matches!(stage, Some(Stage::Position | Stage::Exposure | Stage::Control)) && candidate.testable()
        });
        let screening = screen(&base, list, &BTreeMap::new())?;
        explained = [(0.0, 0.0), screening.explained_control, screening.explained_positions];
    }
    Ok(weights::factors(before, &groups, &explained))
}

/// Screens every candidate at a fit: scans first, then one score test for all.
pub fn screen_all(
    block: &Block,
    fitted: &Fit,
    plugins: &[EffectRef],
    threads: usize,
    significance: f64,
) -> Result<Screening, DiagnoseError> {
    let Fit { model, problem, solution } = fitted;
    let base = Base { block, model, problem, state: &solution.state, threads, significance };
    let mut list: Vec<Candidate> = Vec::new();
    let mut scans = BTreeMap::new();
    for candidate in candidates(block, problem, model, plugins) {
        if !(candidate.testable() && candidate.scanned()) {
            list.extend(variants::of(problem, candidate));
            continue;
        }
        match best_place(&base, &candidate)? {
            Some(best) => {
                scans.insert(candidate.id.clone(), best.scan);
                list.push(best.candidate);
            }
            None => {
                let needs = vec!["measurements on more of the sensor".into()];
                list.push(Candidate { needs, ..candidate });
            }
        }
    }
    let mut screening = screen(&base, list, &scans)?;
    variants::keep_best(&mut screening);
    Ok(screening)
}

/// Why a diagnosis failed.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// A fit failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A screening failed.
    #[error(transparent)]
    Screen(#[from] ScreenError),
}

impl From<AdjustError> for DiagnoseError {
    fn from(error: AdjustError) -> Self {
        Self::Run(error.into())
    }
}

impl From<ProblemError> for DiagnoseError {
    fn from(error: ProblemError) -> Self {
        Self::Run(error.into())
    }
}
