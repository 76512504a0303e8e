//! The base of a diagnosis: a converged model with believable weights.

use super::candidate::{Candidate, candidates};
use super::scan::best_place;
use super::score::{Base, ScreenError, Screening, screen};
use super::variants;
use super::weights;
use crate::adjust::native::Native;
use crate::adjust::{AdjustError, Options, Solution, Solver};
use crate::block::Block;
use crate::effects::Role;
use crate::measure::{MeasureError, Predictor};
use crate::model::{EffectRef, EffectTerm, Model, SigmaFactors};
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

/// Change of chi-square at which a fit of the diagnosis stops: parameters are then known to a hundredth of their sigma, which no decision sees.
/// The models that are handed on are solved to the last digit, by both solvers.
const CHI_SQUARE_CHANGE: f64 = 1e-4;

/// Steps of a refit at most: ten times what one takes that starts at the solution of nearly the same model.
const REFIT_ITERATIONS: usize = 50;

/// Options of a fit that decides.
pub(super) fn deciding(options: &Options) -> Options {
    Options { chi_square_change: options.chi_square_change.max(CHI_SQUARE_CHANGE), ..options.clone() }
}

/// Fits with the native solver, as far as decisions see: the diagnosis refits many models, and the steps that it keeps are solved by both
/// solvers afterwards.
///
/// `near`: an earlier fit of the same images, to start from; another model's solution is nearer than the block's approximations.
pub fn fit(block: &Block, model: &Model, near: Option<&Fit>, options: &Options) -> Result<Fit, RunError> {
    fit_to(block, model, near, &deciding(options))
}

/// [`fit`], as far as `options` ask for.
fn fit_to(block: &Block, model: &Model, near: Option<&Fit>, options: &Options) -> Result<Fit, RunError> {
    let mut problem = Problem::new(block, model)?;
    if let Some(near) = near {
        problem.start_from(&near.problem, &near.solution.state);
    }
    let options = run::options_for(&problem, options);
    run::estimate_variance_components(&mut problem, &Native, &options)?;
    let solution = Native.solve(&problem, &options, &mut |_| ControlFlow::Continue(()))?;
    Ok(Fit { model: model.clone(), problem, solution })
}

/// Fits `model`, which is that of `before` and one more effect.
pub fn refit(block: &Block, model: &Model, before: &Fit, options: &Options) -> Result<Fit, RunError> {
    let few = Options { max_iterations: REFIT_ITERATIONS.min(options.max_iterations), ..options.clone() };
    if let Some(held) = held_where_found(model) {
        // A shape with a place is linear while the place is held where the scan found it, and near its own best place then. One with a kink may
        // have no smooth way there, which shows at the last digit only: it stays.
        let at_place = fit(block, &held, Some(before), options)?;
        return Ok(fit_to(block, model, Some(&at_place), &few).unwrap_or(at_place));
    }
    let near = fit(block, model, Some(before), &few);
    let random =
        |term: &EffectTerm| term.effect.descriptor().parameters.iter().any(|p| matches!(p.role, Role::Random(_)));
    match near {
        // A distortion that is missing may have driven the base far away: the block's approximations are the second choice.
        Err(_) if !model.effects.last().is_some_and(random) => fit(block, model, None, options),
        near => near,
    }
}

/// The model with the searched parameters of its newest effect held where they stand; `None` where it has none.
fn held_where_found(model: &Model) -> Option<Model> {
    let mut model = model.clone();
    let term = model.effects.last_mut()?;
    let parameters = &term.effect.descriptor().parameters;
    let searched =
        parameters.iter().filter(|p| matches!(p.role, Role::Searched(_)) && !term.held.contains(&p.name.to_string()));
    let searched: Vec<String> = searched.map(|p| p.name.to_string()).collect();
    term.held.extend(searched.iter().cloned());
    (!searched.is_empty()).then_some(model)
}

/// Rounds of weight estimation: the second changes a factor by the square of what the first changed it.
const WEIGHT_ROUNDS: usize = 3;
/// Relative change of a factor below which the weights stand: it changes statistics by twice that.
const WEIGHT_CHANGE: f64 = 0.02;

/// Estimates the variance factor of each group of observations at `fitted`, and fits anew with them until they stand. The factors stay in the
/// model. `stated`: those that the model was given with.
pub fn with_weights(
    block: &Block,
    mut fitted: Fit,
    stated: SigmaFactors,
    plugins: &[EffectRef],
    options: &Options,
    significance: f64,
) -> Result<Fit, DiagnoseError> {
    for _ in 0..WEIGHT_ROUNDS {
        let factors = estimate_factors(block, &fitted, stated, plugins, options, significance)?;
        if same_weights(factors, fitted.model.sigma_factors) {
            break;
        }
        let model = Model { sigma_factors: factors, ..fitted.model.clone() };
        fitted = fit(block, &model, Some(&fitted), options)?;
    }
    Ok(fitted)
}

/// Do factors differ by less than statistics see?
pub(super) fn same_weights(a: SigmaFactors, b: SigmaFactors) -> bool {
    let pairs = [(a.image, b.image), (a.control, b.control), (a.gnss, b.gnss)];
    pairs.into_iter().all(|(a, b)| (a / b - 1.0).abs() < WEIGHT_CHANGE)
}

fn estimate_factors(
    block: &Block,
    fitted: &Fit,
    stated: SigmaFactors,
    plugins: &[EffectRef],
    options: &Options,
    significance: f64,
) -> Result<SigmaFactors, DiagnoseError> {
    let Fit { model, problem, solution } = fitted;
    let chi_square = 2.0 * solution.cost;
    let now = model.sigma_factors;
    let Some(covariance) = solution.covariance.as_ref().filter(|c| !c.points.is_empty()) else {
        // Too large for the covariance of every pose: the images dominate, and theirs is the factor of the whole.
        let factor = (chi_square / problem.redundancy().2 as f64).sqrt();
        return Ok(SigmaFactors { image: now.image * factor, ..now });
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
    Ok(weights::factors(stated.image, now, &groups, &explained))
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

impl From<MeasureError> for DiagnoseError {
    fn from(error: MeasureError) -> Self {
        Self::Run(error.into())
    }
}

impl From<ProblemError> for DiagnoseError {
    fn from(error: ProblemError) -> Self {
        Self::Run(error.into())
    }
}
