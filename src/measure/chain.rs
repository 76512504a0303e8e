//! One image measurement through the whole chain, with its derivatives composed by hand.

use super::frame::{Frame, Stages};
use crate::camera::{DCX, DCY, PARAMETER_COUNT, PPX, PPY, fraser};
use crate::effects::{Context, IMAGE_INTERIOR, Stage};
use crate::math::rotation;
use crate::problem::{ImageObservation, Problem};
use nalgebra::{SMatrix, Vector3};

/// Predicted image point and its derivatives; buffers are reused from measurement to measurement.
#[derive(Debug, Clone, Default)]
pub struct Prediction {
    /// Predicted point, px.
    pub point: [f64; 2],
    /// By the camera's twelve numbers.
    pub d_camera: [[f64; PARAMETER_COUNT]; 2],
    /// By rotation `w` and projection centre.
    pub d_pose: [[f64; 6]; 2],
    /// By the object point.
    pub d_point: [[f64; 3]; 2],
    /// By the local list of effect parameters.
    pub d_theta: [Vec<f64>; 2],
    scratch: Scratch,
}

/// Work space of the general chain.
#[derive(Debug, Clone, Default)]
struct Scratch {
    /// Derivative of (r, C) after the exposure stage by local parameters, 6 each.
    pose_by_theta: Vec<[f64; 6]>,
    /// Derivative of P after the ray stage by local parameters, 3 each.
    point_by_theta: Vec<[f64; 3]>,
    d_own: Vec<f64>,
}

/// Predicts the image point of `object` in the image of `frame`. `None`: behind the camera, or outside an effect's domain.
pub fn predict(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    observation: &ImageObservation,
    object: &Vector3<f64>,
    out: &mut Prediction,
) -> Option<()> {
    if stages.plain_image() {
        predict_plain(frame, object, out)?;
        for row in &mut out.d_theta {
            row.clear();
            row.resize(stages.local_len, 0.0);
        }
    } else {
        predict_with_effects(problem, stages, frame, observation, object, out)?;
    }
    if problem.tie_dc_to_pp {
        for row in &mut out.d_camera {
            row[PPX] += row[DCX];
            row[PPY] += row[DCY];
            (row[DCX], row[DCY]) = (0.0, 0.0);
        }
    }
    Some(())
}

/// The predicted point alone.
pub fn predict_point(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    observation: &ImageObservation,
    object: &Vector3<f64>,
    scratch: &mut Prediction,
) -> Option<[f64; 2]> {
    if stages.plain_image() {
        return fraser::project(&frame.interior, frame.view(object).camera_point());
    }
    predict_with_effects(problem, stages, frame, observation, object, scratch)?;
    Some(scratch.point)
}

fn predict_plain(frame: &Frame, object: &Vector3<f64>, out: &mut Prediction) -> Option<()> {
    let view = frame.view(object);
    let camera_point = view.camera_point();
    if camera_point[2] <= 0.0 {
        return None;
    }
    let prediction = view.predict(camera_point);
    (out.point, out.d_camera, out.d_point) = (prediction.point, prediction.d_camera, prediction.d_point);
    for ((pose, rotation), point) in out.d_pose.iter_mut().zip(&prediction.d_rotation).zip(&prediction.d_point) {
        pose[..3].copy_from_slice(rotation);
        pose[3..].copy_from_slice(&point.map(|d| -d));
    }
    Some(())
}

/// Numbers that an image effect gets.
const IMAGE_INPUTS: usize = Stage::Image.inputs();

/// Derivatives of a stage's output by its input where an effect hands on what it gets, row by row.
const IMAGE_IDENTITY: [f64; 2 * IMAGE_INPUTS] = identity(2, 0);
const POSE_IDENTITY: [f64; 36] = identity(6, 0);
const RAY_IDENTITY: [f64; 27] = identity(3, 6);

/// `[0 I 0]` of so many rows, `I` from column `first` on.
const fn identity<const N: usize>(rows: usize, first: usize) -> [f64; N] {
    let mut matrix = [0.0; N];
    let mut row = 0;
    while row < rows {
        matrix[row * (N / rows) + first + row] = 1.0;
        row += 1;
    }
    matrix
}

