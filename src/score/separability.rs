//! What a block cannot tell apart: how much of one set's estimated effect another set could take.

use super::System;
use super::pivoted::Pivoted;
use nalgebra::{DMatrix, DVector};

/// Correlation of two effects in the measurements, once the base is taken out, above which this block cannot tell
/// them apart.
pub const INSEPARABLE: f64 = 0.9;

/// Correlation between the estimated effect of a set and what another set can take of it: the root of the share of the
/// drop of the first, if it were the truth, that the second alone would bring. The other way round it need not be the
/// same.
pub fn seen_by(system: &System, one: &Pivoted, other: &Pivoted) -> f64 {
    seen(system, &one.kept, &one.estimate(), other)
}

/// The same for values `values` of columns `columns`.
pub fn seen(system: &System, columns: &[usize], values: &DVector<f64>, other: &Pivoted) -> f64 {
    let n = columns.len();
    let own = DMatrix::from_fn(n, n, |i, j| system.information[(columns[i], columns[j])]);
    let length = values.dot(&(own * values));
    if length <= 0.0 || other.kept.is_empty() {
        return 0.0;
    }
    let cross =
        DMatrix::from_fn(other.kept.len(), n, |i, j| system.information[(other.kept[i], columns[j])] * other.scale[i]);
    let mut taken = cross * values;
    other.factor.solve_lower_triangular_mut(&mut taken);
    (taken.norm_squared() / length).sqrt().min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn correlation_of_two_columns() {
        let information = DMatrix::from_row_slice(2, 2, &[4.0, 3.0, 3.0, 9.0]);
        let system = System {
            score: DVector::from_column_slice(&[2.0, 1.0]),
            length: vec![4.0, 9.0],
            least: vec![0.0; 2],
            information: information.into(),
            chi_square: 10.0,
            redundancy: 10.0,
        };
        let (one, other) = (system.pivoted(&[0]), system.pivoted(&[1]));
        assert_relative_eq!(seen_by(&system, &one, &other), 0.5, epsilon = 1e-12);
        assert_relative_eq!(seen_by(&system, &one, &one), 1.0, epsilon = 1e-12);
        assert_eq!(seen_by(&system, &one, &system.pivoted(&[])), 0.0);
    }
}
