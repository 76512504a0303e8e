//! `tracks.csv`: tie points by image. Three versions that differ in their number of columns.

use super::super::super::error::Error;
use super::super::text::Lines;
use super::super::tracks::Tracks;
use super::super::{Note, refuse};
use super::reconstruction::Point;
use crate::block::{ImageId, PointId};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// What the first line of all but the first version begins with.
const VERSION: &str = "OPENSFM_TRACKS_VERSION_v";
/// Columns of the versions 0, 1 and 2.
const COLUMNS: [usize; 3] = [8, 9, 11];

/// Reads the tracks that have coordinates; `pixel` takes normalised image coordinates to pixels.
pub(super) fn read(
    path: &Path,
    points: &BTreeMap<String, Point>,
    images: &HashMap<&str, ImageId>,
    pixel: &dyn Fn(ImageId, [f64; 2]) -> [f64; 2],
    notes: &mut Vec<Note>,
) -> Result<Tracks, Error> {
    if !path.is_file() {
        return Err(refuse(path, "the file is missing; it has the image coordinates of the tie points"));
    }
    let mut tracks = Tracks::default();
    let mut numbers: HashMap<&str, PointId> = HashMap::with_capacity(points.len());
    for (name, point) in points {
        numbers.insert(name, tracks.point(name.as_str(), Some(point.coordinates.into())));
    }
    let mut lines = Lines::open(path)?;
    let mut columns = COLUMNS[0];
    let mut is_first = true;
    let (mut strange_images, mut dropped) = (HashSet::new(), HashSet::new());
    while let Some(line) = lines.next_line()? {
        if let Some(version) = line.text().strip_prefix(VERSION).filter(|_| is_first) {
            is_first = false;
            let known = version.trim().parse::<usize>().ok().and_then(|version| COLUMNS.get(version));
            columns = *known.ok_or_else(|| line.refuse("expected version v0, v1 or v2 of the tracks"))?;
            continue;
        }
        is_first = false;
        if line.is_empty() {
            continue;
        }
        let cells: Vec<&str> = line.text().split('\t').collect();
        if cells.len() != columns {
            let found = cells.len();
            return Err(line.refuse(format!("expected {columns} cells separated by tabs, found {found}")));
        }
        let number = |cell: &str, what: &str| {
            let value = cell.trim().parse().ok().filter(|value: &f64| value.is_finite());
            value.ok_or_else(|| line.refuse(format!("{what}: expected a finite number, found {cell:?}")))
        };
        let xy = [number(cells[3], "x")?, number(cells[4], "y")?];
        match (images.get(cells[0]), numbers.get(cells[1])) {
            (Some(image), Some(point)) => tracks.measure(*image, *point, pixel(*image, xy)),
            (None, _) => {
                strange_images.insert(cells[0].to_owned());
            }
            (_, None) => {
                dropped.insert(cells[1].to_owned());
            }
        }
    }
    if !strange_images.is_empty() {
        let count = strange_images.len();
        notes.push(Note::loss(format!("{count} images of tracks.csv are not in the reconstruction: left out")));
    }
    if !dropped.is_empty() {
        let count = dropped.len();
        notes.push(Note::loss(format!("{count} tracks have no coordinates, OpenSfM set them aside: left out")));
    }
    notes.push(Note::fact(
        "tracks are those that OpenSfM kept; single measurements that it held for wrong are in tracks.csv all the same",
    ));
    Ok(tracks)
}
