//! A ray that effects bend or move on its way: the exposure stage moves the pose, the ray stage the object point as the camera sees it. One text for
//! one ray and for eight side by side.

use super::frame::{Frame, Stages};
use super::matrices::{dot, identity, is_identity, times_six};
use crate::effects::Stage;
use crate::effects::formula::Answer;
use crate::math::{Number, Several};
use crate::problem::Problem;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Rays to be bent: one, or eight side by side.
pub(super) trait Rays {
    /// What their numbers are computed with.
    type Number: Several;

    /// A number like those of the rays.
    fn seed(&self) -> Self::Number;

    /// A number of the image of each.
    fn of_frames(&self, number: impl Fn(&Frame) -> f64) -> Kept<Self>;

    /// A matrix that follows from a vector of each, row by row.
    fn matrices(&self, vector: &[Kept<Self>; 3], matrix: fn(&Vector3<f64>) -> Matrix3<f64>) -> [Kept<Self>; 9];

    /// Asks effect `e`. `Err`: the place of the first ray outside its domain.
    fn ask(&self, e: usize, input: &[Kept<Self>], answer: Answer<'_, Kept<Self>>) -> Result<(), usize>;
}

/// A number of rays in memory.
pub(super) type Kept<R> = <<R as Rays>::Number as Several>::Kept;

/// Rays as they reach the camera. What follows an unknown follows it by a turn of the camera (a small vector from the left, as `w`) and a shift of
/// the point against the projection centre. Matrices are kept row by row.
#[derive(Debug, Clone)]
pub(super) struct Ray<K> {
    /// Rotation vector of `R'`.
    pub rotation_vector: [K; 3],
    /// Whether effects turned the camera of any: `R'` is that of [`Self::rotation_vector`], not of the image.
    pub turned: bool,
    /// `C'`.
    pub centre: [K; 3],
    /// `P'`.
    pub point: [K; 3],
    /// Whether pose and point move the ray otherwise than a straight one.
    pub bends: bool,
    /// Whether effects turn the camera, by anything.
    pub turns: bool,
    /// Turn by (w, C), 3 x 6.
    pub turn_by_pose: [K; 18],
    /// Shift by (w, C), 3 x 6.
    pub shift_by_pose: [K; 18],
    /// Shift by P, 3 x 3.
    pub shift_by_point: [K; 9],
    /// Turn and shift by the local parameters of exposure and ray effects, in the order of [`Stages::ray_locals`].
    pub by_theta: Vec<[K; 6]>,
    /// Derivatives of (r, C) by local parameters.
    pose_by_theta: Vec<[K; 6]>,
    /// Derivatives of an effect's output by its input.
    d_in: [K; 36],
    /// Derivatives of an effect's output by its own parameters.
    d_own: Vec<K>,
}

impl<K: Copy + Default> Default for Ray<K> {
    fn default() -> Self {
        let nothing = K::default();
        Self {
            rotation_vector: [nothing; 3],
            turned: false,
            centre: [nothing; 3],
            point: [nothing; 3],
            bends: false,
            turns: false,
            turn_by_pose: [nothing; 18],
            shift_by_pose: [nothing; 18],
            shift_by_point: [nothing; 9],
            by_theta: Vec::new(),
            pose_by_theta: Vec::new(),
            d_in: [nothing; 36],
            d_own: Vec::new(),
        }
    }
}

impl<K: Copy + Default + PartialEq> Ray<K> {
    /// Sends rays from `point` to the projection centres `centre` through the effects of exposure and ray. `Err`: the place of the first outside
    /// the domain of one.
    #[inline(always)]
    pub fn bend<R: Rays<Number: Several<Kept = K>>>(
        &mut self,
        rays: &R,
        (problem, stages): (&Problem, &Stages),
        centre: &[K; 3],
        point: &[K; 3],
    ) -> Result<(), usize> {
        let seed = rays.seed();
        let nothing = K::default();
        let of_r: [K; 3] = of_rotation_vectors(rays);
        let mut pose = [of_r[0], of_r[1], of_r[2], centre[0], centre[1], centre[2]];

        // Exposure: (r, C), with derivatives by (r, C) before and by the parameters.
        self.pose_by_theta.clear();
        self.pose_by_theta.resize(stages.ray_locals.len(), [nothing; 6]);
        let mut by_pose: Option<[K; 36]> = None;
        for &e in stages.of(Stage::Exposure) {
            let places = places(problem, stages, e);
            let count = places.len();
            let mut next = [nothing; 6];
            self.d_own.resize(self.d_own.len().max(6 * count), nothing);
            let (d_in, d_own) = (&mut self.d_in, &mut self.d_own[..6 * count]);
            rays.ask(e, &pose, Answer { out: &mut next, d_input: Some(d_in), d_theta: Some(d_own) })?;
            let d_in = &self.d_in;
            // Most move the centre alone, and none does anything at zero, where candidates are tested.
            if !is_identity(seed, d_in, 6, 0) {
                by_pose = Some(match by_pose {
                    Some(before) => times_six(seed, d_in, &before),
                    None => *d_in,
                });
                for column in &mut self.pose_by_theta {
                    let before = *column;
                    for i in 0..6 {
                        column[i] = dot(seed, (d_in, 6 * i, 1), (&before, 0, 1), 6).keep();
                    }
                }
            }
            for (p, column) in self.pose_by_theta[places].iter_mut().enumerate() {
                for i in 0..6 {
                    column[i] = (seed.of(column[i]) + seed.of(self.d_own[count * i + p])).keep();
                }
            }
            pose = next;
        }
        let [r0, r1, r2, centre @ ..] = pose;
        (self.rotation_vector, self.centre) = ([r0, r1, r2], centre);
        self.turned = self.rotation_vector != of_r;
        self.turns = by_pose.is_some() || self.pose_by_theta.iter().any(|column| column[..3] != [nothing; 3]);

        // By (w, C): the turn, and the centre.
        let left_jacobian: [K; 9] = match (self.turns, self.turned) {
            (false, _) => [nothing; 9],
            (true, false) => of_matrices(rays, |frame| &frame.left_jacobian),
            (true, true) => rays.matrices(&self.rotation_vector, crate::math::rotation::left_jacobian),
        };
        self.turn_by_pose = identity::<R::Number, 18>(3, 0);
        let mut centre_by_pose: [K; 18] = identity::<R::Number, 18>(3, 3);
        if let Some(by_pose) = &mut by_pose {
            let d_rotation_vector: [K; 9] = of_matrices(rays, |frame| &frame.d_rotation_vector);
            for i in 0..6 {
                let mut by_turn = [nothing; 3];
                for k in 0..3 {
                    by_turn[k] = dot(seed, (&*by_pose, 6 * i, 1), (&d_rotation_vector, k, 3), 3).keep();
                }
                by_pose[6 * i..6 * i + 3].copy_from_slice(&by_turn);
            }
            for i in 0..3 {
                for k in 0..6 {
                    self.turn_by_pose[6 * i + k] = dot(seed, (&left_jacobian, 3 * i, 1), (&*by_pose, k, 6), 3).keep();
                }
            }
            centre_by_pose.copy_from_slice(&by_pose[18..]);
        }

        // Ray: P, with derivatives by P before, (w, C) and the parameters.
        self.bends = by_pose.is_some();
        self.point = *point;
        self.shift_by_point = identity::<R::Number, 9>(3, 0);
        self.shift_by_pose = [nothing; 18];
        self.by_theta.clear();
        self.by_theta.resize(stages.ray_locals.len(), [nothing; 6]);
        for &e in stages.of(Stage::Ray) {
            let places = places(problem, stages, e);
            let count = places.len();
            let [p0, p1, p2] = self.point;
            let input = [pose[0], pose[1], pose[2], pose[3], pose[4], pose[5], p0, p1, p2];
            let mut next = [nothing; 3];
            self.d_own.resize(self.d_own.len().max(3 * count), nothing);
            let (d_in, d_own) = (&mut self.d_in[..27], &mut self.d_own[..3 * count]);
            rays.ask(e, &input, Answer { out: &mut next, d_input: Some(d_in), d_theta: Some(d_own) })?;
            if !is_identity(seed, &self.d_in[..27], 3, 6) {
                self.go_through(rays, by_pose.as_ref(), &centre_by_pose);
                self.bends = true;
            }
            for (p, column) in self.by_theta[places].iter_mut().enumerate() {
                for i in 0..3 {
                    column[3 + i] = (seed.of(column[3 + i]) + seed.of(self.d_own[count * i + p])).keep();
                }
            }
            self.point = next;
        }

        // The shift is that of the point against the centre.
        for k in 0..18 {
            self.shift_by_pose[k] = (seed.of(self.shift_by_pose[k]) - seed.of(centre_by_pose[k])).keep();
        }
        for (column, pose) in self.by_theta.iter_mut().zip(&self.pose_by_theta) {
            for i in 0..3 {
                if self.turns {
                    column[i] = dot(seed, (&left_jacobian, 3 * i, 1), (pose, 0, 1), 3).keep();
                }
                column[3 + i] = (seed.of(column[3 + i]) - seed.of(pose[3 + i])).keep();
            }
        }
        Ok(())
    }

