//! Small blocks, simulated and spoilt, under any model: an adjustment that fails says so, and one that is said to have converged has numbers
//! throughout.

mod faults;

use super::folder::said;
use arbitrary::{Result, Unstructured};
use misclosure::adjust::{BUILT, Covariance, Options, Solution};
use misclosure::block::Block;
use misclosure::model::{Datum, EffectRef, EffectTerm, Loss, Model};
use misclosure::problem::State;
use misclosure::run::{self, residual_rows, summary::Summary};
use misclosure::scenario::{Scenario, add_noise, simulate};
use misclosure::{effects, inject};
use std::ops::ControlFlow;

const SMALL: &str = include_str!("small.toml");
/// px.
const NOISE: f64 = 0.3;
/// Most faults and most effects of one input.
const MOST: u8 = 3;
/// Enough for what converges at all.
const ITERATIONS: usize = 60;

/// One input.
pub fn run(data: &[u8]) {
    // What the bytes do not fill is zero, so that every input is a case.
    let u = &mut Unstructured::new(data);
    let Ok(Some(block)) = spoilt_block(u) else { return };
    let Ok(model) = model(u) else { return };
    let options = Options { max_iterations: ITERATIONS, threads: 1, ..Options::default() };
    let adjusted = run::adjust(&block, &model, BUILT, &options, &mut |_, _| ControlFlow::Continue(()));
    let run = match adjusted {
        Ok(run) => run,
        Err(error) => return said(error),
    };
    for (name, solution) in run.solutions.iter().filter(|(_, solution)| solution.converged) {
        assert!(is_finite(solution), "{name}: a converged solution that is none");
    }
    let rows = residual_rows(&block, &run.problem, &run.solution().state, run.comparison.as_ref());
    let rows = rows.expect("residuals of a solution");
    serde_json::to_string(&Summary::of(&block, &run, &rows)).expect("a summary");
}

/// A block with errors of the registry and of a hand that slipped; `None` where the errors cannot be injected.
fn spoilt_block(u: &mut Unstructured<'_>) -> Result<Option<Block>> {
    let ordinary = [
        ("points", f64::from(u.int_in_range(8..=60)?)),
        ("height", f64::from(u.int_in_range(30..=90)?)),
        ("tilt", f64::from(u.int_in_range(0..=45)?)),
        ("relief", f64::from(u.int_in_range(0..=10)?)),
        ("control", f64::from(u.int_in_range(0..=6)?)),
    ];
    let overrides = ordinary.into_iter().map(|(name, value)| (name.to_string(), value)).collect();
    let scenario = Scenario::from_toml_with(SMALL, "small.toml", &overrides).expect("values within their limits");
    let seed = u.arbitrary::<u8>()?.into();
    let simulation = match simulate(&scenario, seed) {
        Ok(simulation) => simulation,
        Err(error) => {
            said(error);
            return Ok(None);
        }
    };
    let mut block = simulation.block;
    if u.ratio(3, 4)? {
        add_noise(&mut block, NOISE, seed).expect("noise");
    }
    let mut errors = Vec::new();
    for _ in 0..u.int_in_range(0..=MOST)? {
        errors.extend(inject::parse(&error(u)?).map_err(said));
    }
    match inject::apply(&block, &simulation.truth, &errors, seed) {
        Ok(injected) => block = injected.block,
        Err(error) => {
            said(error);
            return Ok(None);
        }
    }
    for _ in 0..u.int_in_range(0..=MOST)? {
        faults::apply(&mut block, u)?;
    }
    Ok(Some(block.about_its_centre()))
}

/// An error of the registry with values for some of its parameters.
fn error(u: &mut Unstructured<'_>) -> Result<String> {
    let cause = *u.choose(inject::registry())?;
    let mut text = format!("{}:", cause.id());
    for parameter in cause.parameters() {
        if u.ratio(1, 2)? {
            text += &format!("{}={},", parameter.name, faults::number(u)?);
        }
    }
    Ok(text)
}

fn model(u: &mut Unstructured<'_>) -> Result<Model> {
    let mut model = Model { tie_dc_to_pp: u.ratio(1, 3)?, ..Model::default() };
    if u.ratio(1, 2)? {
        for free in &mut model.free {
            *free = u.arbitrary()?;
        }
    }
    model.datum = *u.choose(&[Datum::Free, Datum::All, Datum::Control, Datum::Gnss])?;
    model.loss = *u.choose(&[Loss::None, Loss::None, Loss::Huber, Loss::Cauchy])?;
    for _ in 0..u.int_in_range(0..=MOST)? {
        let effect = *u.choose(effects::catalogue())?;
        let mut term = EffectTerm { effect: EffectRef::Builtin(effect), values: Default::default(), held: Vec::new() };
        for parameter in &effect.descriptor().parameters {
            if u.ratio(1, 8)? && parameter.expected_instead_of(parameter.typical).is_none() {
                term.values.insert(parameter.name.to_string(), parameter.typical * faults::number(u)?);
            }
        }
        if !model.effects.iter().any(|other| other.effect.descriptor().id == effect.descriptor().id) {
            model.effects.push(term);
        }
    }
    Ok(model)
}

fn is_finite(solution: &Solution) -> bool {
    let State { interiors, theta, poses, points } = &solution.state;
    let poses = poses.iter().flat_map(|pose| pose.centre.iter().chain(pose.rotation.coords.iter()));
    let values = interiors.iter().flatten().chain(theta).chain(points.iter().flat_map(|point| point.iter()));
    let covariance = solution.covariance.as_ref().is_none_or(is_covariance);
    solution.cost.is_finite() && values.chain(poses).all(|value| value.is_finite()) && covariance
}

fn is_covariance(covariance: &Covariance) -> bool {
    let Covariance { shared, poses, points, theta_variances, .. } = covariance;
    let diagonals = shared.diagonal().iter().copied().collect::<Vec<_>>().into_iter();
    let variances = diagonals
        .chain(poses.iter().flat_map(|pose| pose.diagonal().iter().copied().collect::<Vec<_>>()))
        .chain(points.iter().flat_map(|point| point.diagonal().iter().copied().collect::<Vec<_>>()))
        .chain(theta_variances.iter().copied());
    variances.into_iter().all(|variance| variance.is_finite() && variance >= 0.0)
}
