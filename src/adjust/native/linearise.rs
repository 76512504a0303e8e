//! One fused pass over the points: linearise, eliminate the point, add to the reduced system. No Jacobian is stored.

use super::point::{PointRows, Prepared, inverse_of_damped};
use super::position;
use super::structure::Structure;
use super::system::System;
use rayon::prelude::*;
use std::ops::Range;

/// Why a state cannot be linearised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Obstacle {
    /// Point that cannot be projected into the image.
    Projection {
        /// Position of the point.
        point: usize,
        /// Position of the image.
        image: usize,
    },
    /// Antenna position that cannot be computed.
    Antenna {
        /// Position of the image.
        image: usize,
    },
    /// The rays of a point do not fix it.
    Point {
        /// Position of the point.
        point: usize,
    },
}

/// Reduced system at a prepared state, the points damped by `damping` times their own diagonal.
pub fn linearise(at: &Prepared<'_>, damping: f64) -> Result<System, Obstacle> {
    match at.structure.dim {
        6 => linearise_with::<6>(at, damping),
        7 => linearise_with::<7>(at, damping),
        8 => linearise_with::<8>(at, damping),
        _ => linearise_with::<{ super::MAX_DIM }>(at, damping),
    }
}

fn linearise_with<const D: usize>(at: &Prepared<'_>, damping: f64) -> Result<System, Obstacle> {
    let structure = at.structure;
    let mut total = System::zeros(structure, 0..structure.images);
    // Waves of as many chunks as there are threads: a private system each, added in the order of the chunks, so that the sum is the
    // same for every number of threads.
    for wave in structure.chunks.chunks(rayon::current_num_threads().max(1)) {
        let parts: Vec<Result<System, Obstacle>> =
            wave.par_iter().map(|points| linearise_chunk::<D>(at, points.clone(), damping)).collect();
        for part in parts {
            total.add(structure, &part?);
        }
    }
    for row in position_rows(at)? {
        let image = row.image.as_ref().map(|(rank, row)| (*rank, row.as_slice()));
        total.add_row(structure, image, &row.shared, row.v);
    }
    Ok(total)
}

/// Ranks of the images that see the points.
fn ranks_of(at: &Prepared<'_>, points: &Range<usize>) -> Range<usize> {
    let starts = &at.problem.point_start;
    let observations = &at.problem.observations[starts[points.start]..starts[points.end]];
    let ranks = observations.iter().map(|o| at.structure.rank[o.image as usize] as usize);
    let first = ranks.clone().min().unwrap_or(0);
    first..ranks.max().map_or(first, |last| last + 1)
}

fn linearise_chunk<const D: usize>(at: &Prepared<'_>, points: Range<usize>, damping: f64) -> Result<System, Obstacle> {
    let structure = at.structure;
    let mut system = System::zeros(structure, ranks_of(at, &points));
    let mut rows = PointRows::<D>::new();
    for j in points {
        rows.linearise(at, j).map_err(|image| Obstacle::Projection { point: j, image })?;
        let inverse = inverse_of_damped(&rows.v_matrix, damping).ok_or(Obstacle::Point { point: j })?;
        eliminate(structure, &mut system, &mut rows, &inverse);
    }
    Ok(system)
}

/// A border up to this wide is summed whole; of a wider one (screening of many effects) only the columns that a point touches.
const WHOLE_BORDER: usize = 32;

/// `target[column of l] += value(l)` for `l` in `0..count`; the columns are `columns`, or `0..count` themselves.
#[inline]
fn add_to(target: &mut [f64], columns: Option<&[u32]>, count: usize, value: impl Fn(usize) -> f64) {
    match columns {
        None => {
            for (l, t) in target[..count].iter_mut().enumerate() {
                *t += value(l);
            }
        }
        Some(columns) => {
            for (l, column) in columns[..count].iter().enumerate() {
                target[*column as usize] += value(l);
            }
        }
    }
}

/// Adds a point's rows and takes the point out: `S += J'J - W V^-1 W'`, `b += J'v - W V^-1 g`.
fn eliminate<const D: usize>(
    structure: &Structure,
    system: &mut System,
    rows: &mut PointRows<D>,
    inverse: &nalgebra::Matrix3<f64>,
) {
    if structure.border.len() > WHOLE_BORDER {
        rows.keep_touched_columns();
        let touched = std::mem::take(&mut rows.touched);
        eliminate_columns(structure, system, rows, inverse, Some(&touched));
        rows.touched = touched;
    } else {
        eliminate_columns(structure, system, rows, inverse, None);
    }
}

