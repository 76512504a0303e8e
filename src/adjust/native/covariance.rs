//! Covariance for unit weight from the factorised reduced system.

use super::factor::Factor;
use super::linearise::rays_do_not_meet;
use super::point::{PointRows, Prepared, inverse_of_damped};
use crate::adjust::{AdjustError, Covariance, CovarianceOf};
use faer::Mat;
use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3};
use rayon::prelude::*;
use std::ops::Range;

/// Up to this many reduced unknowns their whole inverse is formed: 8 x 8000^2 bytes = 0.5 GB.
pub const INVERSE_UNKNOWNS: usize = 8000;

/// Covariance of camera and effect parameters, at a solution.
pub fn shared(at: &Prepared<'_>, factor: &Factor) -> Covariance {
    let Prepared { problem, structure, .. } = at;
    let first = problem.layout().theta(0);
    let scaled = factor.border_covariance();
    let scale = &structure.border_scale;
    let shared = DMatrix::from_fn(scale.len(), scale.len(), |i, j| scaled[(i, j)] * scale[i] * scale[j]);
    let mut theta_variances = vec![0.0; problem.theta.len()];
    for (i, unknown) in structure.border.iter().enumerate().filter(|(_, unknown)| **unknown >= first) {
        theta_variances[unknown - first] = shared[(i, i)];
    }
    Covariance {
        shared_unknowns: structure.border.clone(),
        shared,
        poses: Vec::new(),
        points: Vec::new(),
        theta_variances,
    }
}

/// Covariance of what is asked for, at a solution. Errors: `Everything` of a block too large for the whole inverse.
pub fn covariance(at: &Prepared<'_>, factor: &Factor, of: CovarianceOf) -> Result<Option<Covariance>, AdjustError> {
    let Prepared { problem, structure, .. } = at;
    let layout = problem.layout();
    let (n, m) = (structure.images * structure.dim, structure.border.len());
    if of == CovarianceOf::Nothing {
        return Ok(None);
    }
    let mut covariance = shared(at, factor);
    if of == CovarianceOf::Shared {
        return Ok(Some(covariance));
    }
    if n + m > INVERSE_UNKNOWNS {
        let option = format!(
            "the covariance of every pose and point of {} images (at most {INVERSE_UNKNOWNS} reduced unknowns); ask \
             for that of cameras and effects alone",
            structure.images
        );
        return Err(AdjustError::Unsupported { solver: super::NAME, option });
    }
    let inverse = factor.inverse();
    for image in 0..structure.images {
        let base = structure.rank[image] as usize * structure.dim;
        let free = |k: usize| structure.image_unknowns[base + k] != usize::MAX;
        covariance.poses.push(SMatrix::from_fn(
            |i, j| {
                if free(i) && free(j) { inverse[(base + i, base + j)] } else { 0.0 }
            },
        ));
        for column in &structure.own[image] {
            let position = base + column.row as usize;
            let t = structure.image_unknowns[position] - layout.theta(0);
            covariance.theta_variances[t] = inverse[(position, position)] * column.scale * column.scale;
        }
    }
    covariance.points = match structure.dim {
        6 => points::<6>(at, &inverse)?,
        7 => points::<7>(at, &inverse)?,
        8 => points::<8>(at, &inverse)?,
        _ => points::<{ super::MAX_DIM }>(at, &inverse)?,
    };
    Ok(Some(covariance))
}

/// `V^-1 + V^-1 W' S^-1 W V^-1` of every point. Errors: a point that its rays do not fix.
fn points<const D: usize>(at: &Prepared<'_>, inverse: &Mat<f64>) -> Result<Vec<Matrix3<f64>>, AdjustError> {
    let structure = at.structure;
    let n = structure.images * D;
    let part = |chunk: &Range<usize>| -> Result<Vec<Matrix3<f64>>, AdjustError> {
        let mut rows = PointRows::<D>::new();
        let of_point = |j: usize| -> Result<Matrix3<f64>, AdjustError> {
            rows.linearise(at, j)?;
            let v = inverse_of_damped(&rows.v_matrix, 0.0).ok_or_else(|| rays_do_not_meet(at.problem, j))?;
            Ok(v + spread(&rows, inverse, n, &v))
        };
        chunk.clone().map(of_point).collect()
    };
    let parts: Vec<Vec<Matrix3<f64>>> = structure.chunks.par_iter().map(part).collect::<Result<_, _>>()?;
    Ok(parts.concat())
}

/// `V^-1 W' S^-1 W V^-1` over the point's images and the border.
fn spread<const D: usize>(rows: &PointRows<D>, inverse: &Mat<f64>, n: usize, v_inverse: &Matrix3<f64>) -> Matrix3<f64> {
    let mut positions = Vec::with_capacity(rows.rows.len() * D + rows.columns.len());
    let mut columns: Vec<Vector3<f64>> = Vec::with_capacity(positions.capacity());
    for row in &rows.rows {
        for k in 0..D {
            positions.push(row.rank as usize * D + k);
            columns.push(v_inverse * Vector3::from(row.w[k]));
        }
    }
    for (l, column) in rows.columns.index().iter().enumerate() {
        positions.push(n + *column as usize);
        columns.push(v_inverse * Vector3::new(rows.w_shared[0][l], rows.w_shared[1][l], rows.w_shared[2][l]));
    }
    let mut sum = Matrix3::zeros();
    for (p, a) in positions.iter().zip(&columns) {
        let mut carried = Vector3::zeros();
        for (q, b) in positions.iter().zip(&columns) {
            carried += b * inverse[(*p, *q)];
        }
        sum += a * carried.transpose();
    }
    sum
}