    /// Derivatives so far, through a ray effect that has just been asked.
    #[inline(always)]
    fn go_through<R: Rays<Number: Several<Kept = K>>>(
        &mut self,
        rays: &R,
        by_pose: Option<&[K; 36]>,
        centre_by_pose: &[K; 18],
    ) {
        let (seed, d_in) = (rays.seed(), &self.d_in[..27]);
        let (before_pose, before_point) = (self.shift_by_pose, self.shift_by_point);
        let nothing = [K::default(); 3];
        let turns = d_in[..3] != nothing || d_in[9..12] != nothing || d_in[18..21] != nothing;
        let d_rotation_vector: [K; 9] = match turns && by_pose.is_none() {
            true => of_matrices(rays, |frame| &frame.d_rotation_vector),
            false => [K::default(); 9],
        };
        // Of a ray that was straight: most have one such effect.
        let first = !self.bends && !turns;
        for i in 0..3 {
            let row = 9 * i;
            if first {
                self.shift_by_pose[6 * i + 3..][..3].copy_from_slice(&d_in[row + 3..][..3]);
                self.shift_by_point[3 * i..][..3].copy_from_slice(&d_in[row + 6..][..3]);
                continue;
            }
            for k in 0..6 {
                let by_centre = dot(seed, (d_in, row + 3, 1), (centre_by_pose, k, 6), 3);
                let mut sum = by_centre + dot(seed, (d_in, row + 6, 1), (&before_pose, k, 6), 3);
                match by_pose {
                    Some(by_pose) if turns => sum = sum + dot(seed, (d_in, row, 1), (by_pose, k, 6), 3),
                    None if turns && k < 3 => sum = sum + dot(seed, (d_in, row, 1), (&d_rotation_vector, k, 3), 3),
                    _ => {}
                }
                self.shift_by_pose[6 * i + k] = sum.keep();
            }
            for k in 0..3 {
                self.shift_by_point[3 * i + k] = dot(seed, (d_in, row + 6, 1), (&before_point, k, 3), 3).keep();
            }
        }
        for (column, pose) in self.by_theta.iter_mut().zip(&self.pose_by_theta) {
            let before = *column;
            let mut size = seed.like(0.0);
            for number in before.iter().chain(pose) {
                size = size + seed.of(*number).abs();
            }
            if size.is_zero() {
                continue;
            }
            for i in 0..3 {
                let row = 9 * i;
                let by_point = dot(seed, (d_in, row + 6, 1), (&before, 3, 1), 3);
                let mut sum = by_point + dot(seed, (d_in, row + 3, 1), (pose, 3, 1), 3);
                if turns {
                    sum = sum + dot(seed, (d_in, row, 1), (pose, 0, 1), 3);
                }
                column[3 + i] = sum.keep();
            }
        }
    }

