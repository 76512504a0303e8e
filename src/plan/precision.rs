//! How precise points and cameras would be.

use crate::adjust::native::Native;
use crate::adjust::{CovarianceOf, Options, Solver};
use crate::diagnose::error::DiagnoseError;
use crate::problem::PointSource;
use crate::run::fit::Fit;
use crate::run::options_for;
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
    /// Of each free camera parameter and effect parameter of the model, in its own unit.
    pub parameters: BTreeMap<String, f64>,
}

/// Of many points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Median.
    pub typical: f64,
    /// 95 % of the points have less.
    pub worst: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get((share * values.len() as f64) as usize).copied();
        Some(Self { typical: at(0.5)?, worst: at(WORST)? })
    }
}

pub(super) fn of_fit(fit: &Fit, options: &Options) -> Result<Precision, DiagnoseError> {
    let mut problem = fit.problem.clone();
    problem.start = fit.solution.state.clone();
    let options = Options { covariance: CovarianceOf::Everything, may_stay_unconverged: true, ..options.clone() };
    let solution = Native.solve(&problem, &options_for(&problem, &options), &mut |_| ControlFlow::Continue(()))?;
    let Some(covariance) = solution.covariance else {
        return Ok(Precision { plan_m: None, height_m: None, parameters: BTreeMap::new() });
    };
    let is_tie = |(_, source): &(_, &PointSource)| matches!(source, PointSource::Tie(_));
    let of_ties = || covariance.points.iter().zip(problem.point_sources.iter()).filter(is_tie).map(|(own, _)| own);
    let parameters = covariance.shared_unknowns.iter().enumerate();
    Ok(Precision {
        plan_m: Spread::of(of_ties().map(|own| (0.5 * (own[(0, 0)] + own[(1, 1)])).sqrt()).collect()),
        height_m: Spread::of(of_ties().map(|own| own[(2, 2)].sqrt()).collect()),
        parameters: parameters
            .map(|(k, unknown)| (problem.unknown_name(*unknown), covariance.shared[(k, k)].sqrt()))
            .collect(),
    })
}
