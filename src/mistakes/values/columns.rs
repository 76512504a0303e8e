//! Columns x and y of a table exchanged.

use super::extent::{self, Extent};
use super::sensor;
use super::tables::{Camera, Table, Tables};
use crate::block::edit::{Change, Edit};
use crate::mistakes::Mistake;

/// Fewest measurements beyond the shorter side that no blunder of a matching explains.
const FEWEST: usize = 3;
/// The same as a share of all: blunders that leave the sensor are one in a thousand.
const SHARE: f64 = 0.01;
/// Probability that no measurement reaches along the longer side beyond the shorter one. Measurements beyond the
/// sensor prove the rest.
const LEVEL: f64 = 1e-3;
/// Sides that differ by less than this share tell nothing.
const SQUARE: f64 = 0.05;

/// Does the extent fit the sensor with its columns exchanged, and not as it is?
fn is_exchanged(camera: &Camera, extent: &Extent) -> bool {
    let (longer, shorter) = (camera.longer(), camera.shorter());
    let axis = usize::from(camera.sides[1] < camera.sides[0]);
    let beyond = extent.beyond[axis];
    let fits = extent.high[1 - axis] <= shorter + extent::EDGE_PX && extent.high[axis] <= longer + extent::EDGE_PX;
    let chance = extent.independent as f64 * (shorter / longer).ln();
    let many = beyond >= FEWEST && beyond as f64 >= SHARE * extent.count as f64;
    shorter < (1.0 - SQUARE) * longer && many && fits && extent.before == 0 && chance < LEVEL.ln()
}

/// Measurements of a table whose columns are exchanged. `whole`: extents of both tables together, for the sensor's
/// own sides.
pub fn judge(table: &Table, tables: &Tables, extents: &[Extent], whole: &[Extent]) -> Vec<Mistake> {
    let sides: Vec<bool> = tables.cameras.iter().zip(whole).map(|(own, all)| sensor::is_exchanged(own, all)).collect();
    let cameras: Vec<usize> =
        (0..tables.cameras.len()).filter(|k| is_exchanged(&tables.cameras[*k], &extents[*k]) && !sides[*k]).collect();
    let Some(first) = cameras.first() else { return Vec::new() };
    let images = extent::images(tables, extents, &cameras);
    let ([width, height], high) = (tables.cameras[*first].sides, extents[*first].high);
    let sentence = format!(
        "{}: x and y are exchanged; they reach {:.1}, {:.1} px on a sensor of {width} x {height} px.",
        table.of.words(),
        high[0],
        high[1]
    );
    let remedy = format!(
        "Exchange the columns x and y of {}; if the images were turned after exposure, measure in the original ones.",
        table.of.file()
    );
    let edit = Edit::all(table.of.file(), Change::ExchangeColumns { columns: ["x".into(), "y".into()] });
    let edit = if images.is_empty() { edit } else { edit.of("image", &images) };
    vec![Mistake::new("columns-exchanged", table.of.key(), sentence, remedy).of(images).undone_by(vec![edit])]
}

#[cfg(test)]
mod tests {
    use super::super::tables::{Row, made};
    use super::*;

    fn judged(change: impl Fn([f64; 2]) -> [f64; 2], principal: [f64; 2]) -> Vec<Mistake> {
        let rows = made::rows(10).into_iter().map(|row| Row { xy: change(row.xy), ..row }).collect();
        let mut tables = made::with_rows(rows);
        tables.cameras[0].principal = principal;
        let extents = extent::of(&tables.ties, &tables);
        judge(&tables.ties, &tables, &extents, &extents)
    }

    #[test]
    fn columns_that_fit_the_sensor_when_exchanged() {
        let found = judged(|[x, y]| [y, x], [2010.0, 1495.0]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].kind.as_str(), found[0].subject.as_str()), ("columns-exchanged", "ties"));
        assert_eq!(found[0].mend.len(), 1);
    }

    #[test]
    fn the_sides_of_the_sensor_are_exchanged_where_the_principal_point_says_so() {
        assert!(judged(|[x, y]| [y, x], [1495.0, 2010.0]).is_empty());
    }

    #[test]
    fn measurements_of_the_sensor_are_right() {
        assert!(judged(|xy| xy, [2010.0, 1495.0]).is_empty());
        // A block that is seen in the left three quarters alone.
        assert!(judged(|[x, y]| [0.7 * x, y], [2010.0, 1495.0]).is_empty());
        // Undistorted measurements leave the sensor on both sides.
        assert!(judged(|[x, y]| [0.7 * x, 1500.0 + 1.05 * (y - 1500.0)], [2010.0, 1495.0]).is_empty());
    }
}
