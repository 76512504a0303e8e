//! What a function of the errors at check points makes of the computed coordinates of every surveyed point.
//!
//! Where a free block comes into the survey's system by a similarity from its control points, an error of one of
//! these moves all check points. With `d = s R P + t - S` at the check points, and the similarity the least-squares
//! one of the control points,
//!
//! ```text
//! l'd = sum over check points l' d(sRP - S)  -  sum over control points w (A_k M^-1 q)' d(sRP - S)
//! M = sum w A'A,   q = sum A_c'l
//! ```
//!
//! with `A` the derivatives of a point by scale, turn and shift. Second-order terms, of the residuals times the
//! change of a similarity, are left out.

use super::patterns::COEFFICIENTS;
use crate::block::{Block, Role};
use crate::evaluate::{Comparison, Similarity, similarity_weight};
use crate::math::rotation::skew;
use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3};

/// Of one point: coordinates in the survey's system by functions.
pub type OfPoint = SMatrix<f64, 3, COEFFICIENTS>;

type Alignment = SMatrix<f64, 3, 7>;
type Shares = SMatrix<f64, 7, COEFFICIENTS>;

/// One [`OfPoint`] for each row of the comparison, of `functions` of the height errors of its check points. `None`
/// where the control points do not determine the similarity.
pub fn of_rows(block: &Block, comparison: &Comparison, functions: &DMatrix<f64>) -> Option<Vec<OfPoint>> {
    let mut checks = functions.row_iter();
    let mut shares: Vec<OfPoint> = Vec::with_capacity(comparison.rows.len());
    for row in &comparison.rows {
        let mut own = OfPoint::zeros();
        if row.role == Role::Check {
            own.set_row(2, &checks.next()?.fixed_columns::<COEFFICIENTS>(0));
        }
        shares.push(own);
    }
    if comparison.fit.is_none() {
        return Some(shares);
    }
    let computed: Vec<Vector3<f64>> = comparison.rows.iter().map(|row| row.position + row.d).collect();
    let weight = |k: usize| similarity_weight(block, comparison.rows[k].point);
    let control: Vec<usize> = (0..computed.len()).filter(|k| comparison.rows[*k].role == Role::Control).collect();
    let sum: f64 = control.iter().map(|k| weight(*k)).sum();
    let centre = control.iter().map(|k| computed[*k] * weight(*k)).sum::<Vector3<f64>>() / sum;
    let by_similarity = |k: usize| {
        let arm = computed[k] - centre;
        let mut a = Alignment::zeros();
        a.set_column(0, &arm);
        a.fixed_view_mut::<3, 3>(0, 1).copy_from(&-skew(&arm));
        a.fixed_view_mut::<3, 3>(0, 4).copy_from(&Matrix3::identity());
        a
    };
    let normal: SMatrix<f64, 7, 7> =
        control.iter().map(|k| by_similarity(*k).transpose() * by_similarity(*k) * weight(*k)).sum();
    let moved: Shares = (0..computed.len()).map(|k| by_similarity(k).transpose() * shares[k]).sum();
    let moved = normal.cholesky()?.solve(&moved);
    for k in control {
        shares[k] -= by_similarity(k) * moved * weight(k);
    }
    Some(shares)
}

/// Derivative of a point in the survey's system by the same in the block's.
pub fn linear(similarity: Option<&Similarity>) -> Matrix3<f64> {
    similarity.map_or_else(Matrix3::identity, |s| s.rotation.to_rotation_matrix().into_inner() * s.scale)
}
