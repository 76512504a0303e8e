//! Symmetric matrices of which one triangle was computed.

use nalgebra::DMatrix;

/// Side of the blocks in which a matrix is mirrored: two of them stay in the nearest cache.
const MIRROR_BLOCK: usize = 32;

/// Makes a square matrix symmetric by its lower triangle.
pub fn mirror_lower(matrix: &mut DMatrix<f64>) {
    let n = matrix.nrows();
    let entries = matrix.as_mut_slice();
    for first in (0..n).step_by(MIRROR_BLOCK) {
        for below in (first..n).step_by(MIRROR_BLOCK) {
            for row in below..(below + MIRROR_BLOCK).min(n) {
                for column in first..(first + MIRROR_BLOCK).min(row) {
                    entries[row * n + column] = entries[column * n + row];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_of_several_blocks_becomes_symmetric() {
        let n = 2 * MIRROR_BLOCK + 5;
        let entry = |i: usize, j: usize| (i.max(j) * n + i.min(j)) as f64;
        let mut matrix = DMatrix::from_fn(n, n, |i, j| if i < j { -1.0 } else { entry(i, j) });
        mirror_lower(&mut matrix);
        assert_eq!(matrix, DMatrix::from_fn(n, n, entry));
    }
}
