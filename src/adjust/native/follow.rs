//! Points after a step of images and border: carried along by their images, and intersected anew from there.
//!
//! Every image would take a point along as if it stood still before the camera; the point begins at the mean of that,
//! and goes one step of the spatial intersection from the moved images:
//!
//! ```text
//! P0 = mean of C' + R'^T R (P - C),   s = (V + lambda D)^-1 (g - lambda D (P0 - P)),   P' = P0 + s / max(1 - t, t)
//! ```
//!
//! with `V`, `D` (its diagonal) and `g` of the point's own rows at `P0`. To first order that is the back-substitution
//! of the linear step, but no derivative by images, camera or effects is needed, and where a part of the block moves as
//! a whole there is nothing left to be linear about.
//!
//! The weights of a robust loss, and its curvature, are those of the state before, as in the linear step: those of a
//! point on its way would tell outliers from others by what it has not yet followed.
//!
//! `t` is by which share `s` lengthens the point's rays in the mean: along them the step is linear in one over the
//! distance, as image coordinates nearly are, up to twice the distance. Source: inverse depth, Civera, Davison and
//! Montiel (2008).

use super::eliminate::Whitening;
use super::loss::Curvature;
use super::point::Prepared;
use super::side_by_side::{Eights, Workspace};
use crate::math::lane::{LANES, Lane};
use crate::measure::lanes::{MISCLOSURE, POINT};
use crate::measure::{self, transpose};
use crate::problem::{Loss, Pose, State};
use nalgebra::{Matrix3, Vector3};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Sixteen numbers that are added to others.
#[derive(Debug, Clone, Copy, Default)]
struct Numbers([Lane; 2]);

impl Numbers {
    fn get(&self, k: usize) -> f64 {
        self.0[k / LANES][k % LANES]
    }

    fn three_from(&self, k: usize) -> Vector3<f64> {
        Vector3::from_fn(|i, _| self.get(k + i))
    }

    fn set(&mut self, k: usize, value: f64) {
        self.0[k / LANES][k % LANES] = value;
    }

    #[inline(always)]
    fn add<'a, S: Simd>(&mut self, simd: S, others: impl IntoIterator<Item = &'a Lane>) {
        for (sum, other) in self.0.iter_mut().zip(others) {
            for piece in 0..LANES / S::F64_LANES {
                sum.set::<S>(piece, simd.add_f64s(sum.get::<S>(piece), other.get::<S>(piece)));
            }
        }
    }
}

/// How an image takes points along: `R'^T R - 1` by rows, then `C' - R'^T R C`; they move by the first times `P`, plus
/// the second.
#[derive(Debug, Clone, Copy, Default)]
pub struct Motion(Numbers);

/// Where the second of them begins.
const SHIFT: usize = 9;

impl Motion {
    fn of(before: &Pose, after: &Pose) -> Self {
        let turn = (after.rotation.inverse() * before.rotation).to_rotation_matrix().into_inner();
        let (change, shift) = (turn - Matrix3::identity(), after.centre - turn * before.centre);
        let mut numbers = Numbers::default();
        for i in 0..3 {
            for k in 0..3 {
                numbers.set(3 * i + k, change[(i, k)]);
            }
            numbers.set(SHIFT + i, shift[i]);
        }
        Self(numbers)
    }

    /// By what `point` moves.
    fn of_point(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let by_turn = Vector3::from_fn(|i, _| self.0.three_from(3 * i).dot(point));
        self.0.three_from(SHIFT) + by_turn
    }
}

/// How the images of a state move that becomes `after`.
pub fn motions(before: &State, after: &State) -> Vec<Motion> {
    before.poses.iter().zip(&after.poses).map(|(before, after)| Motion::of(before, after)).collect()
}

/// Points on their way.
#[derive(Default)]
pub struct Followers {
    /// Where their images took them: `P0`.
    pub carried: Vec<Vector3<f64>>,
    /// What their rays say there.
    pub rays: Vec<Rays>,
}

/// What the rays of a point say: the upper triangle of `V` by rows, `g`, the sum of the rays `P0 - C'` over their
/// squared lengths, and how many these are.
#[derive(Clone, Copy, Default)]
pub struct Rays(Numbers);

/// Entries of the upper triangle of `V`.
const UPPER: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
/// Where those of `g` begin.
const GRADIENT: usize = UPPER.len();
/// Where those of the rays begin.
const RAYS: usize = GRADIENT + 3;
/// Where their number stands.
const COUNT: usize = RAYS + 3;

impl Rays {
    /// `V`.
    pub fn normal(&self) -> Matrix3<f64> {
        let mut matrix = Matrix3::zeros();
        for (k, (a, b)) in UPPER.into_iter().enumerate() {
            (matrix[(a, b)], matrix[(b, a)]) = (self.0.get(k), self.0.get(k));
        }
        matrix
    }

    /// `P' - P0`; `already` is `P0 - P`. `None`: they do not fix the point.
    pub fn step(&self, damping: f64, already: &Vector3<f64>) -> Option<Vector3<f64>> {
        let normal = self.normal();
        let rest = self.0.three_from(GRADIENT) - damping * normal.diagonal().component_mul(already);
        let step: Vector3<f64> = Whitening::of_damped(&normal, damping)?.solve(rest.into()).into();
        let t = step.dot(&self.0.three_from(RAYS)) / self.0.get(COUNT).max(1.0);
        Some(step / (1.0 - t).max(t))
    }

    /// Adds a row: its derivatives by the point, and its misclosure.
    fn add_row(&mut self, by_point: [f64; 3], v: f64) {
        let mut add = |k: usize, value: f64| self.0.set(k, self.0.get(k) + value);
        for (k, (a, b)) in UPPER.into_iter().enumerate() {
            add(k, by_point[a] * by_point[b]);
        }
        for a in 0..3 {
            add(GRADIENT + a, by_point[a] * v);
        }
    }
}

