//! A ray that effects bend or move on its way: the exposure stage moves the pose, the ray stage the object point as the
//! camera sees it.

use super::frame::{Frame, Stages};
use super::through::{BY_THETA, SHIFT, SHIFT_BY_POINT, TURN, identity};
use crate::effects::{Context, Stage};
use crate::math::rotation;
use crate::problem::Problem;
use nalgebra::{Matrix3, Matrix3x6, SMatrix, Vector3};

/// Derivatives of a stage's output by its input where an effect hands on what it gets, row by row.
const POSE_IDENTITY: [f64; 36] = identity(6, 0);
const RAY_IDENTITY: [f64; 27] = identity(3, 6);

/// A ray as it reaches the camera. What follows an unknown follows it by a turn of the camera (a small vector from the
/// left, as `w`) and a shift of the point against the projection centre.
#[derive(Debug, Clone)]
pub(super) struct Ray {
    /// `R'`.
    pub rotation: Matrix3<f64>,
    /// `C'`.
    pub centre: Vector3<f64>,
    /// `P'`.
    pub point: Vector3<f64>,
    /// Turn by (w, C).
    pub turn_by_pose: Matrix3x6<f64>,
    /// Whether effects turn the camera, by anything.
    pub turns: bool,
    /// Shift by (w, C).
    pub shift_by_pose: Matrix3x6<f64>,
    /// Shift by P.
    pub shift_by_point: Matrix3<f64>,
    /// Turn and shift by the local parameters of exposure and ray effects, in the order of [`Stages::ray_locals`].
    pub by_theta: Vec<[Vector3<f64>; 2]>,
    work: Work,
}

/// Work space.
#[derive(Debug, Clone, Default)]
struct Work {
    /// Derivatives of (r, C) by local parameters.
    pose_by_theta: Vec<SMatrix<f64, 6, 1>>,
    /// Derivatives of an effect's output by its own parameters, row by row.
    d_own: Vec<f64>,
}

impl Default for Ray {
    fn default() -> Self {
        Self {
            rotation: Matrix3::identity(),
            centre: Vector3::zeros(),
            point: Vector3::zeros(),
            turn_by_pose: Matrix3x6::zeros(),
            turns: false,
            shift_by_pose: Matrix3x6::zeros(),
            shift_by_point: Matrix3::identity(),
            by_theta: Vec::new(),
            work: Work::default(),
        }
    }
}

