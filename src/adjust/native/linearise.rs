//! One fused pass over the points: linearise, eliminate the point, add to the reduced system. No Jacobian is stored.

use super::MAX_DIM;
use super::columns::Columns;
use super::eliminate::{BorderSums, Eliminate};
use super::in_order::add_in_order;
use super::loss::Curvature;
use super::point::{ControlRows, PointRows, Prepared, inverse_of_damped};
use super::rows::{Rows, batches};
use super::side_by_side::Workspace;
use super::spare::Spare;
use super::structure::{FIRST_THETA, Structure};
use super::system::System;
use crate::adjust::AdjustError;
use crate::math::vectors::dispatch;
use crate::measure::{self, MeasureError};
use crate::problem::Problem;
use nalgebra::Matrix3;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Reduced system at a prepared state, the points damped by `damping` times their own diagonal. Errors: an observation
/// that cannot be computed; a point that its rays do not fix.
pub fn linearise(at: &Prepared<'_>, damping: f64, curvature: Curvature, spare: &Spare) -> Result<System, AdjustError> {
    let structure = at.structure;
    let chunk = |number: usize, part: &mut System| match structure.dim {
        6 => add_chunk::<6>(at, number, damping, curvature, part),
        7 => add_chunk::<7>(at, number, damping, curvature, part),
        8 => add_chunk::<8>(at, number, damping, curvature, part),
        _ => add_chunk::<MAX_DIM>(at, number, damping, curvature, part),
    };
    let mut total = spare.take().unwrap_or_else(|| System::zeros(structure, 0..0));
    total.restart(structure, 0..structure.images);
    // A private system each, added in the order of the chunks, so that the sum is the same for every number of threads.
    let (count, room) = (structure.chunks.len(), || System::zeros(structure, structure.largest_part()));
    add_in_order(count, &spare.parts, room, chunk, |part| total.add(structure, part))?;
    for row in position_rows(at)? {
        let image = row.image.as_ref().map(|(rank, row)| (*rank, row.as_slice()));
        total.add_row(structure, image, &row.shared, row.v);
    }
    Ok(total)
}

/// The points of a chunk, in `system`, which starts anew.
fn add_chunk<const D: usize>(
    at: &Prepared<'_>,
    number: usize,
    damping: f64,
    curvature: Curvature,
    system: &mut System,
) -> Result<(), AdjustError> {
    let points = at.structure.chunks[number].clone();
    system.restart(at.structure, at.structure.chunk_ranks[number].clone());
    match at.structure.wide_border() {
        false => add_narrow::<D>(at, points, damping, curvature, system),
        true => add_wide::<D>(at, points, damping, curvature, system),
    }
}

/// Every row holds all columns of the border.
fn add_narrow<const D: usize>(
    at: &Prepared<'_>,
    points: Range<usize>,
    damping: f64,
    curvature: Curvature,
    system: &mut System,
) -> Result<(), AdjustError> {
    let structure = at.structure;
    let mut sums = BorderSums::zeros(structure, system.rows.len());
    let (mut rows, mut work) = (Rows::new(structure, curvature), Workspace::new(&structure.stages));
    for batch in batches(at.problem, &points) {
        rows.fill(at, batch, &mut work)?;
        let (rows, sums) = (&rows, &mut sums);
        dispatch(Eliminate::<D> { structure, rows, damping, sums, system })
            .map_err(|j| rays_do_not_meet(at.problem, j))?;
    }
    sums.finish(structure, system);
    Ok(())
}

/// Rows hold the columns of the border that they touch.
fn add_wide<const D: usize>(
    at: &Prepared<'_>,
    points: Range<usize>,
    damping: f64,
    curvature: Curvature,
    system: &mut System,
) -> Result<(), AdjustError> {
    let structure = at.structure;
    let mut rows = PointRows::<D>::with(curvature);
    for j in points {
        rows.linearise(at, j)?;
        let inverse = inverse_of_damped(&rows.v_matrix, damping).ok_or_else(|| rays_do_not_meet(at.problem, j))?;
        dispatch(EliminatePoint { structure, system, rows: &mut rows, inverse: &inverse });
    }
    Ok(())
}

/// The rays of point `j` do not fix it.
pub fn rays_do_not_meet(problem: &Problem, j: usize) -> AdjustError {
    AdjustError::RaysDoNotMeet { solver: super::NAME, point: problem.point_names[j].clone() }
}

