//! Image measurements that are no pixels: normalised coordinates, or millimetres.

use super::extent::{self, Extent};
use super::tables::{Camera, Table, Tables};
use crate::block::edit::{Change, Edit};
use crate::mistakes::Mistake;

/// Largest normalised coordinate: an angle of view of 127 degrees.
const NORMALISED: f64 = 2.0;
/// Largest coordinate of a digital sensor in millimetres, from the corner; film is scanned with a known pixel size.
const MILLIMETRES: f64 = 120.0;
/// Excess over the stated size of a sensor: a calibrated pixel size is rounded.
const EXCESS: f64 = 1.1;
/// Other units than pixels fill no more than this share of the shorter side, beside a corner where nobody measures
/// all points.
const SMALL: f64 = 0.05;
/// Fewest measurements, and images, that are no chance.
const FEWEST: [usize; 2] = [10, 2];
/// Smallest extent: zeros stand for missing values, and are no unit.
const EXTENT: f64 = 0.01;
/// A reading must fill the sensor to this share of its sides, and may exceed it by the other one.
const FILLS: [f64; 2] = [0.1, 0.01];
/// Two readings that agree to this are one, px.
const SAME_PX: f64 = 1.0;

/// Unit of coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unit {
    Normalised,
    Millimetres,
}

/// How coordinates become pixels: `factor * value + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reading {
    unit: Unit,
    factor: [f64; 2],
    offset: [f64; 2],
}

impl Reading {
    fn apply(&self, xy: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.factor[axis] * xy[axis] + self.offset[axis])
    }

    /// Do the measurements fill the sensor when they are read so?
    fn fits(&self, camera: &Camera, extent: &Extent) -> bool {
        let [margin, excess] = FILLS;
        let [low, high] = [self.apply(extent.low), self.apply(extent.high)];
        (0..2).all(|axis| {
            let side = camera.sides[axis];
            let [low, high] = [low[axis] / side, high[axis] / side];
            low >= -excess && low <= margin && high >= 1.0 - margin && high <= 1.0 + excess
        })
    }

    fn agrees(&self, other: &Self, extent: &Extent) -> bool {
        [extent.low, extent.high].into_iter().all(|xy| {
            let [one, two] = [self.apply(xy), other.apply(xy)];
            (0..2).all(|axis| (one[axis] - two[axis]).abs() < SAME_PX)
        })
    }
}

/// What programs write in place of pixels.
fn readings(camera: &Camera) -> Vec<Reading> {
    let (longer, centre, zero) = ([camera.longer(); 2], camera.centre(), [0.0; 2]);
    let normalised = |factor, offset| Reading { unit: Unit::Normalised, factor, offset };
    let mut all = vec![
        normalised([camera.focal; 2], camera.principal),
        normalised(longer, centre),
        normalised(camera.sides, zero),
        normalised(longer, zero),
    ];
    let millimetres = |per_mm: f64, offset| Reading { unit: Unit::Millimetres, factor: [per_mm; 2], offset };
    let offsets = [zero, centre, camera.principal];
    all.extend(camera.per_mm().into_iter().flat_map(|per_mm| offsets.map(|offset| millimetres(per_mm, offset))));
    all
}

fn unit(camera: &Camera, extent: &Extent) -> Option<Unit> {
    let reach = extent.reach();
    let [rows, images] = FEWEST;
    let spread = (0..2).map(|axis| extent.high[axis] - extent.low[axis]).fold(f64::INFINITY, f64::min);
    let few = extent.count < rows || extent.images < images;
    // NaN is refused, too.
    if few || !(spread > EXTENT && reach < SMALL * camera.shorter()) {
        return None;
    }
    let fitting: Vec<Unit> =
        readings(camera).iter().filter(|reading| reading.fits(camera, extent)).map(|reading| reading.unit).collect();
    match fitting.as_slice() {
        [first, others @ ..] if others.iter().all(|unit| unit == first) => Some(*first),
        _ if reach <= NORMALISED => Some(Unit::Normalised),
        _ => {
            let largest = camera.per_mm().map_or(MILLIMETRES, |per_mm| EXCESS * camera.longer() / per_mm);
            (reach <= largest).then_some(Unit::Millimetres)
        }
    }
}

/// The one reading that fits; `None` where several do, or none.
fn reading(camera: &Camera, extent: &Extent) -> Option<Reading> {
    let fitting: Vec<Reading> = readings(camera).into_iter().filter(|reading| reading.fits(camera, extent)).collect();
    let (first, others) = fitting.split_first()?;
    others.iter().all(|other| other.agrees(first, extent)).then_some(*first)
}

/// Measurements of a table that are no pixels.
pub fn judge(table: &Table, tables: &Tables, extents: &[Extent]) -> Vec<Mistake> {
    let found = extent::by_finding(tables, extents, unit);
    found.iter().map(|(unit, cameras)| mistake(table, tables, extents, *unit, cameras)).collect()
}

