//! The rank of normal equations in extended precision: 32 digits tell a direction without information from one with
//! little.

use super::normal::{CertifyError, Normal};
use crate::math::DoubleDouble;

/// A pivot of the scaled matrix below this is none. Rounding leaves 1e-30; a near-singular problem, 1e-16 and more.
const NO_PIVOT: f64 = 1e-24;
/// Unknowns of a matrix that is factorised whole.
const MOST_UNKNOWNS: usize = 2000;

/// Directions among the unknowns kept that the measurements do not determine: Cholesky with the largest pivot first.
///
/// # Errors
/// Too many unknowns.
pub fn defect(normal: &Normal, keep: &dyn Fn(usize) -> bool) -> Result<usize, CertifyError> {
    let columns: Vec<usize> = (0..normal.unknowns.len()).filter(|k| keep(normal.unknowns[*k])).collect();
    let n = columns.len();
    if n > MOST_UNKNOWNS {
        return Err(CertifyError::RankTooLarge { unknowns: n, most: MOST_UNKNOWNS });
    }
    let mut matrix = normal.dense(&columns);
    let scale: Vec<f64> =
        (0..n).map(|k| matrix[k * n + k].hi.sqrt()).map(|s| if s > 0.0 { s.recip() } else { 0.0 }).collect();
    for i in 0..n {
        for j in 0..n {
            matrix[i * n + j] = matrix[i * n + j] * scale[i] * scale[j];
        }
    }
    let mut left: Vec<usize> = (0..n).collect();
    while let Some((place, pivot)) = left
        .iter()
        .map(|k| matrix[k * n + k])
        .enumerate()
        .max_by(|a, b| a.1.hi.total_cmp(&b.1.hi))
        .filter(|(_, pivot)| pivot.hi > NO_PIVOT)
    {
        let k = left.swap_remove(place);
        let row: Vec<(usize, DoubleDouble)> =
            left.iter().map(|i| (*i, matrix[k * n + i])).filter(|(_, value)| *value != DoubleDouble::ZERO).collect();
        for (i, a) in &row {
            let share = *a / pivot;
            for (j, b) in &row {
                matrix[i * n + j] -= share * *b;
            }
        }
    }
    Ok(left.len())
}
