//! From predictions side by side to rows: what is by derivative becomes by measurement, eight by eight.

use super::super::point::Prepared;
use super::super::side_by_side::Eight;
use super::super::structure::{FIRST_THETA, POSE, Structure};
use super::{Rows, SECOND};
use crate::measure::lanes::{CAMERA, LANES, Lane, MISCLOSURE, NOTHING, POINT, Predictions, ROTATION, THETA};
use crate::measure::transpose;
use pulp::Simd;

/// What stands in a column of a row: a place in the rows of [`Predictions`], and a factor.
#[derive(Debug, Clone, Copy)]
pub struct Content {
    pub place: usize,
    pub scale: f64,
}

/// What stands in the columns of the rows of image measurements.
pub struct Contents {
    /// Of the border.
    pub shared: Vec<Content>,
    /// Of the image's unknowns.
    pub image: Vec<Content>,
}

impl Contents {
    /// Place of the derivatives by what a column is of: see `LocalColumn::source`.
    pub fn place_of(source: u32) -> usize {
        if source < FIRST_THETA { CAMERA + source as usize } else { THETA + (source - FIRST_THETA) as usize }
    }

    /// Where images have different lists of unknowns, the columns of these stay zero here.
    pub fn new(structure: &Structure) -> Self {
        let Structure { width, stride, local, own, one_list, .. } = structure;
        let mut shared = vec![Content { place: NOTHING, scale: 1.0 }; *width];
        let mut image = vec![Content { place: NOTHING, scale: 1.0 }; *stride];
        // The projection centre follows the rotation.
        for k in 0..POSE {
            image[k].place = ROTATION + k;
        }
        if let Some(last) = shared.last_mut() {
            last.place = MISCLOSURE;
        }
        if *one_list {
            for column in local.first().into_iter().flatten() {
                shared[column.column as usize] = Content { place: Self::place_of(column.source), scale: column.scale };
            }
            for column in own.first().into_iter().flatten() {
                image[column.row as usize] = Content { place: THETA + column.source as usize, scale: column.scale };
            }
        }
        Self { shared, image }
    }
}

impl Rows {
    /// Spreads up to eight measurements over their rows; `start` is the number of the measurement that the rows begin
    /// with.
    #[inline(always)]
    pub(super) fn spread<S: Simd>(&mut self, simd: S, at: &Prepared<'_>, start: usize, eight: &Eight, p: &Predictions) {
        let Prepared { problem, structure, .. } = at;
        let (width, stride, count) = (self.width, self.stride, eight.numbers.len());
        let pair = eight.numbers.start - start;
        let shared = &mut self.shared[2 * pair * width..][..2 * count * width];
        let image = &mut self.image[2 * pair * stride..][..2 * count * stride];
        for (i, row) in p.rows.iter().enumerate() {
            spread_rows(simd, &self.contents.shared, row, &eight.weights, &mut shared[i * width..]);
            spread_rows(simd, &self.contents.image, row, &eight.weights, &mut image[i * stride..]);
        }
        spread_points(simd, p, &eight.weights, &mut self.by_point[pair..][..count]);
        let images = problem.observations[eight.numbers.clone()].iter().map(|o| o.image as usize);
        for (lane, of_image) in images.enumerate() {
            let rank = structure.rank[of_image];
            self.rank[pair + lane] = rank;
            if structure.one_list && !structure.holds_pose[rank as usize] {
                continue;
            }
            let weight = eight.weights[lane];
            for (i, row) in p.rows.iter().enumerate() {
                let (shared, image) =
                    (&mut shared[(2 * lane + i) * width..][..width], &mut image[(2 * lane + i) * stride..][..stride]);
                if !structure.one_list {
                    for column in &structure.local[of_image] {
                        shared[column.column as usize] =
                            row[Contents::place_of(column.source)][lane] * weight * column.scale;
                    }
                    for column in &structure.own[of_image] {
                        image[column.row as usize] = row[THETA + column.source as usize][lane] * weight * column.scale;
                    }
                }
                structure.hold_pose(rank, image);
            }
        }
    }
}

/// Fills what is by the points.
#[inline(always)]
fn spread_points<S: Simd>(simd: S, p: &Predictions, weights: &Lane, by_point: &mut [Lane]) {
    let mut square = [Lane::default(); LANES];
    for (first, row) in [0, SECOND].into_iter().zip(&p.rows) {
        for a in 0..3 {
            for piece in 0..LANES / S::F64_LANES {
                let weighed = simd.mul_f64s(row[POINT + a].get::<S>(piece), weights.get::<S>(piece));
                square[first + a].set::<S>(piece, weighed);
            }
        }
    }
    transpose(simd, &mut square);
    for (to, numbers) in by_point.iter_mut().zip(&square) {
        *to = *numbers;
    }
}

/// Fills every second row of `rows`.
#[inline(always)]
fn spread_rows<S: Simd>(simd: S, contents: &[Content], lanes: &[Lane], weights: &Lane, rows: &mut [f64]) {
    let step = 2 * contents.len();
    for (piece, contents) in contents.chunks_exact(LANES).enumerate() {
        let mut square = [Lane::default(); LANES];
        for (out, content) in square.iter_mut().zip(contents) {
            let lane = &lanes[content.place];
            for piece in 0..LANES / S::F64_LANES {
                let weighed = simd.mul_f64s(lane.get::<S>(piece), weights.get::<S>(piece));
                out.set::<S>(piece, simd.mul_f64s(weighed, simd.splat_f64s(content.scale)));
            }
        }
        transpose(simd, &mut square);
        for (row, numbers) in rows.chunks_mut(step).zip(&square) {
            row[LANES * piece..][..LANES].copy_from_slice(&**numbers);
        }
    }
}
