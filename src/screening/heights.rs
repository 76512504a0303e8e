//! The value of a height offset against GNSS positions. A free network is a little bent; the positions hold it
//! straight, and then it is known better.

use super::network::network_by_gnss;
use crate::adjust::Options;
use crate::block::{Block, Role};
use crate::evaluate::intersection::{Method, intersect_surveyed};
use crate::math::statistics::{mad, median};
use crate::measure::Predictor;
use crate::mistakes::{Focal, Mistake, Subject, Survey, with_value};
use crate::model::Model;
use crate::run::FittedModel;

/// Share by which a better value differs from the first one at most: beyond, the positions bend the block instead.
const DIFFERS: f64 = 0.1;
/// Standard deviation of a median in those of a mean.
const OF_MEDIAN: f64 = 1.2533;
/// Standard deviation of a normal sample in its median absolute deviation.
const OF_MAD: f64 = 1.4826;

/// The same mistakes, height offsets between points and GNSS positions with their better value.
pub fn refined(found: Vec<Mistake>, block: &Block, model: &Model, survey: &Survey, options: &Options) -> Vec<Mistake> {
    let is_of_gnss =
        |own: &Mistake| own.kind == "height-offset" && own.mend.iter().any(|edit| edit.file == "images.csv");
    if !found.iter().any(is_of_gnss) {
        return found;
    }
    let Some(fit) = network_by_gnss(block, model, survey.focal, options) else { return found };
    let Ok(predictor) = Predictor::new(&fit.problem, &fit.solution.state) else { return found };
    let points = intersect_surveyed(&FittedModel { predictor }, block, Method::Image).points;
    let better = |own: Mistake| -> Mistake {
        let role = if own.subject == Subject::Check.key() { Role::Check } else { Role::Control };
        let of_role = points.iter().filter(|point| block.surveyed[point.point.index()].role == role);
        let (offsets, variances): (Vec<f64>, Vec<f64>) = of_role
            .map(|point| (block.surveyed[point.point.index()].position.z - point.position.z, point.covariance[(2, 2)]))
            .unzip();
        let (Some(first), false) = (own.value.filter(|_| is_of_gnss(&own)), offsets.is_empty()) else { return own };
        let value = median(&offsets);
        let count = offsets.len() as f64;
        // As they spread, and never less than their rays say: of one or two points nothing spreads.
        let variance = (OF_MAD * mad(&offsets)).powi(2).max(median(&variances));
        let sigma = OF_MEDIAN * variance.sqrt() / count.sqrt();
        let focal = (survey.focal == Focal::Stated).then(|| value.abs() / survey.distance);
        match (value - first).abs() <= DIFFERS * first.abs() {
            // What camera and network leave open stands in the first one.
            true => with_value(&own, value, sigma.max(own.sigma.unwrap_or(0.0)), focal),
            false => own,
        }
    };
    found.into_iter().map(better).collect()
}