/// [`eliminate`] with the border columns that `rows` holds: all, or `columns`.
fn eliminate_columns<const D: usize>(
    structure: &Structure,
    system: &mut System,
    rows: &mut PointRows<D>,
    inverse: &nalgebra::Matrix3<f64>,
    columns: Option<&[u32]>,
) {
    let border = structure.border.len();
    let n = columns.map_or(border, <[u32]>::len);
    let solved = inverse * rows.gradient;
    system.chi_square += rows.chi_square;
    system.gradient_points_max = system.gradient_points_max.max(rows.gradient.amax());
    let [w0, w1, w2] = &rows.w_shared;
    for (r, row) in rows.rows.iter_mut().enumerate() {
        for k in 0..D {
            for a in 0..3 {
                row.y[k][a] =
                    row.w[k][0] * inverse[(0, a)] + row.w[k][1] * inverse[(1, a)] + row.w[k][2] * inverse[(2, a)];
            }
        }
        let i = row.rank as usize - system.rows.start;
        let slot = structure.row_start[row.rank as usize] - system.first_slot;
        let block = &mut system.blocks[slot * D * D..(slot + 1) * D * D];
        let (shared_x, shared_y) = rows.shared[2 * n * r..2 * n * (r + 1)].split_at(n);
        for k in 0..D {
            let (x, y) = (row.image[0][k], row.image[1][k]);
            for l in 0..D {
                block[k * D + l] += x * row.image[0][l] + y * row.image[1][l];
            }
            let g = x * row.v[0] + y * row.v[1];
            system.gradient_images[i * D + k] += g;
            system.rhs_images[i * D + k] +=
                g - (row.w[k][0] * solved[0] + row.w[k][1] * solved[1] + row.w[k][2] * solved[2]);
            system.diagonal_images[i * D + k] += x * x + y * y;
            let [y0, y1, y2] = row.y[k];
            let strip = &mut system.strip[(i * D + k) * border..(i * D + k + 1) * border];
            add_to(strip, columns, n, |l| x * shared_x[l] + y * shared_y[l] - (y0 * w0[l] + y1 * w1[l] + y2 * w2[l]));
        }
        add_shared(system, border, columns, shared_x, row.v[0]);
        add_shared(system, border, columns, shared_y, row.v[1]);
    }
    if let Some(control) = &rows.control {
        for i in 0..3 {
            add_shared(system, border, columns, &control.shared[i * n..(i + 1) * n], control.v[i]);
        }
    }
    for (a, row) in rows.rows.iter().enumerate() {
        for other in &rows.rows[a..] {
            let slot = structure.slot(row.rank, other.rank) - system.first_slot;
            let block = &mut system.blocks[slot * D * D..(slot + 1) * D * D];
            for k in 0..D {
                let [y0, y1, y2] = row.y[k];
                for l in 0..D {
                    let w = &other.w[l];
                    block[k * D + l] -= y0 * w[0] + y1 * w[1] + y2 * w[2];
                }
            }
        }
    }
    for l in 0..n {
        let y: [f64; 3] =
            std::array::from_fn(|a| w0[l] * inverse[(0, a)] + w1[l] * inverse[(1, a)] + w2[l] * inverse[(2, a)]);
        if y == [0.0; 3] {
            continue;
        }
        let column = columns.map_or(l, |columns| columns[l] as usize);
        system.rhs_border[column] -= w0[l] * solved[0] + w1[l] * solved[1] + w2[l] * solved[2];
        let line = &mut system.border[column * border..(column + 1) * border];
        let first = if columns.is_some() { 0 } else { column };
        add_to(&mut line[first..], columns.map(|c| &c[l..]), n - l, |m| {
            -(y[0] * w0[l + m] + y[1] * w1[l + m] + y[2] * w2[l + m])
        });
    }
}

/// Adds one row's outer product over the border.
fn add_shared(system: &mut System, border: usize, columns: Option<&[u32]>, shared: &[f64], v: f64) {
    let n = shared.len();
    for l in 0..n {
        let a = shared[l];
        if a == 0.0 {
            continue;
        }
        let column = columns.map_or(l, |columns| columns[l] as usize);
        let line = &mut system.border[column * border..(column + 1) * border];
        let first = if columns.is_some() { 0 } else { column };
        add_to(&mut line[first..], columns.map(|c| &c[l..]), n - l, |m| a * shared[l + m]);
        system.gradient_border[column] += a * v;
        system.rhs_border[column] += a * v;
        system.diagonal_border[column] += a * a;
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
    /// Image that the row is counted to; the first where it has none.
    pub belongs_to: usize,
}

/// Rows of the GNSS positions and of the priors.
pub fn position_rows(at: &Prepared<'_>) -> Result<Vec<PlainRow>, Obstacle> {
    let mut rows = Vec::new();
    gnss_rows(at, &mut rows)?;
    prior_rows(at, &mut rows);
    Ok(rows)
}

fn gnss_rows(at: &Prepared<'_>, rows: &mut Vec<PlainRow>) -> Result<(), Obstacle> {
    let Prepared { problem, structure, frames, .. } = at;
    for observation in &problem.gnss {
        let image = observation.index as usize;
        let p = position::predict_antenna(problem, &structure.stages, &frames[image], image)
            .ok_or(Obstacle::Antenna { image })?;
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
                .filter(|column| column.source >= 12)
                .map(|column| (column.column, p.d_theta[column.source as usize - 12][i] * weight * column.scale))
                .filter(|(_, value)| *value != 0.0)
                .collect();
            let v = (observation.position[i] - p.position[i]) * weight;
            rows.push(PlainRow { image: Some((rank, row)), shared, v, belongs_to: image });
        }
    }
    Ok(())
}

/// Priors of effect parameters and of camera parameters; those of held values too, without derivatives.
fn prior_rows(at: &Prepared<'_>, rows: &mut Vec<PlainRow>) {
    let Prepared { problem, structure, state, .. } = at;
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
        let belongs_to = if image.is_some() { entry.instance as usize } else { 0 };
        rows.push(PlainRow { image, shared: shared_entry(unknown, sigma), v, belongs_to });
    }
    for prior in &problem.camera_priors {
        let (c, k) = (prior.camera as usize, prior.parameter as usize);
        let v = (prior.value - state.interiors[c][k]) / prior.sigma;
        rows.push(PlainRow { image: None, shared: shared_entry(layout.camera(c, k), prior.sigma), v, belongs_to: 0 });
    }
}

/// `sum rho` of everything that is not a point's: GNSS and priors.
pub fn chi_square_beside_points(at: &Prepared<'_>) -> Result<f64, Obstacle> {
    let Prepared { problem, structure, state, frames } = at;
    let mut sum = 0.0;
    for observation in &problem.gnss {
        let image = observation.index as usize;
        let p = position::predict_antenna(problem, &structure.stages, &frames[image], image)
            .ok_or(Obstacle::Antenna { image })?;
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
