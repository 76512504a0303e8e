//! What the neighbours of a measurement in its image say of it: an effect that the model lacks moves them together, an
//! outlier stands alone.

use super::point::{Intersected, SeenPoint};
use super::sight::Sight;
use crate::block::neighbours::Neighbours;
use crate::math::statistics::median;
use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;

/// Neighbours that a measurement is judged against.
const NEIGHBOURS: usize = 12;
/// Neighbours below which it is judged by itself alone.
const FEWEST_NEIGHBOURS: usize = 4;
/// Steps of the robust mean over the neighbours.
const REWEIGHTINGS: usize = 5;
/// Standardised difference at which a neighbour counts half.
const HALF_WEIGHT: f64 = 3.0;

/// Gives every measurement of some `points` the robust mean displacement of its neighbours: the `d` that `R_k d` fits
/// their residuals best.
pub(super) fn judge_neighbours(sight: &Sight, points: &mut [SeenPoint], variance: f64) {
    if points.is_empty() {
        return;
    }
    let mut is_asked = vec![false; sight.images()];
    points.iter().flat_map(|point| &point.seen).for_each(|seen| is_asked[seen.row.image.index()] = true);
    let takes_part = |k: &usize| is_asked[sight.row(*k).image.index()] && sight.point_of(*k).is_some();
    // Those left out look for neighbours too, but are none.
    let (active, outside): (Vec<usize>, Vec<usize>) =
        (0..sight.measurements()).filter(takes_part).partition(|k| sight.is_in(*k));
    let order: Vec<usize> = active.into_iter().chain(outside).collect();
    let place = |k: &usize| {
        let row = sight.row(*k);
        (row.image.index(), [row.x, row.y])
    };
    let near = Neighbours::new(order.iter().map(place), sight.images());
    let mut positions = vec![0; sight.measurements()];
    order.iter().enumerate().for_each(|(position, k)| positions[*k] = position as u32);
    let judged: Vec<usize> = points.iter().flat_map(|point| &point.seen).map(|seen| seen.number).collect();
    let around: Vec<Vec<usize>> = judged
        .par_iter()
        .map(|k| {
            let own = sight.point_of(*k);
            let others = near.nearest(positions[*k] as usize, NEIGHBOURS).map(|other| order[other]);
            others.filter(|other| sight.point_of(*other) != own && sight.is_in(*other)).collect()
        })
        .collect();
    let mut asked: Vec<usize> = around.iter().flatten().filter_map(|k| sight.point_of(*k)).collect();
    asked.sort_unstable();
    asked.dedup();
    let of_point = |j: &usize| -> Vec<(usize, Intersected)> {
        let point = sight.point(*j);
        point.intersected().map(|(k, local)| (point.seen[k].number, local)).collect()
    };
    let known: Vec<Vec<(usize, Intersected)>> = asked.par_iter().map(of_point).collect();
    let intersected = |k: &usize| {
        let of_point = asked.binary_search(&sight.point_of(*k)?).ok()?;
        known[of_point].iter().find(|(number, _)| number == k).map(|(_, local)| *local)
    };
    let displacement = |around: &Vec<usize>| {
        let around: Vec<Intersected> = around.iter().filter_map(intersected).collect();
        robust_displacement(&around, variance)
    };
    let displacements: Vec<Option<Vector2<f64>>> = around.par_iter().map(displacement).collect();
    for (seen, displacement) in points.iter_mut().flat_map(|point| &mut point.seen).zip(displacements) {
        seen.neighbours = displacement;
    }
}

/// Iteratively reweighted, from the medians of the components.
fn robust_displacement(around: &[Intersected], variance: f64) -> Option<Vector2<f64>> {
    if around.len() < FEWEST_NEIGHBOURS {
        return None;
    }
    let component = |k: usize| -> f64 { median(&around.iter().map(|local| local.residual[k]).collect::<Vec<_>>()) };
    let mean = around.iter().map(|local| local.redundancy).sum::<Matrix2<f64>>() / around.len() as f64;
    let mut displacement = mean.try_inverse()? * Vector2::new(component(0), component(1));
    for _ in 0..REWEIGHTINGS {
        let (mut normal, mut sum) = (Matrix2::zeros(), Vector2::zeros());
        for Intersected { residual, redundancy, weight } in around {
            let apart = weight.map_or(0.0, |weight| weight.verdict(residual - redundancy * displacement).statistic);
            let weight = 1.0 / (1.0 + apart / (variance * HALF_WEIGHT * HALF_WEIGHT));
            normal += redundancy * weight;
            sum += residual * weight;
        }
        displacement = normal.try_inverse()? * sum;
    }
    Some(displacement)
}
