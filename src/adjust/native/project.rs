//! Columns orthogonal to the base, row by row: each candidate column minus what cameras, poses and points can take of it. Formed in
//! observation space, where the small rest of a column of which the base takes 99.9 % keeps its digits (the difference of two normal
//! matrices would lose them), and summed per image.

use super::linearise::position_rows;
use super::point::{PointRows, Prepared, inverse_of_damped};
use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;
use std::ops::Range;

/// Per image: sums of `column * v` and of `column * column'` over its measurements.
type Sums = Vec<(DVector<f64>, DMatrix<f64>)>;

/// `moves[c]`: image unknowns (rank order) and border (scaled unknowns) that take the base out of candidate column `c`, the candidate itself
/// at one. Rows that belong to no image (control coordinates, priors) are counted to the first image.
pub fn project(at: &Prepared<'_>, moves: &[(Vec<f64>, Vec<f64>)]) -> Sums {
    let moves = &Moves::new(at, moves);
    let parts: Vec<Sums> = at
        .structure
        .chunks
        .par_iter()
        .map(|chunk| match at.structure.dim {
            6 => project_chunk::<6>(at, chunk.clone(), moves),
            7 => project_chunk::<7>(at, chunk.clone(), moves),
            8 => project_chunk::<8>(at, chunk.clone(), moves),
            _ => project_chunk::<{ super::MAX_DIM }>(at, chunk.clone(), moves),
        })
        .collect();
    let mut sums = zeros(at, moves.count);
    for part in parts {
        for ((score, information), (s, m)) in sums.iter_mut().zip(part) {
            *score += s;
            *information += m;
        }
    }
    add_positions_and_priors(at, moves, &mut sums);
    for (_, information) in &mut sums {
        information.fill_lower_triangle_with_upper_triangle();
    }
    sums
}

fn zeros(at: &Prepared<'_>, count: usize) -> Sums {
    vec![(DVector::zeros(count), DMatrix::zeros(count, count)); at.structure.images]
}

/// The moves of all candidates, candidate fastest.
struct Moves {
    count: usize,
    /// Image unknown i, candidate c: `images[i * count + c]`.
    images: Vec<f64>,
    /// Border column l, candidate c: `border[l * count + c]`.
    border: Vec<f64>,
    /// Candidates that a border column moves: all of the base's, one of a candidate's own column, none of the others'.
    moved: Vec<Range<usize>>,
}

impl Moves {
    fn new(at: &Prepared<'_>, moves: &[(Vec<f64>, Vec<f64>)]) -> Self {
        let (n, m, count) = (at.structure.images * at.structure.dim, at.structure.border.len(), moves.len());
        let interleave = |length: usize, of: &dyn Fn(usize, usize) -> f64| {
            (0..length * count).map(|k| of(k / count, k % count)).collect::<Vec<f64>>()
        };
        let border = interleave(m, &|l, c| moves[c].1[l]);
        let moved = |l: usize| {
            let moves = |c: &usize| border[l * count + c] != 0.0;
            let first = (0..count).find(moves).unwrap_or(0);
            first..(first..count).rfind(moves).map_or(first, |last| last + 1)
        };
        Self { count, images: interleave(n, &|i, c| moves[c].0[i]), moved: (0..m).map(moved).collect(), border }
    }

    /// `line += a * what border column l moves`.
    fn add_border(&self, line: &mut [f64], a: f64, l: u32) {
        let l = l as usize;
        let moved = self.moved[l].clone();
        let from = &self.border[l * self.count..(l + 1) * self.count];
        add(&mut line[moved.clone()], a, &from[moved]);
    }
}

/// `row += a * line`.
fn add(row: &mut [f64], a: f64, line: &[f64]) {
    if a != 0.0 {
        for (r, x) in row.iter_mut().zip(line) {
            *r += a * x;
        }
    }
}

/// Adds one finished row with misclosure `v` to an image's sums.
fn sum_row((score, information): &mut (DVector<f64>, DMatrix<f64>), row: &[f64], v: f64) {
    add(score.as_mut_slice(), v, row);
    // Column-major storage, upper triangle.
    for ((c, a), column) in row.iter().enumerate().zip(information.as_mut_slice().chunks_exact_mut(row.len().max(1))) {
        add(&mut column[..=c], *a, row);
    }
}

