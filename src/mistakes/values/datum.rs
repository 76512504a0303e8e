//! Control points that cannot fix a block alone: fewer than a similarity needs, or all in a line.

use super::tables::Tables;
use crate::mistakes::Mistake;
use crate::mistakes::survey::Subject;
use nalgebra::{Matrix3, Vector3};

/// Points, or GNSS positions, that fix a block: a similarity has seven parameters, two points give six.
const FIX: usize = 3;
/// Images in which a point is seen from two directions, so that its coordinates hold the block.
const SEEN: usize = 2;
/// Distance of the cameras from the line over that of the control points. The block turns about the line, which
/// magnifies an error of the points so many times at the cameras.
const TURNED: f64 = 10.0;

/// Control points that are too few for a datum, or in a line. `with_gnss`: positions of the cameras take part, and fix
/// a block without control.
pub fn judge(tables: &Tables, with_gnss: bool) -> Option<Mistake> {
    if with_gnss && tables.images.iter().filter(|image| image.gnss.is_some()).count() >= FIX {
        return None;
    }
    let mut seen = vec![0; tables.surveyed.len()];
    for row in tables.marks.iter() {
        if let Some(count) = seen.get_mut(row.point) {
            *count += 1;
        }
    }
    let is_control = |k: &usize| tables.surveyed[*k].subject == Subject::Control && seen[*k] >= SEEN;
    let control: Vec<usize> = (0..seen.len()).filter(is_control).collect();
    let positions: Vec<Vector3<f64>> = control.iter().map(|k| tables.surveyed[*k].position).collect();
    let (kind, value, unit, what) = match positions.len() {
        0 => return None,
        count if count < FIX => {
            let are = if count == 1 { "is" } else { "are" };
            ("too-few", count as f64, "points", format!("only {count} {are} marked in two images or more"))
        }
        count => {
            let distance = distance_from_line(&positions, tables)?;
            ("in-line", distance, "m", format!("all {count} lie within {distance:.2} m (RMS) of one line"))
        }
    };
    let sentence = format!(
        "Control points: {what}. The position, orientation and scale of a block need {FIX} points that are not in a \
         line, or GNSS positions."
    );
    let remedy = "Use check points as control (role of control.csv), mark more of them (marks.csv), or adjust without \
                  a datum (--datum free).";
    let names = control.into_iter().map(|k| tables.surveyed[k].name.clone()).collect();
    Some(Mistake::new(kind, Subject::Control.key(), sentence, remedy.into()).of(names).sized(value, None, unit))
}

/// Mean distance (RMS) of positions from their line, where that is near against the cameras' distance from it.
fn distance_from_line(positions: &[Vector3<f64>], tables: &Tables) -> Option<f64> {
    let count = positions.len() as f64;
    let middle = positions.iter().sum::<Vector3<f64>>() / count;
    let moments: Matrix3<f64> = positions.iter().map(|p| (p - middle) * (p - middle).transpose()).sum();
    let axes = moments.symmetric_eigen();
    let along = axes.eigenvectors.column(axes.eigenvalues.imax()).into_owned();
    let beside = |p: &Vector3<f64>| (p - middle).cross(&along).norm_squared();
    let distance = (positions.iter().map(beside).sum::<f64>() / count).sqrt();
    let cameras = tables.images.iter().map(|image| beside(&image.centre)).sum::<f64>() / tables.images.len() as f64;
    (cameras.sqrt() > TURNED * distance).then_some(distance)
}

#[cfg(test)]
mod tests {
    use super::super::tables::{Measured, Row, Surveyed, made};
    use super::*;

    /// A block without GNSS whose control points stand at these places, each marked in the first two images.
    fn with_control(places: &[[f64; 3]]) -> Tables<'static> {
        let mut tables = made::tables();
        tables.surveyed = places
            .iter()
            .enumerate()
            .map(|(k, place)| Surveyed {
                name: format!("gcp{k}"),
                subject: Subject::Control,
                position: (*place).into(),
                exchanged: None,
                met: None,
            })
            .collect();
        let mark = |k: usize, image: usize| Row { image, point: k, xy: [100.0, 200.0], sigma: 0.5 };
        let marks = (0..places.len()).flat_map(|k| [mark(k, 0), mark(k, 1)]).collect();
        tables.marks = made::table(Measured::Marks, marks);
        tables
    }

    fn kind(tables: &Tables) -> Option<(String, Option<f64>)> {
        judge(tables, true).map(|found| (found.kind, found.value))
    }

    #[test]
    fn a_datum_needs_three_points_that_are_no_line() {
        let wide = [[0.0, 0.0, 0.0], [90.0, 0.0, 1.0], [40.0, 20.0, 0.0]];
        assert_eq!(kind(&with_control(&wide)), None);
        assert_eq!(kind(&with_control(&[])), None);
        assert_eq!(kind(&with_control(&wide[..1])), Some(("too-few".into(), Some(1.0))));
        assert_eq!(kind(&with_control(&wide[..2])), Some(("too-few".into(), Some(2.0))));
        let line = [[0.0, 0.0, 0.0], [90.0, 1.0, 0.0], [45.0, 0.0, 0.0], [20.0, 0.0, 0.0]];
        let (found, distance) = kind(&with_control(&line)).expect("a line");
        assert_eq!(found, "in-line");
        assert!(distance.is_some_and(|distance| (0.1..1.0).contains(&distance)), "{distance:?}");
    }

    #[test]
    fn positions_of_the_cameras_fix_a_block_as_well() {
        let mut tables = with_control(&[[0.0, 0.0, 0.0], [90.0, 0.0, 1.0]]);
        tables.images.iter_mut().take(3).for_each(|image| image.gnss = Some(image.centre));
        assert_eq!(kind(&tables), None);
        assert!(judge(&tables, false).is_some(), "where they take no part");
    }

    #[test]
    fn points_that_one_image_sees_count_for_nothing() {
        let mut tables = with_control(&[[0.0, 0.0, 0.0], [90.0, 0.0, 1.0], [40.0, 20.0, 0.0]]);
        let rows = tables.marks.iter().filter(|row| row.point < 2 || row.image == 0).collect();
        tables.marks = made::table(Measured::Marks, rows);
        assert_eq!(kind(&tables), Some(("too-few".into(), Some(2.0))));
    }
}