impl Ray {
    /// Sends it from `object` through the effects of exposure and ray. `None`: outside the domain of one.
    pub fn bend(
        &mut self,
        problem: &Problem,
        stages: &Stages,
        frame: &Frame,
        context: &Context<'_>,
        object: &Vector3<f64>,
    ) -> Option<()> {
        let Work { pose_by_theta, d_own } = &mut self.work;
        let instance = |e: usize| {
            let own = stages.locals(problem, e);
            // The list of these parameters has those of each effect together.
            let first = stages.ray_locals.partition_point(|k| *k < own.start);
            (&problem.effects[e].effect, &frame.theta[own.clone()], first..first + own.len())
        };
        pose_by_theta.clear();
        pose_by_theta.resize(stages.ray_locals.len(), SMatrix::zeros());

        // Exposure: (r, C), with derivatives by (r, C) before and by the parameters.
        let mut pose = frame.pose();
        let mut by_pose: Option<SMatrix<f64, 6, 6>> = None;
        for &e in stages.of(Stage::Exposure) {
            let (effect, theta, places) = instance(e);
            let mut next = [0.0; 6];
            let mut d_in = [0.0; 36];
            d_own.resize(6 * theta.len(), 0.0);
            effect.eval(context, &pose, theta, &mut next, Some(&mut d_in), Some(d_own)).ok()?;
            // Most move the centre alone, and none does anything at zero, where candidates are tested.
            if d_in != POSE_IDENTITY {
                let d_in = SMatrix::<f64, 6, 6>::from_row_slice(&d_in);
                by_pose = Some(by_pose.map_or(d_in, |before| d_in * before));
                pose_by_theta.iter_mut().for_each(|column| *column = d_in * *column);
            }
            for (p, column) in pose_by_theta[places].iter_mut().enumerate() {
                for i in 0..6 {
                    column[i] += d_own[theta.len() * i + p];
                }
            }
            pose = next;
        }
        let vector = Vector3::new(pose[0], pose[1], pose[2]);
        self.centre = Vector3::new(pose[3], pose[4], pose[5]);
        let left_jacobian = match vector == frame.rotation_vector {
            true => {
                self.rotation = frame.rotation;
                frame.left_jacobian
            }
            false => {
                self.rotation = rotation::exp(&vector);
                rotation::left_jacobian(&vector)
            }
        };
        // By (w, C): the turn, and the centre.
        self.turn_by_pose = Matrix3x6::identity();
        let mut centre_by_pose = Matrix3x6::zeros();
        centre_by_pose.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        if let Some(by_pose) = &mut by_pose {
            let by_turn = by_pose.fixed_view::<6, 3>(0, 0) * frame.d_rotation_vector;
            by_pose.fixed_view_mut::<6, 3>(0, 0).copy_from(&by_turn);
            self.turn_by_pose = left_jacobian * by_pose.fixed_view::<3, 6>(0, 0);
            centre_by_pose = by_pose.fixed_view::<3, 6>(3, 0).into_owned();
        }

        // Ray: P, with derivatives by P before, (w, C) and the parameters.
        self.point = *object;
        self.shift_by_point = Matrix3::identity();
        self.shift_by_pose = Matrix3x6::zeros();
        self.by_theta.clear();
        self.by_theta.resize(stages.ray_locals.len(), [Vector3::zeros(); 2]);
        for &e in stages.of(Stage::Ray) {
            let (effect, theta, places) = instance(e);
            let mut input = [0.0; 9];
            input[..6].copy_from_slice(&pose);
            input[6..].copy_from_slice(self.point.as_slice());
            let mut next = [0.0; 3];
            let mut d_in = [0.0; 27];
            d_own.resize(3 * theta.len(), 0.0);
            effect.eval(context, &input, theta, &mut next, Some(&mut d_in), Some(d_own)).ok()?;
            if d_in != RAY_IDENTITY {
                let d_in = SMatrix::<f64, 3, 9>::from_row_slice(&d_in);
                let by_vector = d_in.fixed_view::<3, 3>(0, 0).into_owned();
                let by_centre = d_in.fixed_view::<3, 3>(0, 3).into_owned();
                let by_point = d_in.fixed_view::<3, 3>(0, 6).into_owned();
                let turns = by_vector != Matrix3::zeros();
                let mut by_pose_now = by_centre * centre_by_pose + by_point * self.shift_by_pose;
                if turns {
                    match &by_pose {
                        Some(by_pose) => by_pose_now += by_vector * by_pose.fixed_view::<3, 6>(0, 0),
                        None => {
                            let mut of_turn = by_pose_now.fixed_view_mut::<3, 3>(0, 0);
                            of_turn += by_vector * frame.d_rotation_vector;
                        }
                    }
                }
                self.shift_by_pose = by_pose_now;
                self.shift_by_point = by_point * self.shift_by_point;
                for ([_, shift], pose) in self.by_theta.iter_mut().zip(&*pose_by_theta) {
                    *shift = by_point * *shift + by_centre * pose.fixed_view::<3, 1>(3, 0);
                    if turns {
                        *shift += by_vector * pose.fixed_view::<3, 1>(0, 0);
                    }
                }
            }
            for (p, [_, shift]) in self.by_theta[places].iter_mut().enumerate() {
                for i in 0..3 {
                    shift[i] += d_own[theta.len() * i + p];
                }
            }
            self.point = Vector3::from(next);
        }

        // The shift is that of the point against the centre.
        self.shift_by_pose -= centre_by_pose;
        self.turns = by_pose.is_some();
        for ([turn, shift], pose) in self.by_theta.iter_mut().zip(&*pose_by_theta) {
            *turn = left_jacobian * pose.fixed_view::<3, 1>(0, 0);
            *shift -= pose.fixed_view::<3, 1>(3, 0);
            self.turns |= *turn != Vector3::zeros();
        }
        Some(())
    }

    /// Hands out the numbers of `through_ray`, with their places.
    pub fn write(&self, mut put: impl FnMut(usize, f64)) {
        let matrices = [(TURN, self.turn_by_pose.as_slice()), (SHIFT, self.shift_by_pose.as_slice())];
        for (first, numbers) in matrices.into_iter().chain([(SHIFT_BY_POINT, self.shift_by_point.as_slice())]) {
            numbers.iter().enumerate().for_each(|(k, value)| put(first + k, *value));
        }
        for (p, [turn, shift]) in self.by_theta.iter().enumerate() {
            turn.iter().chain(shift).enumerate().for_each(|(k, value)| put(BY_THETA + 6 * p + k, *value));
        }
    }
}
