//! A ray that effects bend or move on its way: the exposure stage moves the pose, the ray stage the object point as the camera sees it.

use super::chain::{Prediction, identity};
use super::frame::{Frame, Stages};
use crate::camera::fraser;
use crate::effects::{Context, Stage};
use crate::math::rotation;
use crate::problem::Problem;
use nalgebra::{SMatrix, Vector3};

/// Derivatives of a stage's output by its input where an effect hands on what it gets, row by row.
const POSE_IDENTITY: [f64; 36] = identity(6, 0);
const RAY_IDENTITY: [f64; 27] = identity(3, 6);

/// Effects of exposure and ray, then the camera; derivatives by the interior orientation are those after its effects.
pub(super) fn predict_bent(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    context: &Context<'_>,
    object: &Vector3<f64>,
    out: &mut Prediction,
) -> Option<()> {
    let n = stages.local_len;
    let own = |e: usize| (stages.local_offset[e], problem.effects[e].slots.len());
    let Prediction { scratch, d_theta, .. } = out;

    // Exposure: (r, C), with derivatives by (w, C) and by the parameters.
    let mut pose = frame.pose();
    let mut pose_by_pose = SMatrix::<f64, 6, 6>::identity();
    pose_by_pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&frame.d_rotation_vector);
    scratch.pose_by_theta.resize(n, [0.0; 6]);
    scratch.point_by_theta.resize(n, [0.0; 3]);
    for k in &stages.ray_locals {
        scratch.pose_by_theta[*k] = [0.0; 6];
        scratch.point_by_theta[*k] = [0.0; 3];
    }
    let mut moved_rotation = false;
    for &e in stages.of(Stage::Exposure) {
        let (offset, count) = own(e);
        let theta = &frame.theta[offset..offset + count];
        let mut next = [0.0; 6];
        let mut d_in = [0.0; 36];
        scratch.d_own.resize(6 * count, 0.0);
        let effect = &problem.effects[e].effect;
        effect.eval(context, &pose, theta, &mut next, Some(&mut d_in), Some(&mut scratch.d_own)).ok()?;
        // At zero, where candidates are tested, an effect hands its input on.
        if d_in != POSE_IDENTITY {
            let d_in = SMatrix::<f64, 6, 6>::from_row_slice(&d_in);
            pose_by_pose = d_in * pose_by_pose;
            for k in &stages.ray_locals {
                let column = &mut scratch.pose_by_theta[*k];
                let moved = d_in * SMatrix::<f64, 6, 1>::from_column_slice(column);
                column.copy_from_slice(moved.as_slice());
            }
        }
        for p in 0..count {
            for i in 0..6 {
                scratch.pose_by_theta[offset + p][i] += scratch.d_own[count * i + p];
            }
        }
        moved_rotation |= next[..3] != pose[..3];
        pose = next;
    }
    let vector = Vector3::new(pose[0], pose[1], pose[2]);
    let centre = Vector3::new(pose[3], pose[4], pose[5]);
    let (r, left_jacobian) = match moved_rotation {
        true => (rotation::exp(&vector), rotation::left_jacobian(&vector)),
        false => (frame.rotation, frame.left_jacobian),
    };

    // Ray: P, with derivatives by P, (w, C) and the parameters.
    let mut p = *object;
    let mut p_by_point = SMatrix::<f64, 3, 3>::identity();
    let mut p_by_pose = SMatrix::<f64, 3, 6>::zeros();
    for &e in stages.of(Stage::Ray) {
        let (offset, count) = own(e);
        let theta = &frame.theta[offset..offset + count];
        let mut input = [0.0; 9];
        input[..6].copy_from_slice(&pose);
        input[6..].copy_from_slice(p.as_slice());
        let mut next = [0.0; 3];
        let mut d_in = [0.0; 27];
        scratch.d_own.resize(3 * count, 0.0);
        let effect = &problem.effects[e].effect;
        effect.eval(context, &input, theta, &mut next, Some(&mut d_in), Some(&mut scratch.d_own)).ok()?;
        if d_in != RAY_IDENTITY {
            let d_in = SMatrix::<f64, 3, 9>::from_row_slice(&d_in);
            let by_pose = d_in.fixed_view::<3, 6>(0, 0).into_owned();
            let by_point = d_in.fixed_view::<3, 3>(0, 6).into_owned();
            p_by_pose = by_pose * pose_by_pose + by_point * p_by_pose;
            p_by_point = by_point * p_by_point;
            for k in &stages.ray_locals {
                let column = &mut scratch.point_by_theta[*k];
                let moved = by_pose * SMatrix::<f64, 6, 1>::from_column_slice(&scratch.pose_by_theta[*k])
                    + by_point * Vector3::from_column_slice(column);
                column.copy_from_slice(moved.as_slice());
            }
        }
        for k in 0..count {
            for i in 0..3 {
                scratch.point_by_theta[offset + k][i] += scratch.d_own[count * i + k];
            }
        }
        p = Vector3::from(next);
    }

    // Camera frame: q = R (P - C), dq = -[q]x J(r) dr + R (dP - dC).
    let q = r * (p - centre);
    let mut q_by_rc = SMatrix::<f64, 3, 6>::zeros();
    q_by_rc.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-rotation::skew(&q) * left_jacobian));
    q_by_rc.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-r));

    // Image point.
    let projection = fraser::project_with_derivatives(&frame.interior, [q.x, q.y, q.z])?;
    let d_q = SMatrix::<f64, 2, 3>::from_fn(|i, j| projection.d_camera_point[i][j]);
    let through_pose = d_q * q_by_rc;
    let through_point = d_q * r;
    let by_pose = through_pose * pose_by_pose + through_point * p_by_pose;
    let by_point = through_point * p_by_point;
    for k in &stages.ray_locals {
        let sum = through_pose * SMatrix::<f64, 6, 1>::from_column_slice(&scratch.pose_by_theta[*k])
            + through_point * Vector3::from_column_slice(&scratch.point_by_theta[*k]);
        d_theta[0][*k] = sum[0];
        d_theta[1][*k] = sum[1];
    }
    (out.point, out.d_camera) = (projection.point, projection.d_interior);
    for i in 0..2 {
        out.d_pose[i] = std::array::from_fn(|k| by_pose[(i, k)]);
        out.d_point[i] = std::array::from_fn(|k| by_point[(i, k)]);
    }
    Some(())
}
