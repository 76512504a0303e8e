//! The focal length that a camera starts with, judged before an adjustment by where its images stand: at a wrong one
//! the rays of tie points miss each other where images look in different directions or stand at different heights, and
//! marks of control points lie beside where antenna positions put them. Images that all look one way, with nothing to
//! say how high they stand, tell nothing, and neither do poses that are far off: that is said.

use super::multistart::{problem_of_what_meets, scaled_focal_lengths};
use super::start_values::Doubt;
use super::{RunError, default_diagnosis_datum};
use crate::block::Block;
use crate::camera::{F, Interior};
use crate::math::statistics::median;
use crate::measure::Predictor;
use crate::model::Model;
use crate::problem::MeasurementKind;

/// Factors on the focal length that are tried beside one. A lens has the focal length that is written on it within a
/// few per cent: what is nearer than the nearest is left to the adjustment, which finds it from there.
const FACTORS: [f64; 6] = [0.41, 0.51, 0.64, 1.56, 1.95, 2.44];
/// Tie points judged at most, spread over the block.
const MOST_POINTS: usize = 2000;
/// Measurements of a kind and a camera below which their median is none.
const FEWEST: usize = 10;
/// A misfit that is so many times less or more is no chance of poses that are off by metres and degrees: these put
/// every ray beside its point by an angle, which is in pixels as the focal length is, and the noise of the measurements
/// by pixels. Whichever is less in favour of another focal length counts.
const CLEARLY: f64 = 2.0;

/// What the start of a block says of the focal lengths of its cameras.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FocalLengths {
    /// Cameras whose rays meet clearly better at another one.
    pub doubts: Vec<Doubt>,
    /// Ids of the cameras of which nothing tells it, with a factor on it at which their rays meet about as well.
    pub untold: Vec<(String, f64)>,
}

/// Judges the focal lengths that `model` starts `block` with; `interiors` are what its cameras start at.
///
/// # Errors
/// A block of which no problem can be made at them.
pub fn focal_lengths(block: &Block, model: &Model, interiors: &[Interior]) -> Result<FocalLengths, RunError> {
    let step = block.tie_points.len().div_ceil(MOST_POINTS).max(1);
    let mut sample = block.clone();
    sample.ties.retain(|row| row.point.index() % step == 0);
    // Whatever says where images stand, also where the adjustment is to be free of it.
    let base = Model { datum: default_diagnosis_datum(block), effects: Vec::new(), ..model.clone() };
    let as_given = misfits(&sample, &base, 1.0)?;
    // At another focal length no two rays may meet at all: it is none then.
    let others: Vec<(f64, Vec<Misfit>)> =
        FACTORS.iter().filter_map(|factor| Some((*factor, misfits(&sample, &base, *factor).ok()?))).collect();
    let mut judged = FocalLengths::default();
    for (camera, given) in as_given.iter().enumerate() {
        if given.is_empty() {
            continue;
        }
        let times_worse = |(factor, misfits): &(f64, Vec<Misfit>)| (*factor, misfits[camera].times(given));
        let times: Vec<(f64, f64)> = others.iter().map(times_worse).collect();
        let id = &block.cameras[camera].id;
        // Control that stands elsewhere fits any focal length better than the right one, and tie points do not.
        let agreed = others.iter().filter(|(factor, misfits)| !misfits[camera].contradicts(given, *factor));
        let better = |(factor, misfits): &(f64, Vec<Misfit>)| (*factor, factor.min(1.0) / misfits[camera].times(given));
        let best = agreed.map(better).max_by(|(_, a), (_, b)| a.total_cmp(b));
        let not_clearly_worse = |(factor, worse): &(f64, f64)| worse * factor.recip().min(1.0) <= CLEARLY;
        let least = times.iter().copied().filter(not_clearly_worse).min_by(|(_, a), (_, b)| a.total_cmp(b));
        match best {
            Some((factor, times)) if times > CLEARLY => {
                let f = interiors[camera][F];
                judged.doubts.push(Doubt::FocalLength { camera: id.clone(), f, better: factor * f, times });
            }
            _ => judged.untold.extend(least.map(|(factor, _)| (id.clone(), factor))),
        }
    }
    Ok(judged)
}

/// Distances between where a camera's measurements are and where they should be at the start, px: the medians, which
/// blunders do not move, of tie points and marks.
struct Misfit([Option<f64>; 2]);

impl Misfit {
    fn is_empty(&self) -> bool {
        self.0 == [None; 2]
    }

    /// By how many times it is larger than `other`, tie points and marks together.
    fn times(&self, other: &Misfit) -> f64 {
        self.ratios(other).product()
    }

    fn ratios(&self, other: &Misfit) -> impl Iterator<Item = f64> {
        self.0.iter().zip(other.0).filter_map(|(own, other)| Some((*own)? / other?))
    }

    /// Is one kind of measurements, at `factor` times the focal length, clearly worse than `other`?
    fn contradicts(&self, other: &Misfit, factor: f64) -> bool {
        self.ratios(other).any(|worse| worse * factor.recip().min(1.0) > CLEARLY)
    }
}

/// Misfit of each camera at `factor` times the focal lengths of `model`.
fn misfits(block: &Block, model: &Model, factor: f64) -> Result<Vec<Misfit>, RunError> {
    let problem = problem_of_what_meets(block, &scaled_focal_lengths(block, model, factor))?;
    let predictor = Predictor::new(&problem, &problem.start)?;
    // What is not seen there misses by more than any.
    let mut missed = vec![[Vec::new(), Vec::new()]; block.cameras.len()];
    for (j, point) in problem.start.points.iter().enumerate() {
        for o in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
            let camera = problem.image_contexts[o.image as usize].camera as usize;
            let distance = predictor
                .image_point(o.image as usize, point)
                .map_or(f64::INFINITY, |([x, y], _)| (o.x - x).hypot(o.y - y).max(o.inverse_sigma.recip()));
            missed[camera][usize::from(o.kind == MeasurementKind::Mark)].push(distance);
        }
    }
    let median_of = |of: Vec<f64>| (of.len() >= FEWEST).then(|| median(&of));
    Ok(missed.into_iter().map(|kinds| Misfit(kinds.map(median_of))).collect())
}
