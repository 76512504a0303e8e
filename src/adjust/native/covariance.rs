//! Covariance for unit weight from the factorised reduced system.

use super::factor::Factor;
use super::linearise::rays_do_not_meet;
use super::point::{PointRows, Prepared, inverse_of_damped};
use crate::adjust::{AdjustError, Covariance, CovarianceOf, PointParts};
use faer::Mat;
use nalgebra::{DMatrix, Matrix3, Matrix3xX, SMatrix, Vector3};
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
        point_parts: Vec::new(),
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
    let with_parts = of == CovarianceOf::WithParts;
    (covariance.points, covariance.point_parts) = match structure.dim {
        6 => points::<6>(at, &inverse, with_parts)?,
        7 => points::<7>(at, &inverse, with_parts)?,
        8 => points::<8>(at, &inverse, with_parts)?,
        _ => points::<{ super::MAX_DIM }>(at, &inverse, with_parts)?,
    };
    Ok(Some(covariance))
}

/// Covariance of a point, and its parts where they are wanted.
type OfPoint = (Matrix3<f64>, Option<PointParts>);

/// `V^-1 + V^-1 W' S^-1 W V^-1` of every point, and its parts where they are wanted. Errors: a point that its rays do
/// not fix.
fn points<const D: usize>(
    at: &Prepared<'_>,
    inverse: &Mat<f64>,
    with_parts: bool,
) -> Result<(Vec<Matrix3<f64>>, Vec<PointParts>), AdjustError> {
    let structure = at.structure;
    let part = |chunk: &Range<usize>| -> Result<Vec<OfPoint>, AdjustError> {
        let mut rows = PointRows::<D>::new();
        let of_point = |j: usize| {
            rows.linearise(at, j)?;
            let rays = inverse_of_damped(&rows.v_matrix, 0.0).ok_or_else(|| rays_do_not_meet(at.problem, j))?;
            let carried = Carried::of(&rows, structure.images * D, &rays);
            let with_shared = || carried.with_border(inverse, &structure.border_scale);
            let parts = with_parts.then(|| PointParts { rays, with_shared: with_shared() });
            Ok((rays + carried.covariance(inverse), parts))
        };
        chunk.clone().map(of_point).collect()
    };
    let all: Vec<Vec<_>> = structure.chunks.par_iter().map(part).collect::<Result<_, _>>()?;
    let (points, parts): (Vec<_>, Vec<_>) = all.into_iter().flatten().unzip();
    Ok((points, parts.into_iter().flatten().collect()))
}

/// `V^-1 W'` of a point: what its images' unknowns and those of the border carry into it.
struct Carried {
    /// Row of the whole inverse of each.
    positions: Vec<usize>,
    columns: Vec<Vector3<f64>>,
    /// Rows of the images.
    n: usize,
}

impl Carried {
    fn of<const D: usize>(rows: &PointRows<D>, n: usize, rays: &Matrix3<f64>) -> Self {
        let mut positions = Vec::with_capacity(rows.rows.len() * D + rows.columns.len());
        let mut columns: Vec<Vector3<f64>> = Vec::with_capacity(positions.capacity());
        for row in &rows.rows {
            for k in 0..D {
                positions.push(row.rank as usize * D + k);
                columns.push(rays * Vector3::from(row.w[k]));
            }
        }
        for (l, column) in rows.columns.index().iter().enumerate() {
            positions.push(n + *column as usize);
            columns.push(rays * Vector3::new(rows.w_shared[0][l], rows.w_shared[1][l], rows.w_shared[2][l]));
        }
        Self { positions, columns, n }
    }

    /// `V^-1 W' S^-1 W V^-1`.
    fn covariance(&self, inverse: &Mat<f64>) -> Matrix3<f64> {
        let mut sum = Matrix3::zeros();
        for (p, a) in self.positions.iter().zip(&self.columns) {
            sum += a * self.along(inverse, *p).transpose();
        }
        sum
    }

    /// `-V^-1 W' S^-1` at the border, raw units.
    fn with_border(&self, inverse: &Mat<f64>, scale: &[f64]) -> Matrix3xX<f64> {
        let columns: Vec<Vector3<f64>> =
            scale.iter().enumerate().map(|(l, scale)| -*scale * self.along(inverse, self.n + l)).collect();
        Matrix3xX::from_columns(&columns)
    }

    /// `V^-1 W'` times a row of the inverse.
    fn along(&self, inverse: &Mat<f64>, row: usize) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for (q, b) in self.positions.iter().zip(&self.columns) {
            sum += b * inverse[(row, *q)];
        }
        sum
    }
}
