//! How precise points and cameras would be.

use super::{Hidden, Limits, Visible, limits};
use crate::adjust::native::Native;
use crate::adjust::{Covariance, CovarianceOf, Options, Solver};
use crate::block::Block;
use crate::problem::{PointSource, Problem};
use crate::residuals::check_points::Adjusted;
use crate::residuals::check_points::expected::{Expected, expected};
use crate::run::RunError;
use crate::run::fit::Fit;
use crate::run::{self, options_for};
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Share of points up to the worst one that is told.
const WORST: f64 = 0.95;

/// Standard deviations where every measurement errs as stated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Precision {
    /// Of a horizontal coordinate of a tie point, m; not known of blocks that are too large for the covariance of each.
    pub plan_m: Option<Spread>,
    /// Of the height of a tie point, m.
    pub height_m: Option<Spread>,
    /// What keeps horizontal coordinates of tie points from being more precise.
    pub plan_limits: Option<Limits>,
    /// What keeps their heights from it.
    pub height_limits: Option<Limits>,
    /// Of each free camera parameter and effect parameter of the model, in its own unit.
    pub parameters: BTreeMap<String, f64>,
    /// Of the check points; without any there is nothing to compare.
    pub check: Option<OfChecks>,
    /// Of each tie point, where the block is small enough.
    #[serde(skip)]
    pub points: Vec<OfPoint>,
}

/// Of a tie point.
#[derive(Debug, Clone, PartialEq)]
pub struct OfPoint {
    /// Its name.
    pub name: String,
    /// Where it is, m.
    pub position: Vector3<f64>,
    /// Standard deviations, m.
    pub sigma_m: Vector3<f64>,
    /// Correlation of the horizontal coordinates.
    pub correlation: f64,
}

impl OfPoint {
    fn new(name: &str, position: Vector3<f64>, covariance: &Matrix3<f64>) -> Self {
        let sigma_m = covariance.diagonal().map(f64::sqrt);
        let correlation = covariance[(0, 1)] / (sigma_m.x * sigma_m.y);
        Self { name: name.to_owned(), position, sigma_m, correlation }
    }

    /// Standard deviation of a horizontal coordinate, m.
    fn plan_m(&self) -> f64 {
        (0.5 * self.sigma_m.xy().norm_squared()).sqrt()
    }
}

/// Differences between computed and surveyed coordinates of check points, whose survey errs as stated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OfChecks {
    /// Standard deviation of a horizontal coordinate, m.
    pub plan_m: Spread,
    /// Standard deviation of the height, m.
    pub height_m: Spread,
    /// Standard deviation of a bowl or dome of the heights, from the middle to `reach_m`, m. Not known where the check
    /// points are few, or lie on a line.
    pub dome_m: Option<f64>,
    /// Largest horizontal distance of a check point from their middle, m.
    pub reach_m: Option<f64>,
    /// Root mean square of a horizontal coordinate, if the effect that moves points most is there, just too small to
    /// be seen and no larger than is plausible, m.
    pub plan_unseen_m: f64,
    /// The same of the height, m.
    pub height_unseen_m: f64,
    /// Root mean square of a horizontal coordinate, if of the effects that the block cannot show the one that moves
    /// points most is there, at its typical size, m.
    pub plan_hidden_m: f64,
    /// The same of the height, m.
    pub height_hidden_m: f64,
}

/// Of many points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Root mean square.
    pub rms: f64,
    /// Median.
    pub typical: f64,
    /// 95 % of the points have less.
    pub worst: f64,
}

impl Spread {
    pub(super) fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get((share * values.len() as f64) as usize).copied();
        let rms = (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt();
        Some(Self { rms, typical: at(0.5)?, worst: at(WORST)? })
    }
}

/// The problem at its solution, and the covariance of everything where the block is small enough.
pub(super) struct Certainty {
    pub(super) problem: Problem,
    pub(super) covariance: Option<Covariance>,
}