/// Lets some points follow their images.
pub struct Follow<'a, 'b> {
    /// Where they are.
    pub before: &'a Prepared<'b>,
    /// The moved images.
    pub after: &'a Prepared<'b>,
    /// How these moved.
    pub motions: &'a [Motion],
    pub curvature: Curvature,
    pub points: Range<usize>,
    pub work: &'a mut Workspace,
    /// Work space for the state before, which robust weights are of.
    pub work_before: &'a mut Workspace,
    /// The points, when done.
    pub followers: &'a mut Followers,
}

impl WithSimd for Follow<'_, '_> {
    /// `None`: a measurement that cannot be predicted.
    type Output = Option<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<()> {
        let Self { before, after, motions, curvature, points, work, work_before, followers } = self;
        let Followers { carried, rays } = followers;
        carried.clear();
        rays.clear();
        for j in points.clone() {
            let (problem, point) = (after.problem, before.state.points[j]);
            let observed = &problem.observations[problem.point_start[j]..problem.point_start[j + 1]];
            let motion = mean(simd, observed.iter().map(|observation| &motions[observation.image as usize]));
            carried.push(point + motion.map_or_else(Vector3::zeros, |motion| motion.of_point(&point)));
            rays.push(Rays::default());
        }
        let cameras = after.cameras();
        let mut eights = Eights::new(cameras, carried, points.clone(), &mut work.views);
        let mut at_before = (after.problem.loss != Loss::None).then(|| {
            let objects = &before.state.points[points.clone()];
            Eights::new(before.cameras(), objects, points.clone(), &mut work_before.views)
        });
        loop {
            let predicted = match &mut at_before {
                Some(eights) => work_before.predict(simd, before.cameras(), eights)?.then_some(()),
                None => None,
            };
            let predicted = predicted.map(|()| &work_before.predictions.point);
            if !work.linearise_by_point(simd, cameras, curvature, &mut eights, predicted)? {
                break;
            }
            let Workspace { eight, predictions: p, views, .. } = &*work;
            let (object, centre) = (views.object(), views.centre());
            let mut numbers = [[Lane::default(); LANES]; 2];
            for piece in 0..LANES / S::F64_LANES {
                let weight = eight.weights.get::<S>(piece);
                let zero = simd.splat_f64s(0.0);
                let mut sums = [zero; COUNT + 1];
                for row in &p.rows {
                    let v = simd.mul_f64s(row[MISCLOSURE].get::<S>(piece), weight);
                    let mut by_point = [zero; 3];
                    for a in 0..3 {
                        by_point[a] = simd.mul_f64s(row[POINT + a].get::<S>(piece), weight);
                        sums[GRADIENT + a] = simd.mul_add_f64s(by_point[a], v, sums[GRADIENT + a]);
                    }
                    for (k, (a, b)) in UPPER.into_iter().enumerate() {
                        sums[k] = simd.mul_add_f64s(by_point[a], by_point[b], sums[k]);
                    }
                }
                let mut square = zero;
                for i in 0..3 {
                    sums[RAYS + i] = simd.sub_f64s(object[i].get::<S>(piece), centre[i].get::<S>(piece));
                    square = simd.mul_add_f64s(sums[RAYS + i], sums[RAYS + i], square);
                }
                for i in 0..3 {
                    sums[RAYS + i] = simd.div_f64s(sums[RAYS + i], square);
                }
                sums[COUNT] = simd.splat_f64s(1.0);
                for (lane, sum) in numbers.as_flattened_mut().iter_mut().zip(sums) {
                    lane.set::<S>(piece, sum);
                }
            }
            for square in &mut numbers {
                transpose(simd, square);
            }
            for (lane, point) in eight.points.iter().enumerate().take(eight.numbers.len()) {
                rays[point - points.start].0.add(simd, numbers.iter().map(|square| &square[lane]));
            }
        }
        add_surveyed(after, points, followers)
    }
}

/// The mean of some motions; `None` where there are none.
#[inline(always)]
fn mean<'a, S: Simd>(simd: S, motions: impl ExactSizeIterator<Item = &'a Motion>) -> Option<Motion> {
    let share = 1.0 / motions.len() as f64;
    let mut sum = Numbers::default();
    for Motion(numbers) in motions {
        sum.add(simd, &numbers.0);
    }
    for piece in 0..LANES / S::F64_LANES {
        for lane in &mut sum.0 {
            lane.set::<S>(piece, simd.mul_f64s(lane.get::<S>(piece), simd.splat_f64s(share)));
        }
    }
    share.is_finite().then_some(Motion(sum))
}

/// Adds the surveyed coordinates of some points. `None`: one that cannot be predicted.
fn add_surveyed(after: &Prepared<'_>, points: Range<usize>, Followers { carried, rays }: &mut Followers) -> Option<()> {
    let Prepared { problem, structure, state, .. } = after;
    let first = problem.control.partition_point(|c| (c.index as usize) < points.start);
    for observation in problem.control[first..].iter().take_while(|c| (c.index as usize) < points.end) {
        let number = observation.index as usize - points.start;
        let p = measure::predict_surveyed(problem, &structure.stages, &state.theta, &carried[number])?;
        for i in 0..3 {
            let weight = 1.0 / observation.sigma[i];
            let by_point = std::array::from_fn(|k| p.derivative[(i, 3 + k)] * weight);
            rays[number].add_row(by_point, (observation.position[i] - p.position[i]) * weight);
        }
    }
    Some(())
}

#[cfg(test)]
#[path = "follow_tests.rs"]
mod tests;
