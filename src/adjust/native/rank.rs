//! Rank of a system: which directions the measurements do not determine, by name.

use super::factor::{Breakdown, Factor, ReducedBorder};
use super::pattern::Pattern;
use super::structure::Structure;
use super::system::System;
use crate::adjust::{AdjustError, NullDirection};
use crate::problem::Problem;
use nalgebra::{DMatrix, SymmetricEigen};

/// An effect parameter that is known to no better than this many times its typical size is not determined.
pub const EFFECT_DOMAIN: f64 = 1000.0;

/// Components of a null direction below this share of the largest are not named.
const NAMED_SHARE: f64 = 0.1;

/// Null directions among the shared unknowns. `information` is their Schur complement in scaled units; scaled again by
/// the domain of each unknown, an eigenvalue below one says that along its direction a standard deviation (unit weight)
/// exceeds the domain.
fn shared_null_space(
    problem: &Problem,
    unknowns: &[usize],
    scales: &[f64],
    information: &DMatrix<f64>,
) -> Vec<NullDirection> {
    if unknowns.is_empty() {
        return Vec::new();
    }
    // What is not a number has no eigenvalues: the unknowns that make it so are named.
    if information.iter().any(|value| !value.is_finite()) {
        let broken = (0..unknowns.len()).filter(|i| !information[(*i, *i)].is_finite());
        return broken.map(|i| NullDirection { components: vec![(problem.unknown_name(unknowns[i]), 1.0)] }).collect();
    }
    let domain: Vec<f64> = unknowns.iter().zip(scales).map(|(u, scale)| domain(problem, *u) / scale).collect();
    let scaled = DMatrix::from_fn(unknowns.len(), unknowns.len(), |i, j| information[(i, j)] * domain[i] * domain[j]);
    let eigen = SymmetricEigen::new(scaled);
    let mut order: Vec<usize> = (0..unknowns.len()).filter(|k| eigen.eigenvalues[*k] < 1.0).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    order
        .into_iter()
        .map(|k| {
            let vector = eigen.eigenvectors.column(k);
            let largest = vector.amax();
            let mut components: Vec<(String, f64)> = (0..unknowns.len())
                .filter(|i| vector[*i].abs() >= NAMED_SHARE * largest)
                .map(|i| (problem.unknown_name(unknowns[i]), vector[i]))
                .collect();
            components.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            NullDirection { components }
        })
        .collect()
}

/// Largest plausible range of a shared unknown, raw units.
fn domain(problem: &Problem, unknown: usize) -> f64 {
    let layout = problem.layout();
    match layout.camera_parameter(unknown) {
        Some((c, k)) => problem.camera_domains[c][k],
        None => EFFECT_DOMAIN * problem.theta[unknown - layout.theta(0)].scale,
    }
}

/// Factorises an undamped system. Errors: [`AdjustError::Singular`] with its null directions.
pub fn factor_of_full_rank(
    problem: &Problem,
    structure: &Structure,
    system: &System,
    pattern: Option<&Pattern>,
) -> Result<Factor, AdjustError> {
    let reduced = ReducedBorder::new(structure, system, pattern, 0.0);
    let directions = null_space(problem, structure, &reduced);
    match reduced.map(Factor::of) {
        Ok(Some(factor)) if directions.is_empty() => Ok(factor),
        _ => Err(AdjustError::Singular { solver: super::NAME, directions }),
    }
}

/// Null directions of an undamped reduced system; empty when it has full rank.
fn null_space(
    problem: &Problem,
    structure: &Structure,
    reduced: &Result<ReducedBorder, Breakdown>,
) -> Vec<NullDirection> {
    match reduced {
        Ok(reduced) => {
            let m = structure.border.len();
            let information =
                DMatrix::from_fn(m, m, |i, j| reduced.matrix[(i, j)] / (reduced.scale[i] * reduced.scale[j]));
            shared_null_space(problem, &structure.border, &structure.border_scale, &information)
        }
        Err(breakdown) => {
            let name = match breakdown {
                Breakdown::Images(position) => structure.image_unknowns.get(*position),
                Breakdown::Border => None,
            };
            let name = name.filter(|unknown| **unknown != usize::MAX);
            let name = name.map_or_else(|| "exterior orientation of some image".into(), |u| problem.unknown_name(*u));
            vec![NullDirection { components: vec![(name, 1.0)] }]
        }
    }
}
