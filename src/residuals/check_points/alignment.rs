//! What a function of the errors at check points makes of the computed coordinates of every surveyed point.
//!
//! Where a free block comes into the survey's system by a similarity from its control points, an error of one of these
//! moves all check points. The similarity is the least-squares one: with `a` a computed point in the survey's system,
//! counted from their middle, and `e` its residual at a control point,
//!
//! ```text
//! sum w (a'e, a x e, e) = 0,   and so   sum w (A + B)' (A dx + da) = 0   with   A = (a, -[a]x, I),   B = (e, [e]x, 0)
//! l'd = sum over check points l' da  -  sum over control points w ((A + B) H^-T q)' da
//! H = sum w (A + B)'A,   q = sum over check points A'l
//! ```
//!
//! where `dx` is the change of scale, turn and shift and `da` what the errors of the block do to the point.

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
    through_similarity(block, comparison, shares)
}

/// The same of the three coordinates of the point of one row, the first three functions.
pub fn of_point(block: &Block, comparison: &Comparison, row: usize) -> Option<Vec<OfPoint>> {
    let mut shares = vec![OfPoint::zeros(); comparison.rows.len()];
    shares[row] = OfPoint::identity();
    through_similarity(block, comparison, shares)
}

/// What control points add, which determine the similarity of a free block.
fn through_similarity(block: &Block, comparison: &Comparison, mut shares: Vec<OfPoint>) -> Option<Vec<OfPoint>> {
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
        columns(&arm, &-skew(&arm), &Matrix3::identity())
    };
    let with_residual = |k: usize| {
        let e = &comparison.rows[k].d;
        by_similarity(k) + columns(e, &skew(e), &Matrix3::zeros())
    };
    let normal: SMatrix<f64, 7, 7> =
        control.iter().map(|k| with_residual(*k).transpose() * by_similarity(*k) * weight(*k)).sum();
    let moved: Shares = (0..computed.len()).map(|k| by_similarity(k).transpose() * shares[k]).sum();
    let moved = normal.transpose().lu().solve(&moved)?;
    for k in control {
        shares[k] -= with_residual(k) * moved * weight(k);
    }
    Some(shares)
}

/// Of scale, turn and shift.
fn columns(scale: &Vector3<f64>, turn: &Matrix3<f64>, shift: &Matrix3<f64>) -> Alignment {
    let mut columns = Alignment::zeros();
    columns.set_column(0, scale);
    columns.fixed_view_mut::<3, 3>(0, 1).copy_from(turn);
    columns.fixed_view_mut::<3, 3>(0, 4).copy_from(shift);
    columns
}

/// Derivative of a point in the survey's system by the same in the block's.
pub fn linear(similarity: Option<&Similarity>) -> Matrix3<f64> {
    similarity.map_or_else(Matrix3::identity, |s| s.rotation.to_rotation_matrix().into_inner() * s.scale)
}
