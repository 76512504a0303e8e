//! Do measurements that are close to each other in an image, or that are read one after another, err together?
//!
//! `I = sum v_i . v_k` over near neighbours of different points (Moran's statistic without its normalisation). Under
//! the null the points are independent, so the products of one pair of points, summed over all images in which they are
//! neighbours, have the expectation that the fit of the pose leaves, no correlation with those of other pairs, and the
//! variance of their own squares: flipping the signs of whole points changes nothing. The expectation is taken from
//! each image's own pose, known from its measurements and its antenna, with the rest held, which is nearer to zero than
//! the true one: a one-sided test is on the safe side.

use super::asked::Tested;
use super::context::Context;
use super::found::Found;
use crate::block::neighbours::Neighbours;
use crate::math::statistics::{normal_ln_sf, normal_sf};
use nalgebra::Matrix2x6;
use rayon::prelude::*;

/// Neighbours of each measurement.
const NEIGHBOURS: usize = 4;
/// Pairs of points below which the sum is not normal.
const LEAST: usize = 100;

/// Tests in the order in which they are made.
pub(super) const TESTS: [&str; 2] = ["autocorrelation", "row-autocorrelation"];

/// Tests neighbours on the sensor, and neighbours by row: a sensor that is read row by row takes these one after
/// another, wherever in the row they lie, so that what shakes while an image is read moves them alike.
pub(super) fn test(context: &Context<'_>, found: &mut Found) {
    let images = context.problem.image_contexts.len();
    let products = Products::new(context);
    let places = (0..context.measurements.len()).map(|k| (context.image(k), context.measurements[k].predicted));
    let (on_sensor, rows) = rayon::join(|| Neighbours::new(places, images), || Rows::new(context));
    let near = products.sum(|k| on_sensor.nearest(k, NEIGHBOURS));
    drop(on_sensor);
    let whose = format!("each measurement and its {NEIGHBOURS} nearest neighbours in the image");
    near.found(context, found, TESTS[0], &whose);
    let whose = format!("each measurement and the {NEIGHBOURS} that are next to it in the order of the image's rows");
    products.sum(|k| rows.beside(k)).found(context, found, TESTS[1], &whose);
}

/// Measurements in the order of images and rows.
struct Rows<'a> {
    context: &'a Context<'a>,
    order: Vec<u32>,
    position: Vec<u32>,
}

impl<'a> Rows<'a> {
    fn new(context: &'a Context<'a>) -> Self {
        let place = |k: usize| (context.image(k), context.measurements[k].predicted[1], k as u32);
        let mut places: Vec<(usize, f64, u32)> = (0..context.measurements.len()).map(place).collect();
        places.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        let order: Vec<u32> = places.into_iter().map(|(.., k)| k).collect();
        let mut position = vec![0; order.len()];
        for (place, k) in order.iter().enumerate() {
            position[*k as usize] = place as u32;
        }
        Self { context, order, position }
    }

    /// The measurements before and behind one in its image, [`NEIGHBOURS`] together.
    fn beside(&self, k: usize) -> impl Iterator<Item = usize> {
        let place = self.position[k] as usize;
        let near = place.saturating_sub(NEIGHBOURS / 2)..(place + NEIGHBOURS / 2 + 1).min(self.order.len());
        let others = near.filter(move |other| *other != place).map(|other| self.order[other] as usize);
        others.filter(move |other| self.context.image(*other) == self.context.image(k))
    }
}

/// Products of residuals, less what the fit of a pose leaves of them.
struct Products<'a> {
    context: &'a Context<'a>,
    /// Point of each measurement.
    owner: Vec<u32>,
}

impl<'a> Products<'a> {
    fn new(context: &'a Context<'a>) -> Self {
        let problem = context.problem;
        let mut owner = vec![0u32; problem.observations.len()];
        for j in 0..problem.point_sources.len() {
            owner[problem.point_start[j]..problem.point_start[j + 1]].fill(j as u32);
        }
        Self { context, owner }
    }

    /// Sums them over pairs of points, in an order that does not depend on the number of threads. Runs in the pool of
    /// its caller.
    fn sum<I: Iterator<Item = usize>>(&self, neighbours: impl Fn(usize) -> I + Sync) -> Sum {
        let Self { context, owner } = self;
        let observations = &context.problem.observations;
        let variance = context.variance();
        let of_one = |k: usize| {
            let pulled = moved(context, k) * context.pose_covariances[context.image(k)];
            let others = neighbours(k).filter(move |other| owner[*other] != owner[k]);
            others.map(move |other| {
                let (a, b) = (context.measurements[k].residual, context.measurements[other].residual);
                let weight = observations[k].inverse_sigma * observations[other].inverse_sigma;
                let expected = -variance * (pulled * moved(context, other).transpose()).trace();
                let product = (a[0] * b[0] + a[1] * b[1]) * weight - expected;
                let (first, second) = (owner[k].min(owner[other]), owner[k].max(owner[other]));
                (joined(first, second), joined(k as u32, other as u32), product)
            })
        };
        // Of two points, then of two of their measurements.
        let mut pairs: Vec<(u64, u64, f64)> = (0..observations.len()).into_par_iter().flat_map_iter(of_one).collect();
        // No two keys are the same: there is but one order.
        pairs.par_sort_unstable_by_key(|pair| (pair.0, pair.1));
        let mut sum = Sum { products: pairs.len(), ..Sum::default() };
        for pair in pairs.chunk_by(|a, b| a.0 == b.0) {
            let part: f64 = pair.iter().map(|(.., product)| product).sum();
            sum.sum += part;
            sum.squares += part * part;
            sum.pairs += 1;
        }
        sum
    }
}

/// Two numbers as one that is in their order.
fn joined(first: u32, second: u32) -> u64 {
    u64::from(first) << u32::BITS | u64::from(second)
}

/// How the pose of its own image moves a measurement once the point has followed.
fn moved(context: &Context<'_>, k: usize) -> Matrix2x6<f64> {
    context.measurements[k].redundancy * context.measurements[k].by_pose
}

/// Sums over pairs of points.
#[derive(Default)]
struct Sum {
    sum: f64,
    squares: f64,
    pairs: usize,
    products: usize,
}

impl Sum {
    fn found(&self, context: &Context<'_>, found: &mut Found, against: &'static str, whose: &str) {
        if self.pairs < LEAST || self.squares == 0.0 {
            return found.skip(against, "too few neighbours");
        }
        let z = self.sum / self.squares.sqrt();
        // Of the length of a residual.
        let mean_square = context.noise.sum_of_squares / context.measurements.len() as f64;
        let correlation = self.sum / self.products as f64 / mean_square;
        let tested = Tested { statistic: z, dof: 1, p_value: normal_sf(z), ln_p_value: normal_ln_sf(z) };
        found.push(
            against,
            Some(tested),
            format!("correlation {correlation:.3} beyond that of the fit between {whose}"),
        );
    }
}
