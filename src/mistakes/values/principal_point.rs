//! Principal point in millimetres, or measured from the centre of the image.

use super::tables::{Camera, Tables};
use crate::block::edit::{Change, Edit};
use crate::mistakes::Mistake;

/// A principal point within this share of both sides from the corner is none: makers centre the lens to a few per cent.
const NEAR_ZERO: f64 = 0.05;
/// How far from the centre, as a share of a side, a principal point may be.
const NEAR_CENTRE: f64 = 0.1;

/// How a point must be read that is none in pixels from the corner.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Reading {
    /// Pixels from the centre of the sensor.
    FromCentre,
    /// Millimetres from the corner; pixels per millimetre.
    Millimetres(f64),
    /// One of them, or millimetres from the centre.
    Unknown,
}

impl Reading {
    fn change(self, camera: &Camera, axis: usize, column: &str) -> Option<Change> {
        match self {
            Self::FromCentre => Some(Change::plus(column, camera.centre()[axis])),
            Self::Millimetres(per_mm) => Some(Change::times(column, per_mm)),
            Self::Unknown => None,
        }
    }
}

fn is_near_zero(camera: &Camera, point: [f64; 2]) -> bool {
    (0..2).all(|axis| point[axis].abs() < NEAR_ZERO * camera.sides[axis])
}

fn is_near_centre(camera: &Camera, point: [f64; 2]) -> bool {
    (0..2).all(|axis| (point[axis] - camera.centre()[axis]).abs() < NEAR_CENTRE * camera.sides[axis])
}

/// Reading of a point near zero.
fn reading(camera: &Camera, point: [f64; 2]) -> Reading {
    if point == [0.0, 0.0] {
        return Reading::FromCentre;
    }
    let Some(per_mm) = camera.per_mm() else { return Reading::Unknown };
    if is_near_centre(camera, point.map(|value| value * per_mm)) {
        return Reading::Millimetres(per_mm);
    }
    let [x, y] = camera.centre();
    let millimetres_from_centre = [x + point[0] * per_mm, y + point[1] * per_mm];
    if is_near_centre(camera, millimetres_from_centre) { Reading::Unknown } else { Reading::FromCentre }
}

/// Principal points that are near the corner of the image.
pub fn judge(tables: &Tables) -> Vec<Mistake> {
    tables.cameras.iter().filter(|camera| is_near_zero(camera, camera.principal)).map(mistake).collect()
}

fn mistake(camera: &Camera) -> Mistake {
    let [x, y] = camera.principal;
    let reading = reading(camera, camera.principal);
    let (words, remedy) = match reading {
        Reading::FromCentre => {
            ("it is measured from the centre of the image".into(), "Add half the width and half the height")
        }
        Reading::Millimetres(per_mm) => {
            (format!("it is given in millimetres ({per_mm:.3} px each)"), "Convert it to pixels")
        }
        Reading::Unknown => (
            "it is measured from the centre of the image, or given in millimetres".to_string(),
            "Give it in pixels from the outer corner of the top-left pixel",
        ),
    };
    let sentence =
        format!("Camera {}: the principal point {x}, {y} is at the corner of the image; {words}.", camera.id);
    let mut mend = edits(camera, reading, ["ppx", "ppy"]);
    let centre = camera.distortion_centre;
    if is_near_zero(camera, centre) {
        let same = self::reading(camera, centre) == reading;
        let more = if same { edits(camera, reading, ["dcx", "dcy"]) } else { Vec::new() };
        mend = if more.is_empty() { more } else { mend.into_iter().chain(more).collect() };
    }
    Mistake::new("principal-point-unit", "camera", sentence, format!("{remedy} (ppx, ppy, dcx, dcy of block.toml)."))
        .of(vec![camera.id.clone()])
        .sized(x.hypot(y), None, if matches!(reading, Reading::Millimetres(_)) { "mm" } else { "px" })
        .undone_by(mend)
}

fn edits(camera: &Camera, reading: Reading, columns: [&str; 2]) -> Vec<Edit> {
    let changes = columns.iter().enumerate().filter_map(|(axis, column)| reading.change(camera, axis, column));
    changes.map(|change| Edit::all("block.toml", change).of("id", std::slice::from_ref(&camera.id))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tables::made;
    use super::*;

    fn judged(principal: [f64; 2], pixel_um: Option<f64>) -> Vec<Mistake> {
        let mut tables = made::tables();
        let own = &mut tables.cameras[0];
        (own.principal, own.distortion_centre, own.pixel_um) = (principal, principal, pixel_um);
        judge(&tables)
    }

    #[test]
    fn an_offset_from_the_centre_is_mended() {
        for (principal, pixel_um) in [([0.0, 0.0], None), ([12.0, -9.0], Some(2.0))] {
            let found = judged(principal, pixel_um);
            assert_eq!(found.len(), 1, "{found:?}");
            let changes: Vec<_> = found[0].mend.iter().map(|edit| edit.change.clone()).collect();
            let expected = [("ppx", 2000.0), ("ppy", 1500.0), ("dcx", 2000.0), ("dcy", 1500.0)];
            assert_eq!(changes, expected.map(|(column, offset)| Change::plus(column, offset)));
        }
    }

    #[test]
    fn millimetres_from_the_corner_are_mended() {
        let found = judged([4.02, 2.99], Some(2.0));
        assert_eq!((found.len(), found[0].unit.as_deref()), (1, Some("mm")));
        assert_eq!(found[0].mend[0].change, Change::times("ppx", 500.0));
    }

    #[test]
    fn where_two_readings_are_possible_none_is_mended() {
        for (principal, pixel_um) in [([0.02, -0.01], Some(2.0)), ([4.02, 2.99], None)] {
            let found = judged(principal, pixel_um);
            assert_eq!((found.len(), found[0].mend.len()), (1, 0), "{found:?}");
        }
    }

    #[test]
    fn a_point_of_the_sensor_is_right() {
        for principal in [[2010.0, 1495.0], [2000.0, 0.0], [700.0, 600.0], [f64::NAN, 0.0]] {
            assert!(judged(principal, Some(2.0)).is_empty(), "{principal:?}");
        }
    }
}
