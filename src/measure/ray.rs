//! A ray that effects bend or move on its way: the exposure stage moves the pose, the ray stage the object point as the
//! camera sees it. One text for one ray and for eight side by side.

use super::frame::Stages;
use super::matrices::{are_equal, changes, dot, fill_left_out, identity, times_six};
use super::rays::{Rays, of_matrices};
use crate::effects::Stage;
use crate::effects::answer::{Answer, Inputs};
use crate::math::{Number, Several};
use std::ops::Range;

/// Rays as they reach the camera. What follows an unknown follows it by a turn of the camera (a small vector from the
/// left, as `w`) and a shift of the point against the projection centre. Matrices are kept row by row.
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
    /// Whether effects turn the camera, by anything.
    pub turns: bool,
    /// Whether pose and point move the ray otherwise than a straight one: what follows means something only there.
    pub bends: bool,
    /// Whether the shift, too, follows a turn.
    pub shifts_by_turn: bool,
    /// Turn by (w, C), 3 x 6; where effects turn the camera.
    pub turn_by_pose: [K; 18],
    /// Shift by (w, C), 3 x 6.
    pub shift_by_pose: [K; 18],
    /// Shift by P, 3 x 3.
    pub shift_by_point: [K; 9],
    /// Turn and shift by the local parameters of exposure and ray effects, in the order of [`Stages::ray_locals`].
    pub by_theta: Vec<[K; 6]>,
    /// Derivatives of (r, C) by local parameters; where these are not of exposure effects, they mean nothing.
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
            shifts_by_turn: false,
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

/// Where in [`Stages::ray_locals`] that stands which moves the pose: parameters of exposure effects, and the place.
fn of_pose(stages: &Stages) -> impl Iterator<Item = Range<usize>> {
    let exposure = stages.of(Stage::Exposure).iter().map(|e| stages.ray_places[*e].clone());
    exposure.chain([stages.place_columns()])
}

impl<K: Copy + Default + PartialEq> Ray<K> {
    /// Sends rays from `point` to images with this `pose` (rotation vector and projection centre) through the effects
    /// of exposure and ray. `Err`: the place of the first outside the domain of one.
    #[inline(always)]
    pub fn bend<R: Rays<Number: Several<Kept = K>>>(
        &mut self,
        rays: &R,
        stages: &Stages,
        pose: &[K; 6],
        point: &[K; 3],
    ) -> Result<(), usize> {
        let seed = rays.seed();
        let nothing = K::default();
        let (of_r, mut pose) = ([pose[0], pose[1], pose[2]], *pose);

        // Exposure: (r, C), with derivatives by (r, C) before and by the parameters.
        self.pose_by_theta.resize(stages.ray_locals.len(), [nothing; 6]);
        let places_of_all = stages.place_columns();
        self.pose_by_theta[places_of_all.clone()].fill([nothing; 6]);
        let mut by_pose: Option<[K; 36]> = None;
        for (position, &e) in stages.of(Stage::Exposure).iter().enumerate() {
            let places = stages.ray_places[e].clone();
            let count = places.len();
            let mut next = [nothing; 6];
            self.d_own.resize(self.d_own.len().max(6 * count), nothing);
            let (d_in, d_own) = (&mut self.d_in, &mut self.d_own[..6 * count]);
            let inputs =
                rays.ask(e, &pose, &mut Answer { out: &mut next, d_input: Some(d_in), d_theta: Some(d_own) })?;
            // Most move the centre alone, and none does anything at zero, where candidates are tested.
            if changes(seed, &self.d_in, 6, 0, inputs) {
                fill_left_out::<R::Number>(&mut self.d_in, 6, 0, 0..6, inputs);
                let d_in = &self.d_in;
                by_pose = Some(match by_pose {
                    Some(before) => times_six(seed, d_in, &before),
                    None => *d_in,
                });
                let before = stages.of(Stage::Exposure)[..position].iter().map(|e| stages.ray_places[*e].clone());
                for columns in before.chain([places_of_all.clone()]) {
                    for column in &mut self.pose_by_theta[columns] {
                        let before = *column;
                        for i in 0..6 {
                            column[i] = dot(seed, (d_in, 6 * i, 1), (&before, 0, 1), 6).keep();
                        }
                    }
                }
            }
            for (p, column) in self.pose_by_theta[places].iter_mut().enumerate() {
                for i in 0..6 {
                    column[i] = self.d_own[count * i + p];
                }
            }
            for (column, axis) in self.pose_by_theta[places_of_all.clone()].iter_mut().zip(&stages.place_axes) {
                if stages.reads_place[e][*axis] {
                    let mut own = [nothing; 6];
                    rays.by_place(e, &pose, *axis, &mut own)?;
                    for i in 0..6 {
                        column[i] = (seed.of(column[i]) + seed.of(own[i])).keep();
                    }
                }
            }
            pose = next;
        }
        let [r0, r1, r2, centre @ ..] = pose;
        (self.rotation_vector, self.centre) = ([r0, r1, r2], centre);
        self.turned = !are_equal(seed, &self.rotation_vector, &of_r);
        self.turns = by_pose.is_some();
        for columns in of_pose(stages) {
            for column in &self.pose_by_theta[columns] {
                self.turns |= !are_equal(seed, &column[..3], &[nothing; 3]);
            }
        }

        // By (w, C): the turn, and the centre.
        let left_jacobian: [K; 9] = match (self.turns, self.turned) {
            (false, _) => [nothing; 9],
            (true, false) => of_matrices(rays, |frame| &frame.left_jacobian),
            (true, true) => rays.matrices(&self.rotation_vector, crate::math::rotation::left_jacobian),
        };
        if self.turns {
            self.turn_by_pose = identity::<R::Number, 18>(3, 0);
        }
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
        }