fn project_chunk<const D: usize>(at: &Prepared<'_>, points: Range<usize>, moves: &Moves) -> Sums {
    let count = moves.count;
    let mut sums = zeros(at, count);
    let mut rows = PointRows::<D>::new();
    let mut lines: Vec<f64> = Vec::new();
    let mut by_point = vec![0.0; 3 * count];
    for j in points {
        // The state was linearised just before.
        if rows.linearise(at, j).is_err() {
            continue;
        }
        let Some(inverse) = inverse_of_damped(&rows.v_matrix, 0.0) else { continue };
        lines.clear();
        lines.resize(2 * rows.rows.len() * count, 0.0);
        by_point.fill(0.0);
        let (p0, rest) = by_point.split_at_mut(count);
        let (p1, p2) = rest.split_at_mut(count);
        for (r, (row, shared)) in rows.rows.iter().zip(&rows.shared).enumerate() {
            for (i, values) in [&shared.x, &shared.y].into_iter().enumerate() {
                let line = &mut lines[(2 * r + i) * count..(2 * r + i + 1) * count];
                for k in 0..D {
                    let unknown = row.rank as usize * D + k;
                    add(line, row.image[i][k], &moves.images[unknown * count..(unknown + 1) * count]);
                }
                for (l, a) in shared.columns.index().iter().zip(values) {
                    moves.add_border(line, *a, *l);
                }
                add(p0, row.point[i][0], line);
                add(p1, row.point[i][1], line);
                add(p2, row.point[i][2], line);
            }
        }
        let control = rows.control.as_ref().map(|control| {
            let mut control_lines = vec![0.0; 3 * count];
            for i in 0..3 {
                let line = &mut control_lines[i * count..(i + 1) * count];
                for (l, a) in control.columns.index().iter().zip(&control.shared[i]) {
                    moves.add_border(line, *a, *l);
                }
                add(p0, control.by_point[i][0], line);
                add(p1, control.by_point[i][1], line);
                add(p2, control.by_point[i][2], line);
            }
            control_lines
        });
        // The point takes its own part: minus V^-1 J_point' line.
        for c in 0..count {
            let taken = inverse * Vector3::new(p0[c], p1[c], p2[c]);
            (p0[c], p1[c], p2[c]) = (-taken[0], -taken[1], -taken[2]);
        }
        for (r, row) in rows.rows.iter().enumerate() {
            let image = at.problem.observations[at.problem.point_start[j] + r].image as usize;
            for i in 0..2 {
                let line = &mut lines[(2 * r + i) * count..(2 * r + i + 1) * count];
                add(line, row.point[i][0], p0);
                add(line, row.point[i][1], p1);
                add(line, row.point[i][2], p2);
                sum_row(&mut sums[image], line, row.v[i]);
            }
        }
        if let (Some(control), Some(mut control_lines)) = (&rows.control, control) {
            for i in 0..3 {
                let line = &mut control_lines[i * count..(i + 1) * count];
                add(line, control.by_point[i][0], p0);
                add(line, control.by_point[i][1], p1);
                add(line, control.by_point[i][2], p2);
                sum_row(&mut sums[0], line, control.v[i]);
            }
        }
    }
    sums
}

fn add_positions_and_priors(at: &Prepared<'_>, moves: &Moves, sums: &mut Sums) {
    let (dim, count) = (at.structure.dim, moves.count);
    for row in position_rows(at).unwrap_or_default() {
        let mut line = vec![0.0; count];
        if let Some((rank, image)) = &row.image {
            for (k, a) in image.iter().enumerate() {
                let unknown = rank * dim + k;
                add(&mut line, *a, &moves.images[unknown * count..(unknown + 1) * count]);
            }
        }
        for (column, a) in &row.shared {
            moves.add_border(&mut line, *a, *column);
        }
        sum_row(&mut sums[row.belongs_to], &line, row.v);
    }
}