    /// [`Self::bend`] without derivatives.
    #[inline(always)]
    pub fn move_only<R: Rays<Number: Several<Kept = K>>>(
        &mut self,
        rays: &R,
        stages: &Stages,
        centre: &[K; 3],
        point: &[K; 3],
    ) -> Result<(), usize> {
        let nothing = K::default();
        let of_r: [K; 3] = of_rotation_vectors(rays);
        let mut pose = [of_r[0], of_r[1], of_r[2], centre[0], centre[1], centre[2]];
        for &e in stages.of(Stage::Exposure) {
            let mut next = [nothing; 6];
            rays.ask(e, &pose, Answer { out: &mut next, d_input: None, d_theta: None })?;
            pose = next;
        }
        self.point = *point;
        for &e in stages.of(Stage::Ray) {
            let [p0, p1, p2] = self.point;
            let input = [pose[0], pose[1], pose[2], pose[3], pose[4], pose[5], p0, p1, p2];
            let mut next = [nothing; 3];
            rays.ask(e, &input, Answer { out: &mut next, d_input: None, d_theta: None })?;
            self.point = next;
        }
        let [r0, r1, r2, centre @ ..] = pose;
        (self.rotation_vector, self.centre) = ([r0, r1, r2], centre);
        self.turned = self.rotation_vector != of_r;
        Ok(())
    }
}

/// Where the parameters of an effect stand in the list of those of exposure and ray, which has those of each effect together.
fn places(problem: &Problem, stages: &Stages, e: usize) -> Range<usize> {
    let own = stages.locals(problem, e);
    let first = stages.ray_locals.partition_point(|k| *k < own.start);
    first..first + own.len()
}

#[inline(always)]
fn of_rotation_vectors<R: Rays>(rays: &R) -> [Kept<R>; 3] {
    let mut vector = [Kept::<R>::default(); 3];
    for (k, slot) in vector.iter_mut().enumerate() {
        *slot = rays.of_frames(|frame| frame.rotation_vector[k]);
    }
    vector
}

#[inline(always)]
fn of_matrices<R: Rays>(rays: &R, matrix: impl Fn(&Frame) -> &Matrix3<f64>) -> [Kept<R>; 9] {
    let mut rows = [Kept::<R>::default(); 9];
    for (k, slot) in rows.iter_mut().enumerate() {
        *slot = rays.of_frames(|frame| matrix(frame)[(k / 3, k % 3)]);
    }
    rows
}
