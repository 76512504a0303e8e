//! Do measurements that are close to each other in an image err together?
//!
//! `I = sum v_i . v_k` over near neighbours of different points (Moran's statistic without its normalisation). Under the null the points are
//! independent, so the products of one pair of points, summed over all images in which they are neighbours, have the expectation
//! that the fit of the pose leaves, no correlation with those of other pairs, and the variance of their own squares: flipping
//! the signs of whole points changes nothing. The expectation is taken from each image's own pose, known from its measurements and its
//! antenna, with the rest held, which is nearer to zero than the true one: a one-sided test is on the safe side.

use super::asked::Tested;
use super::context::Context;
use super::found::Found;
use crate::diagnose::neighbours::Neighbours;
use crate::math::statistics::{normal_ln_sf, normal_sf};
use nalgebra::{Matrix2x6, Matrix6};

/// Neighbours of each measurement.
const NEIGHBOURS: usize = 4;
/// Pairs of points below which the sum is not normal.
const LEAST: usize = 100;

pub(super) fn test(context: &Context<'_>, found: &mut Found) {
    let problem = context.problem;
    let (n, images) = (problem.observations.len(), problem.image_contexts.len());
    let mut owner = vec![0u32; n];
    for j in 0..problem.point_sources.len() {
        owner[problem.point_start[j]..problem.point_start[j + 1]].fill(j as u32);
    }
    // How the pose of its own image moves each measurement once the point has followed.
    let mut normal = context.antenna_normals.clone();
    let moved = |k: usize| -> Matrix2x6<f64> { context.measurements[k].redundancy * context.measurements[k].by_pose };
    let image_of = |k: usize| problem.observations[k].image as usize;
    for (k, local) in context.measurements.iter().enumerate() {
        normal[image_of(k)] += local.by_pose.transpose() * moved(k);
    }
    let covariance: Vec<Matrix6<f64>> =
        normal.iter().map(|normal| normal.try_inverse().unwrap_or_else(Matrix6::zeros)).collect();
    let variance = context.variance();
    let seen = Neighbours::new((0..n).map(|k| (image_of(k), context.measurements[k].predicted)), images);
    let mut pairs: Vec<(u32, u32, f64)> = Vec::new();
    for k in 0..n {
        let image = image_of(k);
        let weight = problem.observations[k].inverse_sigma;
        let pulled = moved(k) * covariance[image];
        for other in seen.nearest(k, NEIGHBOURS) {
            if owner[other] == owner[k] {
                continue;
            }
            let (a, b) = (context.measurements[k].residual, context.measurements[other].residual);
            let product = (a[0] * b[0] + a[1] * b[1]) * weight * problem.observations[other].inverse_sigma;
            let expected = -variance * (pulled * moved(other).transpose()).trace();
            pairs.push((owner[k].min(owner[other]), owner[k].max(owner[other]), product - expected));
        }
    }
    pairs.sort_unstable_by_key(|pair| (pair.0, pair.1));
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0usize);
    for pair in pairs.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let part: f64 = pair.iter().map(|(.., product)| product).sum();
        sum += part;
        squares += part * part;
        count += 1;
    }
    if count < LEAST || squares == 0.0 {
        return found.skip("autocorrelation", "too few neighbours");
    }
    let z = sum / squares.sqrt();
    let mean_square = context.noise.sum_of_squares / n as f64; // of the length of a residual
    let correlation = sum / pairs.len() as f64 / mean_square;
    let tested = Tested { statistic: z, dof: 1, p_value: normal_sf(z), ln_p_value: normal_ln_sf(z) };
    let description = format!(
        "correlation {correlation:.3} beyond that of the fit between each measurement and its {NEIGHBOURS} nearest neighbours in the image"
    );
    found.push("autocorrelation", Some(tested), description);
}
