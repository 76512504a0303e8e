//! Groups of observations that are much less precise than stated: a finding of its own, with what causes it.

use super::error::DiagnoseError;
use super::squares;
use super::weights::{FINDING, MOST};
use crate::block::Block;
use crate::measure::Predictor;
use crate::model::{FlightFactors, SigmaFactors};
use crate::problem::{PointSource, PositionObservation};
use crate::run::fit::Fit;
use serde::{Deserialize, Serialize};

/// Images or points that are named at most.
const NAMED: usize = 3;
/// Axes of a position.
const PLAN: &[usize] = &[0, 1];
/// See [`PLAN`].
const HEIGHT: &[usize] = &[2];

/// A group whose stated precision the residuals contradict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Imprecise {
    /// What was measured, in words.
    pub group: String,
    /// Factor on its standard deviation; [`MOST`] also where the residuals of a survey ask for more.
    pub factor: f64,
    /// Images or points with the largest residuals, the worst first.
    pub worst: Vec<String>,
}

impl Imprecise {
    /// Does the factor stand at the end of its range, so that it is a bound alone?
    pub fn is_bound(&self) -> bool {
        self.factor == MOST
    }
}

/// A group, its factor, and the size of each of its residuals, standardised and squared, by image or point.
type Group = (String, f64, Vec<(f64, String)>);

/// The groups of a fit that are a finding.
///
/// # Errors
/// A state that cannot be predicted.
pub fn beyond(block: &Block, fit: &Fit) -> Result<Vec<Imprecise>, DiagnoseError> {
    let SigmaFactors { image, mark, control, control_z, gnss, gnss_z } = fit.model.sigma_factors;
    let residuals = Residuals { fit, predictor: Predictor::new(&fit.problem, &fit.solution.state)? };
    let any = |_: usize| true;
    let mut groups: Vec<Group> = Vec::new();
    if image >= FINDING {
        groups.push(("image measurements".into(), image, residuals.images(any)?));
    } else if image * mark >= FINDING {
        groups.push(("marks of control points".into(), image * mark, residuals.marks()?));
    }
    for (group, factor, axes) in [("control in plan", control, PLAN), ("control in height", control_z, HEIGHT)] {
        if factor >= FINDING {
            groups.push((group.into(), factor, residuals.control(axes)));
        }
    }
    for (group, factor, axes) in [("GNSS in plan", gnss, PLAN), ("GNSS in height", gnss_z, HEIGHT)] {
        if factor >= FINDING {
            groups.push((group.into(), factor, residuals.gnss(axes, any)));
        }
    }
    for (flight, name) in block.flights.iter().enumerate() {
        let Some(FlightFactors { image, gnss, gnss_z }) = fit.model.flight_factors.get(name) else { continue };
        let own = |image: usize| fit.problem.image_contexts[image].flight as usize == flight;
        if *image >= FINDING {
            groups.push((format!("image measurements of flight {name}"), *image, residuals.images(own)?));
        }
        for (group, factor, axes) in [("GNSS in plan", *gnss, PLAN), ("GNSS in height", *gnss_z, HEIGHT)] {
            if factor >= FINDING {
                groups.push((format!("{group} of flight {name}"), factor, residuals.gnss(axes, own)));
            }
        }
    }
    let named = |(group, factor, mut by_name): Group| {
        by_name.sort_by(|a, b| b.0.total_cmp(&a.0));
        let worst = by_name.into_iter().take(NAMED).map(|(_, name)| name).collect();
        Imprecise { group, factor, worst }
    };
    Ok(groups.into_iter().map(named).collect())
}

struct Residuals<'a> {
    fit: &'a Fit,
    predictor: Predictor<'a>,
}

impl Residuals<'_> {
    /// Mean over the measurements of each image.
    fn images(&self, of: impl Fn(usize) -> bool) -> Result<Vec<(f64, String)>, DiagnoseError> {
        let mut sums = vec![(0.0, 0.0); self.fit.problem.image_names.len()];
        squares::each(self.fit, |_, image, square| {
            let (sum, count) = &mut sums[image];
            *sum += square;
            *count += 1.0;
        })?;
        let seen = sums.into_iter().enumerate().filter(|(image, (_, count))| *count > 0.0 && of(*image));
        Ok(seen.map(|(image, (sum, count))| (sum / count, self.fit.problem.image_names[image].clone())).collect())
    }

    /// Mean over the marks of each control point.
    fn marks(&self) -> Result<Vec<(f64, String)>, DiagnoseError> {
        let problem = &self.fit.problem;
        let mut sums = vec![(0.0, 0.0); problem.point_names.len()];
        squares::each(self.fit, |point, _, square| {
            let (sum, count) = &mut sums[point];
            *sum += square;
            *count += 1.0;
        })?;
        let is_control = |point: &usize| matches!(problem.point_sources[*point], PointSource::Control(_));
        let marked = (0..sums.len()).filter(is_control).filter(|point| sums[*point].1 > 0.0);
        Ok(marked.map(|point| (sums[point].0 / sums[point].1, problem.point_names[point].clone())).collect())
    }

    fn control(&self, axes: &[usize]) -> Vec<(f64, String)> {
        let Fit { problem, solution, .. } = self.fit;
        let of = |observed: &PositionObservation| {
            let off = squares::of_control(&self.predictor, &solution.state, observed)?;
            let name = problem.point_names[observed.index as usize].clone();
            Some((axes.iter().map(|axis| off[*axis].powi(2)).sum(), name))
        };
        problem.control.iter().filter_map(of).collect()
    }

    fn gnss(&self, axes: &[usize], of: impl Fn(usize) -> bool) -> Vec<(f64, String)> {
        let problem = &self.fit.problem;
        let off = |observed: &PositionObservation| {
            let image = observed.index as usize;
            let off = squares::of_antenna(&self.predictor, observed).filter(|_| of(image))?;
            Some((axes.iter().map(|axis| off[*axis].powi(2)).sum(), problem.image_names[image].clone()))
        };
        problem.gnss.iter().filter_map(off).collect()
    }
}
