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
    let (kind, value, unit, what) = match control.len() {
        0 => return None,
        count if count < FIX => {
            let are = if count == 1 { "is" } else { "are" };
            ("too-few", count as f64, "points", format!("only {count} {are} marked in two images or more"))
        }
        count => {
            let distance = distance_from_line(&control, tables)?;
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

/// Mean distance (RMS) of control points from their line, where that is near against the cameras' distance from it.
/// Approximate poses may be in a system of their own: their distance is that from the line through the places where the
/// images see the points, in the length of the survey. Not known where images see fewer than two of them at one place.
fn distance_from_line(control: &[usize], tables: &Tables) -> Option<f64> {
    let recorded: Vec<Vector3<f64>> = control.iter().map(|k| tables.surveyed[*k].position).collect();
    let met = control.iter().filter_map(|k| Some((tables.surveyed[*k].position, tables.surveyed[*k].met?)));
    let (there, seen): (Vec<_>, Vec<_>) = met.unzip();
    if seen.len() < 2 {
        return None;
    }
    let cameras: Vec<Vector3<f64>> = tables.images.iter().map(|image| image.centre).collect();
    let distance = Line::through(&recorded).distance(&recorded);
    let (line, line_of_seen) = (Line::through(&there), Line::through(&seen));
    let from_cameras = line_of_seen.distance(&cameras) * line.length / line_of_seen.length;
    (from_cameras.is_finite() && from_cameras > TURNED * distance).then_some(distance)
}

/// The line that some places lie nearest to.
struct Line {
    middle: Vector3<f64>,
    along: Vector3<f64>,
    /// Distance of the places from the middle, RMS along the line.
    length: f64,
}

impl Line {
    fn through(places: &[Vector3<f64>]) -> Self {
        let count = places.len() as f64;
        let middle = places.iter().sum::<Vector3<f64>>() / count;
        let moments: Matrix3<f64> = places.iter().map(|p| (p - middle) * (p - middle).transpose()).sum();
        let axes = moments.symmetric_eigen();
        let along = axes.eigenvectors.column(axes.eigenvalues.imax()).into_owned();
        Self { middle, along, length: (axes.eigenvalues.max() / count).sqrt() }
    }

    /// Distance of places from the line, RMS.
    fn distance(&self, places: &[Vector3<f64>]) -> f64 {
        let beside = |p: &Vector3<f64>| (p - self.middle).cross(&self.along).norm_squared();
        (places.iter().map(beside).sum::<f64>() / places.len() as f64).sqrt()
    }
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
                met: Some((*place).into()),
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

    /// Poses of another program: a ten-thousandth of the size, turned, and somewhere else.
    #[test]
    fn poses_in_a_system_of_their_own_change_nothing() {
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), 2.0);
        for (places, is_line) in [
            ([[0.0, 0.0, 0.0], [90.0, 0.0, 1.0], [40.0, 20.0, 0.0], [30.0, 30.0, 0.0]], false),
            ([[0.0, 0.0, 0.0], [90.0, 1.0, 0.0], [45.0, 0.0, 0.0], [20.0, 0.0, 0.0]], true),
        ] {
            let mut tables = with_control(&places);
            let move_into = |place: Vector3<f64>| 1e-4 * (turn * place) + Vector3::new(3e5, -2e4, 0.0);
            tables.images.iter_mut().for_each(|image| image.centre = move_into(image.centre));
            tables.surveyed.iter_mut().for_each(|point| point.met = Some(move_into(point.position)));
            assert_eq!(kind(&tables).is_some(), is_line, "{places:?}");
        }
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
