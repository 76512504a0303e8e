//! A change of three coordinates by the names of their columns: surveyed points, antennas, projection centres,
//! velocities.

use super::edit::Change;
use nalgebra::Vector3;

/// Makes a change of a position whose zero lies at `origin` in the system of the files; `None` where it is none of
/// these columns.
pub(super) fn change_position(
    position: &mut Vector3<f64>,
    origin: &Vector3<f64>,
    columns: [&str; 3],
    change: &Change,
) -> Option<()> {
    let axis = |column: &String| columns.iter().position(|own| own == column);
    match change {
        Change::Affine { column, factor, offset } => {
            let axis = axis(column)?;
            position[axis] = factor * (position[axis] + origin[axis]) + offset - origin[axis];
        }
        Change::ExchangeColumns { columns: [a, b] } => {
            let mut recorded = *position + origin;
            recorded.swap_rows(axis(a)?, axis(b)?);
            *position = recorded - origin;
        }
        Change::Set { column, value } => {
            let axis = axis(column)?;
            position[axis] = value.parse::<f64>().ok()? - origin[axis];
        }
        _ => return None,
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: [&str; 3] = ["x", "y", "z"];

    fn after(change: Change) -> Option<[f64; 3]> {
        let mut position = Vector3::new(1.0, 2.0, 3.0);
        change_position(&mut position, &Vector3::new(100.0, 200.0, 0.0), COLUMNS, &change)?;
        Some(position.into())
    }

    #[test]
    fn numbers_change_as_they_stand_in_the_file() {
        assert_eq!(after(Change::times("x", 2.0)), Some([102.0, 2.0, 3.0]));
        assert_eq!(after(Change::plus("z", -1.0)), Some([1.0, 2.0, 2.0]));
        let columns = ["x", "y"].map(String::from);
        assert_eq!(after(Change::ExchangeColumns { columns }), Some([102.0, -99.0, 3.0]));
        assert_eq!(after(Change::Set { column: "y".into(), value: "205".into() }), Some([1.0, 5.0, 3.0]));
    }

    #[test]
    fn other_columns_and_changes_are_none() {
        assert_eq!(after(Change::times("vx", 2.0)), None);
        assert_eq!(after(Change::Set { column: "y".into(), value: "north".into() }), None);
        assert_eq!(after(Change::Remove), None);
    }
}