        // Ray: P, with derivatives by P before, (w, C) and the parameters.
        (self.bends, self.shifts_by_turn) = (false, by_pose.is_some());
        if by_pose.is_some() {
            self.begin_to_bend::<R::Number>();
        }
        self.point = *point;
        self.by_theta.resize(stages.ray_locals.len(), [nothing; 6]);
        for columns in of_pose(stages) {
            self.by_theta[columns].fill([nothing; 6]);
        }
        for (position, &e) in stages.of(Stage::Ray).iter().enumerate() {
            let own = stages.ray_places[e].clone();
            let count = own.len();
            let [p0, p1, p2] = self.point;
            let input = [pose[0], pose[1], pose[2], pose[3], pose[4], pose[5], p0, p1, p2];
            let mut next = [nothing; 3];
            self.d_own.resize(self.d_own.len().max(3 * count), nothing);
            let (d_in, d_own) = (&mut self.d_in[..27], &mut self.d_own[..3 * count]);
            let inputs =
                rays.ask(e, &input, &mut Answer { out: &mut next, d_input: Some(d_in), d_theta: Some(d_own) })?;
            if changes(seed, &self.d_in[..27], 3, 6, inputs) {
                fill_left_out::<R::Number>(&mut self.d_in[..27], 3, 6, 3..9, inputs);
                let turns = self.go_through(rays, by_pose.as_ref(), inputs);
                for columns in of_pose(stages) {
                    self.carry(seed, columns, true, turns);
                }
                for &before in &stages.of(Stage::Ray)[..position] {
                    self.carry(seed, stages.ray_places[before].clone(), false, turns);
                }
            }
            for (p, column) in self.by_theta[own].iter_mut().enumerate() {
                let shift = |i: usize| self.d_own[count * i + p];
                *column = [nothing, nothing, nothing, shift(0), shift(1), shift(2)];
            }
            for (column, axis) in self.by_theta[places_of_all.clone()].iter_mut().zip(&stages.place_axes) {
                if stages.reads_place[e][*axis] {
                    let mut own = [nothing; 3];
                    rays.by_place(e, &input, *axis, &mut own)?;
                    for i in 0..3 {
                        column[3 + i] = (seed.of(column[3 + i]) + seed.of(own[i])).keep();
                    }
                }
            }
            self.point = next;
        }

