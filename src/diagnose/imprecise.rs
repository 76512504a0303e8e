//! Groups of observations that are much less precise than stated: a finding of its own, with what causes it.
//!
//! A factor is estimated. It is a finding where the residuals reject every factor up to [`FINDING`]: with the estimate
//! `f` from `r` redundant coordinates, `r f^2 / FINDING^2` is a chi-square of `r` degrees of freedom or smaller.

use super::weights::{FINDING, MOST};
use crate::block::Block;
use crate::math::statistics::chi_square_ln_sf;
use crate::measure::Predictor;
use crate::model::{FlightFactors, SigmaFactors};
use crate::problem::PointSource;
use crate::run::RunError;
use crate::run::fit::Fit;
use crate::run::squares;
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
    /// Is it a group of control points or GNSS positions?
    pub fn is_of_survey(&self) -> bool {
        self.group.starts_with("control") || self.group.starts_with("GNSS")
    }

    /// Does the factor stand at the end of its range, so that it is a bound alone?
    pub fn is_bound(&self) -> bool {
        self.factor == MOST
    }
}

/// A group of a fit.
struct Group {
    name: String,
    factor: f64,
    residuals: Standardised,
}

/// Residuals of a group at its estimated precision, standardised and squared.
#[derive(Default)]
struct Standardised {
    /// Mean of each image or point.
    by_name: Vec<(f64, String)>,
    /// Of all. At the likeliest factor it is the redundancy of the group.
    sum: f64,
    /// Coordinates.
    count: f64,
}

impl Standardised {
    fn add(&mut self, sum: f64, count: f64, name: &str) {
        if count > 0.0 {
            self.by_name.push((sum / count, name.to_owned()));
            self.sum += sum;
            self.count += count;
        }
    }
}

impl Group {
    fn is_finding(&self, significance: f64) -> bool {
        let redundancy = self.residuals.sum.min(self.residuals.count);
        let squares = redundancy * (self.factor / FINDING).powi(2);
        self.factor > FINDING && redundancy > 0.0 && chi_square_ln_sf(squares, redundancy) < significance.ln()
    }

    fn named(self) -> Imprecise {
        let Self { name: group, factor, residuals: Standardised { mut by_name, .. } } = self;
        by_name.sort_by(|a, b| b.0.total_cmp(&a.0));
        let worst = by_name.into_iter().take(NAMED).map(|(_, name)| name).collect();
        Imprecise { group, factor, worst }
    }
}

/// The groups of a fit that are a finding at the level `significance`.
///
/// # Errors
/// A state that cannot be predicted.
pub fn beyond(block: &Block, fit: &Fit, significance: f64) -> Result<Vec<Imprecise>, RunError> {
    let SigmaFactors { image, mark, control, control_z, gnss, gnss_z } = fit.model.sigma_factors;
    let residuals = Residuals { fit, predictor: Predictor::new(&fit.problem, &fit.solution.state)? };
    let any = |_: usize| true;
    let group = |name: &str, factor, residuals| Group { name: name.into(), factor, residuals };
    let mut groups: Vec<Group> = Vec::new();
    // Marks share the factor of the images. Where none is large, no residual is looked at.
    if image.max(image * mark) > FINDING {
        let images = group("image measurements", image, residuals.images(any)?);
        groups.push(match images.is_finding(significance) {
            true => images,
            false => group("marks of control points", image * mark, residuals.marks()?),
        });
    }
    groups.push(group("control in plan", control, residuals.control(PLAN)));
    groups.push(group("control in height", control_z, residuals.control(HEIGHT)));
    groups.push(group("GNSS in plan", gnss, residuals.gnss(PLAN, any)));
    groups.push(group("GNSS in height", gnss_z, residuals.gnss(HEIGHT, any)));
    for (flight, name) in block.flights.iter().enumerate() {
        let Some(FlightFactors { image, gnss, gnss_z }) = fit.model.flight_factors.get(name) else { continue };
        let own = |image: usize| fit.problem.image_contexts[image].flight as usize == flight;
        let of_flight = |name_of: &str| format!("{name_of} of flight {name}");
        groups.push(group(&of_flight("image measurements"), *image, residuals.images(own)?));
        groups.push(group(&of_flight("GNSS in plan"), *gnss, residuals.gnss(PLAN, own)));
        groups.push(group(&of_flight("GNSS in height"), *gnss_z, residuals.gnss(HEIGHT, own)));
    }
    Ok(groups.into_iter().filter(|group| group.is_finding(significance)).map(Group::named).collect())
}