/// The covariance at an error-free fit.
pub(super) fn certainty(fit: &Fit, options: &Options) -> Result<Certainty, RunError> {
    let mut problem = fit.problem.clone();
    problem.start = fit.solution.state.clone();
    let options = Options { covariance: CovarianceOf::WithParts, may_stay_unconverged: true, ..options.clone() };
    let solution = Native.solve(&problem, &options_for(&problem, &options), &mut |_| ControlFlow::Continue(()))?;
    Ok(Certainty { problem, covariance: solution.covariance })
}

pub(super) fn of_fit(
    block: &Block,
    fit: &Fit,
    certainty: Option<&Certainty>,
    effects: (&[Visible], &[Hidden]),
    threads: usize,
) -> Result<Precision, RunError> {
    let comparison = run::compare(block, &fit.problem, &fit.solution)?;
    let (model, state) = (&fit.model, &fit.solution.state);
    let (comparison, null_base) = (comparison.as_ref(), &fit.null_base);
    let adjusted = Adjusted { block, model, problem: &fit.problem, state, comparison, null_base };
    let check = expected(&adjusted, threads)?.and_then(|expected| of_checks(&expected, effects));
    let Some(Certainty { problem, covariance: Some(covariance) }) = certainty else {
        let (plan_m, height_m, plan_limits, height_limits, parameters, points) = Default::default();
        return Ok(Precision { plan_m, height_m, plan_limits, height_limits, parameters, check, points });
    };
    let is_tie = |k: &usize| matches!(problem.point_sources[*k], PointSource::Tie(_));
    let of = |k: usize| OfPoint::new(&problem.point_names[k], problem.start.points[k], &covariance.points[k]);
    let ties: Vec<usize> = (0..covariance.points.len()).filter(is_tie).collect();
    let points: Vec<OfPoint> = ties.iter().copied().map(of).collect();
    let [plan_limits, height_limits] =
        limits::of_ties(problem, covariance, &ties).map_or([None, None], |own| own.map(Some));
    let parameters = covariance.shared_unknowns.iter().enumerate();
    Ok(Precision {
        plan_m: Spread::of(points.iter().map(OfPoint::plan_m).collect()),
        height_m: Spread::of(points.iter().map(|own| own.sigma_m.z).collect()),
        plan_limits,
        height_limits,
        parameters: parameters
            .map(|(k, unknown)| (problem.unknown_name(*unknown), covariance.shared[(k, k)].sqrt()))
            .collect(),
        check,
        points,
    })
}

fn of_checks(expected: &Expected, (shown, hidden): (&[Visible], &[Hidden])) -> Option<OfChecks> {
    let sigmas = || expected.sigmas_m.iter();
    let plan_m = Spread::of(sigmas().map(|own| (0.5 * (own.x * own.x + own.y * own.y)).sqrt()).collect())?;
    let height_m = Spread::of(sigmas().map(|own| own.z).collect())?;
    let sizes = shown.iter().flat_map(|own| &own.sizes);
    let unseen = most(sizes.filter_map(|own| Some((own.moves_m?, own.moves_height_m?))));
    let typical = hidden.iter().flat_map(|own| &own.typical);
    let typical = typical.chain(shown.iter().flat_map(|own| &own.absorbed_typical));
    let hidden = most(typical.map(|own| (own.moves_m, own.moves_height_m)));
    Some(OfChecks {
        plan_unseen_m: plan_m.rms.hypot(unseen.0),
        height_unseen_m: height_m.rms.hypot(unseen.1),
        plan_hidden_m: plan_m.rms.hypot(hidden.0),
        height_hidden_m: height_m.rms.hypot(hidden.1),
        dome_m: expected.dome_m,
        reach_m: expected.reach_m,
        plan_m,
        height_m,
    })
}

/// The largest move of one horizontal coordinate, and of the height: of 3D moves `d` and those in height `z` the former
/// is `sqrt((d^2 - z^2) / 2)`.
fn most(moves: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    moves.fold((0.0, 0.0), |(plan, height), (d, z)| {
        let own = (0.5 * (d * d - z * z).max(0.0)).sqrt();
        (own.max(plan), z.max(height))
    })
}
