//! Points after a step of images and border, eight measurements side by side: no row is stored, each is multiplied by
//! the increments at once.

use super::eliminate::Whitening;
use super::loss::Curvature;
use super::point::Prepared;
use super::rows::Contents;
use super::side_by_side::{Eights, Workspace, add_costs};
use super::structure::FIRST_THETA;
use crate::measure::lanes::{LANES, Lane, MISCLOSURE, POINT, Predictions};
use crate::measure::{self, MeasureError, transpose};
use nalgebra::{Matrix3, Vector3};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Increments of images and border that points follow.
pub struct Increments<'a> {
    /// What rows consist of.
    pub contents: &'a Contents,
    /// Of the images, by rank, `dim` each.
    pub images: &'a [f64],
    /// Of the border.
    pub border: &'a [f64],
}

/// Sums over the rays of a point: the upper triangle of `V` by rows, `J_point' v`, `J_point' (v - J dx)`, and zeros.
#[derive(Clone, Copy, Default)]
pub struct Left([Lane; 2]);

/// Entries of the upper triangle of `V`.
const UPPER: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
/// Where the others begin.
const GRADIENT: usize = UPPER.len();
const REST: usize = GRADIENT + 3;

impl Left {
    fn get(&self, k: usize) -> f64 {
        self.0[k / LANES][k % LANES]
    }

    /// `V`.
    pub fn normal(&self) -> Matrix3<f64> {
        let mut matrix = Matrix3::zeros();
        for (k, (a, b)) in UPPER.into_iter().enumerate() {
            (matrix[(a, b)], matrix[(b, a)]) = (self.get(k), self.get(k));
        }
        matrix
    }

    /// `J_point' v`.
    pub fn gradient(&self) -> Vector3<f64> {
        Vector3::from_fn(|a, _| self.get(GRADIENT + a))
    }

    /// The step that leaves nothing of it. `None`: the rays do not fix the point.
    pub fn step(&self, damping: f64) -> Option<Vector3<f64>> {
        Some(Whitening::of_damped(&self.normal(), damping)?.solve(std::array::from_fn(|a| self.get(REST + a))).into())
    }

    /// Adds a row: its derivatives by the point, its misclosure, and what the increments leave of that.
    fn add_row(&mut self, by_point: [f64; 3], v: f64, rest: f64) {
        let mut add = |k: usize, value: f64| self.0[k / LANES][k % LANES] += value;
        for (k, (a, b)) in UPPER.into_iter().enumerate() {
            add(k, by_point[a] * by_point[b]);
        }
        for a in 0..3 {
            add(GRADIENT + a, by_point[a] * v);
            add(REST + a, by_point[a] * rest);
        }
    }
}

/// Finds what is left of some points.
pub struct BackSubstitute<'a, 'b> {
    pub at: &'a Prepared<'b>,
    pub curvature: Curvature,
    pub points: Range<usize>,
    pub increments: &'a Increments<'a>,
    pub work: &'a mut Workspace,
    /// One for each point, zeros.
    pub left: &'a mut [Left],
}

impl WithSimd for BackSubstitute<'_, '_> {
    type Output = Result<(), MeasureError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { at, curvature, points, increments, work, left } = self;
        let objects = &at.state.points[points.clone()];
        let mut eights = Eights::new(at.cameras(), objects, points.clone(), &mut work.views);
        while work.linearise(simd, at.cameras(), curvature, &mut eights, &mut Lane::default())? {
            let Workspace { eight, predictions: p, .. } = &*work;
            let images = &at.problem.observations[eight.numbers.clone()];
            let moved = increments.moved(simd, at, images.iter().map(|o| o.image as usize), p);
            let mut numbers = [[Lane::default(); LANES]; 2];
            for piece in 0..LANES / S::F64_LANES {
                let weight = eight.weights.get::<S>(piece);
                let zero = simd.splat_f64s(0.0);
                let mut sums = [zero; REST + 3];
                for (row, moved) in p.rows.iter().zip(&moved) {
                    let v = simd.mul_f64s(row[MISCLOSURE].get::<S>(piece), weight);
                    let rest = simd.negate_mul_add_f64s(moved.get::<S>(piece), weight, v);
                    let mut by_point = [zero; 3];
                    for a in 0..3 {
                        by_point[a] = simd.mul_f64s(row[POINT + a].get::<S>(piece), weight);
                        sums[GRADIENT + a] = simd.mul_add_f64s(by_point[a], v, sums[GRADIENT + a]);
                        sums[REST + a] = simd.mul_add_f64s(by_point[a], rest, sums[REST + a]);
                    }
                    for (k, (a, b)) in UPPER.into_iter().enumerate() {
                        sums[k] = simd.mul_add_f64s(by_point[a], by_point[b], sums[k]);
                    }
                }
                for (lane, sum) in numbers.as_flattened_mut().iter_mut().zip(sums) {
                    lane.set::<S>(piece, sum);
                }
            }
            for square in &mut numbers {
                transpose(simd, square);
            }
            for (lane, point) in eight.points.iter().enumerate().take(eight.numbers.len()) {
                for (sum, numbers) in left[point - points.start].0.iter_mut().zip(&numbers) {
                    for piece in 0..LANES / S::F64_LANES {
                        let value = simd.add_f64s(sum.get::<S>(piece), numbers[lane].get::<S>(piece));
                        sum.set::<S>(piece, value);
                    }
                }
            }
        }
        Ok(())
    }
}