        // The shift is that of the point against the centre.
        for i in 0..3 {
            for k in 0..6 {
                let by_centre = match &by_pose {
                    Some(by_pose) => seed.of(by_pose[18 + 6 * i + k]),
                    None if k == 3 + i => seed.like(1.0),
                    None => continue,
                };
                if self.bends {
                    self.shift_by_pose[6 * i + k] = (seed.of(self.shift_by_pose[6 * i + k]) - by_centre).keep();
                }
            }
        }
        for places in of_pose(stages) {
            for (column, pose) in self.by_theta[places.clone()].iter_mut().zip(&self.pose_by_theta[places]) {
                for i in 0..3 {
                    if self.turns {
                        column[i] = dot(seed, (&left_jacobian, 3 * i, 1), (pose, 0, 1), 3).keep();
                    }
                    column[3 + i] = (seed.of(column[3 + i]) - seed.of(pose[3 + i])).keep();
                }
            }
        }
        Ok(())
    }

    /// A ray that is straight, as one that may bend.
    #[inline(always)]
    fn begin_to_bend<T: Several<Kept = K>>(&mut self) {
        self.bends = true;
        self.shift_by_pose = [K::default(); 18];
        self.shift_by_point = identity::<T, 9>(3, 0);
    }

    /// Derivatives by pose and point so far, through a ray effect that has just been asked, with the `inputs` that it
    /// may depend on. Does it depend on the rotation?
    #[inline(always)]
    fn go_through<R: Rays<Number: Several<Kept = K>>>(
        &mut self,
        rays: &R,
        by_pose: Option<&[K; 36]>,
        inputs: Inputs,
    ) -> bool {
        let (seed, d_in) = (rays.seed(), &self.d_in[..27]);
        let mut by_rotation = seed.like(0.0);
        for k in (0..3).filter(|k| inputs.contains(*k)) {
            for i in 0..3 {
                by_rotation = by_rotation + seed.of(d_in[9 * i + k]).abs();
            }
        }
        let turns = !by_rotation.is_zero();
        self.shifts_by_turn |= turns;
        if turns {
            fill_left_out::<R::Number>(&mut self.d_in[..27], 3, 6, 0..3, inputs);
        }
        let was_straight = !self.bends;
        if was_straight {
            self.begin_to_bend::<R::Number>();
        }
        let d_in = &self.d_in[..27];
        if was_straight && !turns {
            // Most models have no more than this.
            for i in 0..3 {
                self.shift_by_pose[6 * i + 3..][..3].copy_from_slice(&d_in[9 * i + 3..][..3]);
                self.shift_by_point[3 * i..][..3].copy_from_slice(&d_in[9 * i + 6..][..3]);
            }
        } else {
            let (before_pose, before_point) = (self.shift_by_pose, self.shift_by_point);
            let d_rotation_vector: [K; 9] = match turns && by_pose.is_none() {
                true => of_matrices(rays, |frame| &frame.d_rotation_vector),
                false => [K::default(); 9],
            };
            for i in 0..3 {
                let row = 9 * i;
                for k in 0..6 {
                    let mut sum = dot(seed, (d_in, row + 6, 1), (&before_pose, k, 6), 3);
                    match by_pose {
                        Some(by_pose) => sum = sum + dot(seed, (d_in, row + 3, 1), (by_pose, 18 + k, 6), 3),
                        None if k >= 3 => sum = sum + seed.of(d_in[row + k]),
                        None => {}
                    }
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
        }
        turns
    }

    /// What the parameters at `places` do to the point, and to the pose where they are `of_pose`, through the ray
    /// effect that has just been asked.
    #[inline(always)]
    fn carry<T: Several<Kept = K>>(&mut self, seed: T, places: Range<usize>, of_pose: bool, turns: bool) {
        let d_in = &self.d_in[..27];
        for (column, pose) in self.by_theta[places.clone()].iter_mut().zip(&self.pose_by_theta[places]) {
            let before = *column;
            for i in 0..3 {
                let row = 9 * i;
                let mut sum = dot(seed, (d_in, row + 6, 1), (&before, 3, 1), 3);
                if of_pose {
                    sum = sum + dot(seed, (d_in, row + 3, 1), (pose, 3, 1), 3);
                }
                if of_pose && turns {
                    sum = sum + dot(seed, (d_in, row, 1), (pose, 0, 1), 3);
                }
                column[3 + i] = sum.keep();
            }
        }
    }

    /// [`Self::bend`] without derivatives, or with those by the point alone: [`Self::shift_by_point`], where
    /// [`Self::bends`] says so.
    #[inline(always)]
    pub fn shift<R: Rays<Number: Several<Kept = K>>>(
        &mut self,
        rays: &R,
        stages: &Stages,
        (pose, point): (&[K; 6], &[K; 3]),
        by_point: bool,
    ) -> Result<(), usize> {
        let (seed, nothing) = (rays.seed(), K::default());
        let (of_r, mut pose) = ([pose[0], pose[1], pose[2]], *pose);
        for &e in stages.of(Stage::Exposure) {
            let mut next = [nothing; 6];
            rays.ask(e, &pose, &mut Answer { out: &mut next, d_input: None, d_theta: None })?;
            pose = next;
        }
        (self.point, self.bends) = (*point, false);
        for &e in stages.of(Stage::Ray) {
            let [p0, p1, p2] = self.point;
            let input = [pose[0], pose[1], pose[2], pose[3], pose[4], pose[5], p0, p1, p2];
            let mut next = [nothing; 3];
            let d_in = &mut self.d_in[..27];
            let d_input = by_point.then_some(&mut *d_in);
            let inputs = rays.ask(e, &input, &mut Answer { out: &mut next, d_input, d_theta: None })?;
            self.point = next;
            if by_point && changes(seed, d_in, 3, 6, inputs) {
                fill_left_out::<R::Number>(d_in, 3, 6, 6..9, inputs);
                let before = if self.bends { self.shift_by_point } else { identity::<R::Number, 9>(3, 0) };
                for i in 0..3 {
                    for k in 0..3 {
                        self.shift_by_point[3 * i + k] = dot(seed, (d_in, 9 * i + 6, 1), (&before, k, 3), 3).keep();
                    }
                }
                self.bends = true;
            }
        }
        let [r0, r1, r2, centre @ ..] = pose;
        (self.rotation_vector, self.centre) = ([r0, r1, r2], centre);
        self.turned = !are_equal(seed, &self.rotation_vector, &of_r);
        Ok(())
    }
}