fn mistake(table: &Table, tables: &Tables, extents: &[Extent], unit: Unit, cameras: &[usize]) -> Mistake {
    let images = extent::images(tables, extents, cameras);
    let reach = cameras.iter().map(|k| extents[*k].reach()).fold(0.0, f64::max);
    let (kind, words, key) = match unit {
        Unit::Normalised => ("normalised", "normalised coordinates", "1"),
        Unit::Millimetres => ("millimetres", "millimetres", "mm"),
    };
    let sentence = format!(
        "{}: x and y are {words}; none is above {reach:.3}, and a sensor has thousands of pixels.",
        table.of.words()
    );
    let remedy = format!(
        "Convert them to pixels from the outer corner of the top-left pixel, y downwards ({}).",
        table.of.file()
    );
    let mend: Option<Vec<Edit>> = cameras
        .iter()
        .map(|k| edits(table, tables, extents, *k))
        .collect::<Option<Vec<_>>>()
        .map(|edits| edits.concat());
    Mistake::new(kind, table.of.key(), sentence, remedy)
        .of(images)
        .sized(reach, None, key)
        .undone_by(mend.unwrap_or_default())
}

/// Edits of the measurements of one camera.
fn edits(table: &Table, tables: &Tables, extents: &[Extent], camera: usize) -> Option<Vec<Edit>> {
    let reading = reading(&tables.cameras[camera], &extents[camera])?;
    let images = extent::images(tables, extents, &[camera]);
    let edit = |(axis, column): (usize, &str)| {
        let change =
            Change::Affine { column: column.into(), factor: reading.factor[axis], offset: reading.offset[axis] };
        let edit = Edit::all(table.of.file(), change);
        if images.is_empty() { edit } else { edit.of("image", &images) }
    };
    Some(["x", "y"].into_iter().enumerate().map(edit).collect())
}

#[cfg(test)]
mod tests {
    use super::super::tables::{Row, made};
    use super::*;

    fn judged(pixel_um: Option<f64>, change: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<Mistake> {
        let rows = made::rows(10).into_iter().map(|row| Row { xy: change(row.xy), ..row }).collect();
        let mut tables = made::with_rows(rows);
        tables.cameras[0].pixel_um = pixel_um;
        judge(&tables.ties, &tables, &extent::of(&tables.ties, &tables))
    }

    fn changes(mistake: &Mistake) -> Vec<Change> {
        mistake.mend.iter().map(|edit| edit.change.clone()).collect()
    }

    fn affine(column: &str, factor: f64, offset: f64) -> Change {
        Change::Affine { column: column.into(), factor, offset }
    }

    #[test]
    fn normalised_coordinates_are_mended_where_one_reading_fits() {
        let by_focal = judged(None, |[x, y]| [(x - 2010.0) / 3000.0, (y - 1495.0) / 3000.0]);
        assert_eq!((by_focal.len(), by_focal[0].kind.as_str()), (1, "normalised"), "{by_focal:?}");
        assert_eq!(changes(&by_focal[0]), [affine("x", 3000.0, 2010.0), affine("y", 3000.0, 1495.0)]);
        let by_side = judged(None, |[x, y]| [(x - 2000.0) / 4000.0, (y - 1500.0) / 4000.0]);
        assert_eq!(changes(&by_side[0]), [affine("x", 4000.0, 2000.0), affine("y", 4000.0, 1500.0)]);
        let unit_square = judged(None, |[x, y]| [x / 4000.0, y / 3000.0]);
        assert_eq!(changes(&unit_square[0]), [affine("x", 4000.0, 0.0), affine("y", 3000.0, 0.0)]);
    }

    #[test]
    fn millimetres_are_named_and_mended_where_the_pixel_is_known() {
        let corner = judged(Some(2.0), |xy| xy.map(|value| 0.002 * value));
        assert_eq!((corner.len(), corner[0].kind.as_str()), (1, "millimetres"), "{corner:?}");
        assert_eq!(changes(&corner[0]), [affine("x", 500.0, 0.0), affine("y", 500.0, 0.0)]);
        // From the centre or from the principal point: ten pixels apart.
        let centre = judged(Some(2.0), |[x, y]| [0.002 * (x - 2000.0), 0.002 * (y - 1500.0)]);
        assert_eq!((centre.len(), centre[0].kind.as_str(), centre[0].mend.len()), (1, "millimetres", 0));
        let unknown = judged(None, |[x, y]| [0.006 * (x - 2000.0), 0.006 * (y - 1500.0)]);
        assert_eq!((unknown.len(), unknown[0].kind.as_str(), unknown[0].mend.len()), (1, "millimetres", 0));
    }

    #[test]
    fn pixels_and_zeros_are_no_unit() {
        assert!(judged(Some(2.0), |xy| xy).is_empty());
        assert!(judged(Some(2.0), |_| [0.0, 0.0]).is_empty());
        // A tenth of the sensor: measured in a small image, whatever that is.
        assert!(judged(Some(2.0), |xy| xy.map(|value| 0.1 * value)).is_empty());
    }
}