/// Adds a point's rows and takes the point out: `S += J'J - W V^-1 W'`, `b += J'v - W V^-1 g`.
struct EliminatePoint<'a, const D: usize> {
    structure: &'a Structure,
    system: &'a mut System,
    rows: &'a mut PointRows<D>,
    inverse: &'a Matrix3<f64>,
}

impl<const D: usize> WithSimd for EliminatePoint<'_, D> {
    type Output = ();

    /// Compiled for the widest vectors that the processor has; the sums are the same with any.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        eliminate(self.structure, self.system, self.rows, self.inverse);
    }
}

#[inline(always)]
fn eliminate<const D: usize>(
    structure: &Structure,
    system: &mut System,
    rows: &mut PointRows<D>,
    inverse: &Matrix3<f64>,
) {
    let (border, stride) = (structure.border.len(), structure.stride);
    let solved = inverse * rows.gradient;
    system.chi_square += rows.chi_square;
    system.decrement_points += solved.dot(&rows.gradient);
    system.gradient_points_max = system.gradient_points_max.max(rows.gradient.amax());
    let (columns, w_shared) = (&rows.columns, &rows.w_shared);
    for (row, shared) in rows.rows.iter_mut().zip(&rows.shared) {
        for k in 0..D {
            for a in 0..3 {
                row.y[k][a] =
                    row.w[k][0] * inverse[(0, a)] + row.w[k][1] * inverse[(1, a)] + row.w[k][2] * inverse[(2, a)];
            }
        }
        let i = row.rank as usize - system.rows.start;
        let slot = structure.row_start[row.rank as usize] - system.first_slot;
        let block = &mut system.blocks[slot * D * stride..(slot + 1) * D * stride];
        for k in 0..D {
            let (x, y) = (row.image[0][k], row.image[1][k]);
            for l in 0..D {
                block[k * stride + l] += x * row.image[0][l] + y * row.image[1][l];
            }
            let g = x * row.v[0] + y * row.v[1];
            system.gradient_images[i * D + k] += g;
            system.rhs_images[i * D + k] +=
                g - (row.w[k][0] * solved[0] + row.w[k][1] * solved[1] + row.w[k][2] * solved[2]);
            system.diagonal_images[i * D + k] += x * x + y * y;
            let strip = &mut system.strip[(i * D + k) * border..(i * D + k + 1) * border];
            shared.columns.add_two(strip, [x, y], &shared.x, &shared.y);
            columns.take_three(strip, row.y[k], w_shared);
        }
        add_shared(system, border, &shared.columns, [&shared.x, &shared.y], row.v);
    }
    if let Some(ControlRows { columns, shared: [x, y, z], v, .. }) = &rows.control {
        let nothing = vec![0.0; columns.len()];
        add_shared(system, border, columns, [x, y], [v[0], v[1]]);
        add_shared(system, border, columns, [z, &nothing], [v[2], 0.0]);
    }
    for (a, row) in rows.rows.iter().enumerate() {
        for other in &rows.rows[a..] {
            let slot = structure.slot(row.rank, other.rank) - system.first_slot;
            let block = &mut system.blocks[slot * D * stride..(slot + 1) * D * stride];
            for k in 0..D {
                let [y0, y1, y2] = row.y[k];
                for l in 0..D {
                    let w = &other.w[l];
                    block[k * stride + l] -= y0 * w[0] + y1 * w[1] + y2 * w[2];
                }
            }
        }
    }
    rows.y_shared.clear();
    for (l, column) in columns.index().iter().enumerate() {
        let w: [f64; 3] = std::array::from_fn(|a| w_shared[a][l]);
        system.rhs_border[*column as usize] -= w[0] * solved[0] + w[1] * solved[1] + w[2] * solved[2];
        rows.y_shared
            .push(std::array::from_fn(|a| w[0] * inverse[(0, a)] + w[1] * inverse[(1, a)] + w[2] * inverse[(2, a)]));
    }
    columns.take_outer(&mut system.border, border, &rows.y_shared, w_shared);
}

/// Adds the outer product of two rows `x`, `y` over the border, with misclosures `v`.
#[inline(always)]
fn add_shared(system: &mut System, border: usize, columns: &Columns, [x, y]: [&[f64]; 2], v: [f64; 2]) {
    columns.add_outer(&mut system.border, border, x, y);
    for ((column, x), y) in columns.index().iter().zip(x).zip(y) {
        let column = *column as usize;
        let g = x * v[0] + y * v[1];
        system.gradient_border[column] += g;
        system.rhs_border[column] += g;
        system.diagonal_border[column] += x * x + y * y;
    }
}

