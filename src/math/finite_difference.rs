//! Central differences: the independent check of every Jacobian that was derived by hand.

use nalgebra::DMatrix;

/// A step that balances truncation against rounding in a central difference: `cbrt(epsilon)` times the size of the
/// argument, or of `typical` (a magnitude in the argument's unit, for arguments near zero).
pub fn step(x: f64, typical: f64) -> f64 {
    f64::EPSILON.cbrt() * x.abs().max(typical)
}

/// Jacobian (`rows` x `x.len()`) of `f` at `x` by central differences of the given steps, error `O(step^2)`.
///
/// `f(x, out)` fills `rows` values and returns whether it is defined at `x`; `None` where it is not defined on both
/// sides.
pub fn jacobian(
    mut f: impl FnMut(&[f64], &mut [f64]) -> bool,
    x: &[f64],
    steps: &[f64],
    rows: usize,
) -> Option<DMatrix<f64>> {
    let mut result = DMatrix::zeros(rows, x.len());
    let mut moved = x.to_vec();
    let (mut above, mut below) = (vec![0.0; rows], vec![0.0; rows]);
    for (column, (&start, &step)) in x.iter().zip(steps).enumerate() {
        moved[column] = start + step;
        let upper = moved[column];
        if !f(&moved, &mut above) {
            return None;
        }
        moved[column] = start - step;
        // The difference of the arguments as represented, not twice the step as wished.
        let width = upper - moved[column];
        if !f(&moved, &mut below) {
            return None;
        }
        moved[column] = start;
        for row in 0..rows {
            result[(row, column)] = (above[row] - below[row]) / width;
        }
    }
    Some(result)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn curve(x: &[f64], out: &mut [f64]) -> bool {
        out[0] = x[0].sin() * x[1];
        out[1] = x[1].powi(3);
        x[0] < 1.0
    }

    #[test]
    fn derivatives_of_known_functions() {
        let x: [f64; 2] = [0.7, -2.0];
        let expected = DMatrix::from_row_slice(2, 2, &[x[0].cos() * x[1], x[0].sin(), 0.0, 12.0]);
        let steps = [step(x[0], 1.0), step(x[1], 1.0)];
        assert_relative_eq!(jacobian(curve, &x, &steps, 2).unwrap(), expected, epsilon = 1e-8);
    }

    #[test]
    fn undefined_on_one_side_is_none() {
        assert!(jacobian(curve, &[1.0 - 1e-9, 0.0], &[1e-6, 1e-6], 2).is_none());
    }
}