impl Increments<'_> {
    /// `J dx` of the measurements of `images`, not weighted.
    #[inline(always)]
    fn moved<S: Simd>(
        &self,
        simd: S,
        at: &Prepared<'_>,
        images: impl Iterator<Item = usize>,
        p: &Predictions,
    ) -> [Lane; 2] {
        let structure = at.structure;
        let (dim, of_one) = (structure.dim, structure.stride / LANES);
        let mut of_images = [[Lane::default(); LANES]; 2];
        let mut moved = [Lane::default(); 2];
        for (lane, image) in images.enumerate() {
            let own = &self.images[structure.rank[image] as usize * structure.stride..][..structure.stride];
            for (square, own) in of_images.iter_mut().zip(own.chunks_exact(LANES)) {
                square[lane].copy_from_slice(own);
            }
            if !structure.one_list {
                for (i, moved) in moved.iter_mut().enumerate() {
                    moved[lane] = self.moved_by_own_list(at, image, (p, i, lane));
                }
            }
        }
        for square in of_images.iter_mut().take(of_one) {
            transpose(simd, square);
        }
        for (row, moved) in p.rows.iter().zip(&mut moved) {
            for piece in 0..LANES / S::F64_LANES {
                let mut sum = moved.get::<S>(piece);
                for (content, dx) in self.contents.shared.iter().zip(self.border) {
                    let dx = simd.splat_f64s(content.scale * dx);
                    sum = simd.mul_add_f64s(row[content.place].get::<S>(piece), dx, sum);
                }
                for (content, dx) in self.contents.image[..dim].iter().zip(of_images.as_flattened()) {
                    let dx = simd.mul_f64s(dx.get::<S>(piece), simd.splat_f64s(content.scale));
                    sum = simd.mul_add_f64s(row[content.place].get::<S>(piece), dx, sum);
                }
                moved.set::<S>(piece, sum);
            }
        }
        moved
    }

    /// What of `J dx` the rows' contents do not have, where images have different lists of unknowns.
    fn moved_by_own_list(&self, at: &Prepared<'_>, image: usize, (p, i, lane): (&Predictions, usize, usize)) -> f64 {
        let structure = at.structure;
        let own = &self.images[structure.rank[image] as usize * structure.stride..];
        let shared = structure.local[image].iter().map(|c| (c.source, c.scale * self.border[c.column as usize]));
        let of_image = structure.own[image].iter().map(|c| (FIRST_THETA + c.source, c.scale * own[c.row as usize]));
        shared.chain(of_image).map(|(source, dx)| p.rows[i][Contents::place_of(source)][lane] * dx).sum()
    }

    /// Adds the surveyed coordinates of some points. Errors: one that cannot be predicted.
    pub fn add_surveyed(&self, at: &Prepared<'_>, points: Range<usize>, left: &mut [Left]) -> Result<(), MeasureError> {
        let Prepared { problem, structure, state, .. } = at;
        let first = problem.control.partition_point(|c| (c.index as usize) < points.start);
        for observation in problem.control[first..].iter().take_while(|c| (c.index as usize) < points.end) {
            let j = observation.index as usize;
            let p = measure::predict_surveyed(problem, &structure.stages, &state.theta, &state.points[j])
                .ok_or_else(|| MeasureError::surveyed(problem, j))?;
            for i in 0..3 {
                let weight = 1.0 / observation.sigma[i];
                let effects = structure.local.first().into_iter().flatten().filter(|c| c.source >= FIRST_THETA);
                let moved: f64 = effects
                    .map(|c| p.d_theta[(c.source - FIRST_THETA) as usize][i] * c.scale * self.border[c.column as usize])
                    .sum();
                let v = (observation.position[i] - p.position[i]) * weight;
                let by_point = std::array::from_fn(|k| p.derivative[(i, 3 + k)] * weight);
                left[j - points.start].add_row(by_point, v, v - moved * weight);
            }
        }
        Ok(())
    }
}

/// `sum rho` of the image measurements of some points at `objects`. `None`: one that cannot be predicted.
pub struct Costs<'a, 'b> {
    pub after: &'a Prepared<'b>,
    pub points: Range<usize>,
    pub objects: &'a [Vector3<f64>],
    pub work: &'a mut Workspace,
}

impl WithSimd for Costs<'_, '_> {
    type Output = Option<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<f64> {
        let Self { after, points, objects, work } = self;
        let cameras = after.cameras();
        let mut eights = Eights::new(cameras, objects, points, &mut work.views);
        let mut costs = Lane::default();
        while work.predict(simd, cameras, &mut eights)? {
            let (_, squares) = work.eight.misclosures(simd, &work.predictions.point);
            add_costs(simd, cameras.problem.loss, &squares, &mut costs);
        }
        Some(costs.iter().sum())
    }
}