/// A row of the design matrix that touches no point: a GNSS coordinate or a prior.
#[derive(Debug, Clone)]
pub struct PlainRow {
    /// Rank of its image and derivatives by the image's unknowns.
    pub image: Option<(usize, Vec<f64>)>,
    /// Border columns and derivatives, ascending.
    pub shared: Vec<(u32, f64)>,
    /// Weighted misclosure.
    pub v: f64,
}

/// Rows of the GNSS positions and of the priors.
pub fn position_rows(at: &Prepared<'_>) -> Result<Vec<PlainRow>, MeasureError> {
    let mut rows = Vec::new();
    gnss_rows(at, &mut rows)?;
    rows.extend(prior_rows(at));
    Ok(rows)
}

fn gnss_rows(at: &Prepared<'_>, rows: &mut Vec<PlainRow>) -> Result<(), MeasureError> {
    let Prepared { problem, structure, frames, .. } = at;
    for observation in &problem.gnss {
        let image = observation.index as usize;
        let p = measure::predict_antenna(problem, &structure.stages, &frames[image], image)
            .ok_or_else(|| MeasureError::antenna(problem, image))?;
        let rank = structure.rank[image] as usize;
        for i in 0..3 {
            let weight = 1.0 / observation.sigma[i];
            let mut row = vec![0.0; structure.dim];
            for k in 0..6 {
                if structure.image_unknowns[rank * structure.dim + k] != usize::MAX {
                    row[k] = p.derivative[(i, k)] * weight;
                }
            }
            for column in &structure.own[image] {
                row[column.row as usize] = p.d_theta[column.source as usize][i] * weight * column.scale;
            }
            let shared: Vec<(u32, f64)> = structure.local[image]
                .iter()
                .filter(|column| column.source >= FIRST_THETA)
                .map(|column| {
                    (column.column, p.d_theta[(column.source - FIRST_THETA) as usize][i] * weight * column.scale)
                })
                .filter(|(_, value)| *value != 0.0)
                .collect();
            let v = (observation.position[i] - p.position[i]) * weight;
            rows.push(PlainRow { image: Some((rank, row)), shared, v });
        }
    }
    Ok(())
}

/// Priors of effect parameters and of camera parameters; those of held values too, without derivatives.
pub fn prior_rows(at: &Prepared<'_>) -> Vec<PlainRow> {
    let Prepared { problem, structure, state, .. } = at;
    let mut rows = Vec::new();
    let layout = problem.layout();
    let shared_entry = |unknown: usize, sigma: f64| match structure.border.binary_search(&unknown) {
        Ok(column) => vec![(column as u32, structure.border_scale[column] / sigma)],
        Err(_) => Vec::new(),
    };
    for (t, entry) in problem.theta.iter().enumerate() {
        let Some(sigma) = entry.prior_sigma else { continue };
        let v = (entry.prior_mean - state.theta[t]) / sigma;
        let unknown = layout.theta(t);
        let image = structure.image_position(unknown, entry.instance as usize).map(|(rank, k)| {
            let mut row = vec![0.0; structure.dim];
            row[k] = structure.image_scales[rank * structure.dim + k] / sigma;
            (rank, row)
        });
        rows.push(PlainRow { image, shared: shared_entry(unknown, sigma), v });
    }
    for prior in &problem.camera_priors {
        let (c, k) = (prior.camera as usize, prior.parameter as usize);
        let v = (prior.value - state.interiors[c][k]) / prior.sigma;
        rows.push(PlainRow { image: None, shared: shared_entry(layout.camera(c, k), prior.sigma), v });
    }
    rows
}

/// `sum rho` of everything that is not a point's: GNSS and priors.
pub fn chi_square_beside_points(at: &Prepared<'_>) -> Result<f64, MeasureError> {
    let Prepared { problem, structure, state, frames } = at;
    let mut sum = 0.0;
    for observation in &problem.gnss {
        let image = observation.index as usize;
        let p = measure::predict_antenna(problem, &structure.stages, &frames[image], image)
            .ok_or_else(|| MeasureError::antenna(problem, image))?;
        sum += (observation.position - p.position).component_div(&observation.sigma).norm_squared();
    }
    for (t, entry) in problem.theta.iter().enumerate() {
        if let Some(sigma) = entry.prior_sigma {
            sum += ((entry.prior_mean - state.theta[t]) / sigma).powi(2);
        }
    }
    for prior in &problem.camera_priors {
        let value = state.interiors[prior.camera as usize][prior.parameter as usize];
        sum += ((prior.value - value) / prior.sigma).powi(2);
    }
    Ok(sum)
}
