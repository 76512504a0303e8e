//! Control points whose marks were set aside, at the fit that goes without them.

use crate::block::{Block, Role};
use crate::evaluate::intersection::{Intersection, Method, intersect_surveyed};
use crate::math::statistics::median;
use crate::measure::Predictor;
use crate::mistakes::Mistake;
use crate::mistakes::lost::{Lost, judge};
use crate::run::FittedModel;
use crate::run::fit::Fit;
use nalgebra::Vector3;

/// Standard deviations from the median of absolute values, for the normal distribution.
const OF_MEDIAN: f64 = 1.4826;

/// What is wrong with the control points `names` of a block with all its marks. `fit`: of the block without theirs.
pub fn control_points(block: &Block, fit: &Fit, names: &[String], alpha: f64) -> Vec<Mistake> {
    let Ok(predictor) = Predictor::new(&fit.problem, &fit.solution.state) else { return Vec::new() };
    let fitted = FittedModel { predictor };
    let found = intersect_surveyed(&fitted, block, Method::Image).points;
    let is_lost = |point: &&Intersection| names.contains(&block.surveyed[point.point.index()].name);
    let is_control = |point: &&Intersection| block.surveyed[point.point.index()].role == Role::Control;
    let misfit = |point: &Intersection| block.surveyed[point.point.index()].position - point.position;
    let kept: Vec<Vector3<f64>> = found.iter().filter(is_control).filter(|own| !is_lost(own)).map(misfit).collect();
    // What right points leave, too: the fit and its weights are not exact.
    let usual = |axis: usize| {
        let sizes: Vec<f64> = kept.iter().map(|own| own[axis].abs()).collect();
        if sizes.is_empty() { 0.0 } else { OF_MEDIAN * median(&sizes) }
    };
    let usual = Vector3::from_fn(|axis, _| usual(axis));
    let lost = found.iter().filter(is_control).filter(is_lost).map(|point| {
        let own = &block.surveyed[point.point.index()];
        let [xy, z] =
            [own.sigma_xy.unwrap_or(block.sigma.control_xy_m), own.sigma_z.unwrap_or(block.sigma.control_z_m)];
        let of_marks = |axis: usize| point.covariance[(axis, axis)].sqrt();
        let stated = Vector3::new(xy, xy, z);
        let deviation = Vector3::from_fn(|axis, _| stated[axis].max(usual[axis]).hypot(of_marks(axis)));
        Lost { name: own.name.clone(), recorded: own.position, computed: point.position, deviation }
    });
    judge(&lost.collect::<Vec<_>>(), alpha)
}
