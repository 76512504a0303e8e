//! Groups of observations that are much less precise than stated: a finding of its own, with what causes it.

use super::fit::{DiagnoseError, Fit};
use super::weights::MOST;
use crate::block::Block;
use crate::measure::Predictor;
use crate::model::{FlightFactors, SigmaFactors};
use crate::problem::PositionObservation;
use serde::{Deserialize, Serialize};

/// Images or points that are named at most.
const NAMED: usize = 3;

/// A group whose stated precision the residuals contradict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Imprecise {
    /// What was measured, in words.
    pub group: String,
    /// Factor on its standard deviation: [`MOST`], where more was asked for, too.
    pub factor: f64,
    /// Images or points with the largest residuals, the worst first.
    pub worst: Vec<String>,
}

/// A group, its factor, and the size of each of its residuals, standardised and squared, by image or point.
type Group = (String, f64, Vec<(f64, String)>);

/// The groups of a fit that reached the largest factor.
///
/// # Errors
/// A state that cannot be predicted.
pub fn beyond(block: &Block, fit: &Fit) -> Result<Vec<Imprecise>, DiagnoseError> {
    let SigmaFactors { image, control, control_z, gnss, gnss_z } = fit.model.sigma_factors;
    let residuals = Residuals { fit, predictor: Predictor::new(&fit.problem, &fit.solution.state)? };
    let any = |_: usize| true;
    let mut groups: Vec<Group> = Vec::new();
    let mut add = |group: String, factor: f64, residuals: &dyn Fn() -> Vec<(f64, String)>| {
        if factor >= MOST {
            groups.push((group, factor, residuals()));
        }
    };
    add("image measurements".into(), image, &|| residuals.images(any));
    add("control in plan".into(), control, &|| residuals.control(&[0, 1]));
    add("control in height".into(), control_z, &|| residuals.control(&[2]));
    add("GNSS in plan".into(), gnss, &|| residuals.gnss(&[0, 1], any));
    add("GNSS in height".into(), gnss_z, &|| residuals.gnss(&[2], any));
    for (flight, name) in block.flights.iter().enumerate() {
        let Some(FlightFactors { image, gnss, gnss_z }) = fit.model.flight_factors.get(name) else { continue };
        let own = |image: usize| fit.problem.image_contexts[image].flight as usize == flight;
        add(format!("image measurements of flight {name}"), *image, &|| residuals.images(own));
        add(format!("GNSS in plan of flight {name}"), *gnss, &|| residuals.gnss(&[0, 1], own));
        add(format!("GNSS in height of flight {name}"), *gnss_z, &|| residuals.gnss(&[2], own));
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
    fn images(&self, of: impl Fn(usize) -> bool) -> Vec<(f64, String)> {
        let Fit { problem, solution, .. } = self.fit;
        let mut sums = vec![(0.0, 0.0); problem.image_names.len()];
        for (j, point) in solution.state.points.iter().enumerate() {
            for seen in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
                let predicted = self.predictor.image_point(seen.image as usize, [seen.x, seen.y], point);
                if let Some(([x, y], _)) = predicted {
                    let (sum, count) = &mut sums[seen.image as usize];
                    *sum += ((seen.x - x).powi(2) + (seen.y - y).powi(2)) * seen.inverse_sigma.powi(2);
                    *count += 1.0;
                }
            }
        }
        let seen = sums.into_iter().enumerate().filter(|(image, (_, count))| *count > 0.0 && of(*image));
        seen.map(|(image, (sum, count))| (sum / count, problem.image_names[image].clone())).collect()
    }

    fn control(&self, axes: &[usize]) -> Vec<(f64, String)> {
        let Fit { problem, solution, .. } = self.fit;
        let of = |observed: &PositionObservation| {
            let point = observed.index as usize;
            let predicted = self.predictor.surveyed(&solution.state.points[point])?;
            let off = (observed.position - predicted).component_div(&observed.sigma);
            Some((axes.iter().map(|axis| off[*axis].powi(2)).sum(), problem.point_names[point].clone()))
        };
        problem.control.iter().filter_map(of).collect()
    }

    fn gnss(&self, axes: &[usize], of: impl Fn(usize) -> bool) -> Vec<(f64, String)> {
        let problem = &self.fit.problem;
        let off = |observed: &PositionObservation| {
            let image = observed.index as usize;
            let predicted = self.predictor.antenna(image).filter(|_| of(image))?;
            let off = (observed.position - predicted).component_div(&observed.sigma);
            Some((axes.iter().map(|axis| off[*axis].powi(2)).sum(), problem.image_names[image].clone()))
        };
        problem.gnss.iter().filter_map(off).collect()
    }
}