fn predict_with_effects(
    problem: &Problem,
    stages: &Stages,
    frame: &Frame,
    observation: &ImageObservation,
    object: &Vector3<f64>,
    out: &mut Prediction,
) -> Option<()> {
    let context = Context {
        block: &problem.block_context,
        image: &problem.image_contexts[observation.image as usize],
        column_px: observation.x,
        row_px: observation.y,
        surveyed: None,
    };
    let n = stages.local_len;
    let own = |e: usize| (stages.local_offset[e], problem.effects[e].slots.len());
    let Prediction { scratch, d_theta, .. } = out;
    for row in d_theta.iter_mut() {
        row.clear();
        row.resize(n, 0.0);
    }

    // Exposure: (r, C), with derivatives by (w, C) and by the parameters.
    let mut pose = [0.0; 6];
    pose[..3].copy_from_slice(frame.rotation_vector.as_slice());
    pose[3..].copy_from_slice(frame.centre.as_slice());
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
        effect.eval(&context, &pose, theta, &mut next, Some(&mut d_in), Some(&mut scratch.d_own)).ok()?;
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
        effect.eval(&context, &input, theta, &mut next, Some(&mut d_in), Some(&mut scratch.d_own)).ok()?;
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
    let mut xy = projection.point;
    let through_pose = d_q * q_by_rc;
    let through_point = d_q * r;
    let mut by_pose = through_pose * pose_by_pose + through_point * p_by_pose;
    let mut by_point = through_point * p_by_point;
    // By the interior orientation after its effects; the chain through the effects comes last.
    let mut by_interior = SMatrix::<f64, 2, PARAMETER_COUNT>::from_fn(|i, j| projection.d_interior[i][j]);
    for k in &stages.ray_locals {
        let sum = through_pose * SMatrix::<f64, 6, 1>::from_column_slice(&scratch.pose_by_theta[*k])
            + through_point * Vector3::from_column_slice(&scratch.point_by_theta[*k]);
        d_theta[0][*k] = sum[0];
        d_theta[1][*k] = sum[1];
    }
    for &e in stages.of(Stage::Image) {
        let (offset, count) = own(e);
        let theta = &frame.theta[offset..offset + count];
        let mut input = [0.0; IMAGE_INPUTS];
        input[..IMAGE_INTERIOR].copy_from_slice(&xy);
        input[IMAGE_INTERIOR..].copy_from_slice(&frame.interior);
        let mut next = [0.0; 2];
        let mut d_in = [0.0; 2 * IMAGE_INPUTS];
        scratch.d_own.resize(2 * count, 0.0);
        let effect = &problem.effects[e].effect;
        effect.eval(&context, &input, theta, &mut next, Some(&mut d_in), Some(&mut scratch.d_own)).ok()?;
        let [d_x, d_y] = d_theta;
        if d_in != IMAGE_IDENTITY {
            let d_in = SMatrix::<f64, 2, IMAGE_INPUTS>::from_row_slice(&d_in);
            let by_xy = d_in.fixed_view::<2, 2>(0, 0).into_owned();
            by_pose = by_xy * by_pose;
            by_point = by_xy * by_point;
            by_interior = by_xy * by_interior + d_in.fixed_view::<2, PARAMETER_COUNT>(0, IMAGE_INTERIOR);
            for (x, y) in d_x.iter_mut().zip(d_y.iter_mut()) {
                let (a, b) = (*x, *y);
                *x = by_xy[(0, 0)] * a + by_xy[(0, 1)] * b;
                *y = by_xy[(1, 0)] * a + by_xy[(1, 1)] * b;
            }
        }
        for k in 0..count {
            d_x[offset + k] += scratch.d_own[k];
            d_y[offset + k] += scratch.d_own[count + k];
        }
        xy = next;
    }
    if let Some(chain) = &frame.interior_chain {
        let by_rotation = by_interior * chain.d_rotation;
        for i in 0..2 {
            for k in 0..3 {
                by_pose[(i, k)] += by_rotation[(i, k)];
            }
            for k in &stages.interior_locals {
                let column = &chain.d_theta[*k];
                d_theta[i][*k] += column.iter().enumerate().map(|(j, c)| by_interior[(i, j)] * c).sum::<f64>();
            }
        }
        by_interior *= chain.d_interior;
    }
    out.point = xy;
    for i in 0..2 {
        out.d_camera[i] = std::array::from_fn(|k| by_interior[(i, k)]);
        out.d_pose[i] = std::array::from_fn(|k| by_pose[(i, k)]);
        out.d_point[i] = std::array::from_fn(|k| by_point[(i, k)]);
    }
    Some(())
}