struct Residuals<'a> {
    fit: &'a Fit,
    predictor: Predictor<'a>,
}

impl Residuals<'_> {
    /// By image.
    fn images(&self, of: impl Fn(usize) -> bool) -> Result<Standardised, RunError> {
        let names = &self.fit.problem.image_names;
        let mut sums = vec![(0.0, 0.0); names.len()];
        squares::each(self.fit, |_, image, square| add(&mut sums[image], square))?;
        Ok(standardised(&sums, names, of))
    }

    /// By control point.
    fn marks(&self) -> Result<Standardised, RunError> {
        let problem = &self.fit.problem;
        let mut sums = vec![(0.0, 0.0); problem.point_names.len()];
        squares::each(self.fit, |point, _, square| add(&mut sums[point], square))?;
        let is_control = |point: usize| matches!(problem.point_sources[point], PointSource::Control(_));
        Ok(standardised(&sums, &problem.point_names, is_control))
    }

    fn control(&self, axes: &[usize]) -> Standardised {
        let Fit { problem, solution, .. } = self.fit;
        let mut all = Standardised::default();
        for observed in &problem.control {
            if let Some(off) = squares::of_control(&self.predictor, &solution.state, observed) {
                let square = axes.iter().map(|axis| off[*axis].powi(2)).sum();
                all.add(square, axes.len() as f64, &problem.point_names[observed.index as usize]);
            }
        }
        all
    }

    fn gnss(&self, axes: &[usize], of: impl Fn(usize) -> bool) -> Standardised {
        let problem = &self.fit.problem;
        let mut all = Standardised::default();
        for observed in problem.gnss.iter().filter(|observed| of(observed.index as usize)) {
            if let Some(off) = squares::of_antenna(&self.predictor, observed) {
                let square = axes.iter().map(|axis| off[*axis].powi(2)).sum();
                all.add(square, axes.len() as f64, &problem.image_names[observed.index as usize]);
            }
        }
        all
    }
}

/// Adds both coordinates of a measurement.
fn add(to: &mut (f64, f64), square: f64) {
    to.0 += square;
    to.1 += 2.0;
}

fn standardised(sums: &[(f64, f64)], names: &[String], of: impl Fn(usize) -> bool) -> Standardised {
    let mut all = Standardised::default();
    for (index, (sum, count)) in sums.iter().enumerate().filter(|(index, _)| of(*index)) {
        all.add(*sum, *count, &names[index]);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(factor: f64, redundancy: f64) -> Group {
        let residuals = Standardised { by_name: Vec::new(), sum: redundancy, count: 2.0 * redundancy };
        Group { name: "marks".into(), factor, residuals }
    }

    /// Of a precision that is wrong by the limit itself chance alone says on which side of it the estimate lies.
    #[test]
    fn a_factor_is_a_finding_where_the_residuals_reject_the_limit() {
        let significance = 1e-3;
        assert!(!group(FINDING * 1.001, 50_000.0).is_finding(significance));
        assert!(group(FINDING * 1.02, 50_000.0).is_finding(significance), "0.3 % is the standard deviation");
        assert!(!group(FINDING * 1.4, 10.0).is_finding(significance), "a fifth is the standard deviation");
        assert!(group(10.0, 10.0).is_finding(significance));
        assert!(!group(10.0, 0.0).is_finding(significance));
    }
}
