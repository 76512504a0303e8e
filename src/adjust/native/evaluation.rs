//! Residuals, Jacobian and reduced normal equations at a state, in the layout that the other solver reports too.

use super::frames;
use super::structure::Structure;
use super::system::System;
use crate::adjust::{AdjustError, Evaluation, ReducedSystem};
use crate::camera::PARAMETER_COUNT;
use crate::effects::ImageContext;
use crate::measure::{self, MeasureError, Prediction};
use crate::problem::{Problem, State};
use nalgebra::DMatrix;

/// Collects rows of the Jacobian, free unknowns alone.
struct Rows<'a> {
    free: &'a [bool],
    evaluation: Evaluation,
}

impl Rows<'_> {
    fn push(&mut self, residual: f64, entries: impl IntoIterator<Item = (usize, f64)>) {
        let start = self.evaluation.columns.len();
        self.evaluation.residuals.push(residual);
        let mut row: Vec<(usize, f64)> = entries.into_iter().filter(|(column, _)| self.free[*column]).collect();
        row.sort_by_key(|(column, _)| *column);
        for (column, value) in row {
            // Two local parameters never share an unknown, but a camera's pp takes dc's share already.
            self.evaluation.columns.push(column);
            self.evaluation.values.push(value);
        }
        debug_assert!(self.evaluation.columns[start..].windows(2).all(|pair| pair[0] < pair[1]));
        self.evaluation.row_start.push(self.evaluation.columns.len());
    }
}

/// Residuals and Jacobian, robust loss not applied.
pub fn evaluate(problem: &Problem, structure: &Structure, state: &State) -> Result<Evaluation, AdjustError> {
    let layout = problem.layout();
    let free = problem.free();
    let stages = &structure.stages;
    let frames = frames(problem, structure, state)?;
    let evaluation = Evaluation { residuals: vec![], row_start: vec![0], columns: vec![], values: vec![] };
    let mut rows = Rows { free: &free, evaluation };
    let mut p = Prediction::default();
    for j in 0..layout.points {
        for observation in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
            let image = observation.image as usize;
            let camera = problem.image_contexts[image].camera as usize;
            measure::predict(problem, stages, &frames[image], image, &state.points[j], &mut p)
                .ok_or_else(|| MeasureError::image_point(problem, j, image))?;
            let thetas = stages.theta_indices(problem, image);
            let weight = observation.inverse_sigma;
            for (i, observed) in [observation.x, observation.y].into_iter().enumerate() {
                let entries = (0..PARAMETER_COUNT)
                    .map(|k| (layout.camera(camera, k), p.d_camera[i][k]))
                    .chain(thetas.iter().zip(&p.d_theta[i]).map(|(t, d)| (layout.theta(*t), *d)))
                    .chain((0..6).map(|k| (layout.pose(image, k), p.d_pose[i][k])))
                    .chain((0..3).map(|k| (layout.point(j, k), p.d_point[i][k])));
                rows.push((observed - p.point[i]) * weight, entries.map(|(column, d)| (column, -d * weight)));
            }
        }
    }
    for observation in &problem.control {
        let j = observation.index as usize;
        let p = measure::predict_surveyed(problem, stages, &state.theta, &state.points[j])
            .ok_or_else(|| MeasureError::surveyed(problem, j))?;
        let thetas: Vec<usize> = problem
            .effects
            .iter()
            .flat_map(|e| (0..e.slots.len()).map(move |k| e.theta_index(k, &ImageContext::default())))
            .collect();
        for i in 0..3 {
            let weight = 1.0 / observation.sigma[i];
            let entries = thetas
                .iter()
                .zip(&p.d_theta)
                .filter(|(_, d)| **d != [0.0; 3])
                .map(|(t, d)| (layout.theta(*t), d[i]))
                .chain((0..3).map(|k| (layout.point(j, k), p.derivative[(i, 3 + k)])));
            let residual = (observation.position[i] - p.position[i]) * weight;
            rows.push(residual, entries.map(|(column, d)| (column, -d * weight)));
        }
    }
    for observation in &problem.gnss {
        let image = observation.index as usize;
        let p = measure::predict_antenna(problem, stages, &frames[image], image)
            .ok_or_else(|| MeasureError::antenna(problem, image))?;
        let thetas = stages.theta_indices(problem, image);
        for i in 0..3 {
            let weight = 1.0 / observation.sigma[i];
            let entries = thetas
                .iter()
                .zip(&p.d_theta)
                .filter(|(_, d)| **d != [0.0; 3])
                .map(|(t, d)| (layout.theta(*t), d[i]))
                .chain((0..6).map(|k| (layout.pose(image, k), p.derivative[(i, k)])));
            let residual = (observation.position[i] - p.position[i]) * weight;
            rows.push(residual, entries.map(|(column, d)| (column, -d * weight)));
        }
    }
    for (t, entry) in problem.theta.iter().enumerate() {
        if let Some(sigma) = entry.prior_sigma {
            rows.push((entry.prior_mean - state.theta[t]) / sigma, [(layout.theta(t), -1.0 / sigma)]);
        }
    }
    for prior in &problem.camera_priors {
        let (c, k) = (prior.camera as usize, prior.parameter as usize);
        rows.push((prior.value - state.interiors[c][k]) / prior.sigma, [(layout.camera(c, k), -1.0 / prior.sigma)]);
    }
    Ok(rows.evaluation)
}

/// The reduced system as a dense matrix of raw unknowns.
pub fn reduced(structure: &Structure, system: &System) -> ReducedSystem {
    let dim = structure.dim;
    // Position of each unknown in the system: image unknowns first, then the border.
    let n = structure.images * dim;
    let mut members: Vec<(usize, usize, f64)> = structure
        .image_unknowns
        .iter()
        .enumerate()
        .filter(|(_, unknown)| **unknown != usize::MAX)
        .map(|(position, unknown)| (*unknown, position, structure.image_scales[position]))
        .chain(
            structure
                .border
                .iter()
                .enumerate()
                .map(|(column, unknown)| (*unknown, n + column, structure.border_scale[column])),
        )
        .collect();
    members.sort_by_key(|member| member.0);
    let m = structure.border.len();
    let mut full = DMatrix::<f64>::zeros(n + m, n + m);
    for a in 0..structure.images {
        for slot in structure.row_start[a]..structure.row_start[a + 1] {
            let b = structure.slot_column[slot] as usize;
            for k in 0..dim {
                for l in if a == b { k } else { 0 }..dim {
                    let value = system.block(slot, dim, k, l);
                    full[(a * dim + k, b * dim + l)] = value;
                    full[(b * dim + l, a * dim + k)] = value;
                }
            }
        }
    }
    for i in 0..n {
        for j in 0..m {
            full[(i, n + j)] = system.strip(i, j);
            full[(n + j, i)] = system.strip(i, j);
        }
    }
    for i in 0..m {
        for j in i..m {
            full[(n + i, n + j)] = system.border(i, j);
            full[(n + j, n + i)] = system.border(i, j);
        }
    }
    let rhs =
        |position: usize| if position < n { system.rhs_images[position] } else { system.rhs_border[position - n] };
    ReducedSystem {
        unknowns: members.iter().map(|member| member.0).collect(),
        matrix: DMatrix::from_fn(members.len(), members.len(), |i, j| {
            full[(members[i].1, members[j].1)] / (members[i].2 * members[j].2)
        }),
        gradient: members.iter().map(|(_, position, scale)| -rhs(*position) / scale).collect(),
    }
}
