//! The same measurements twice, under other names: of points, or of images.

use super::equal_rows::{self, Key};
use super::tables::{Measured, Row, Table, Tables};
use crate::block::edit::{Change, Edit};
use crate::mistakes::Mistake;
use crate::mistakes::words;
use std::collections::BTreeSet;

/// Rows that two points must share: one may be a feature that two tracks compete for.
const SHARED_ROWS: usize = 2;
/// Share of all points below which twins are left alone: detectors give 15 % of features two orientations (Lowe 2004),
/// and this is twice that. A list that stands twice has a half.
const SHARE: f64 = 0.3;
/// Fewest points with a twin that are named.
const FEWEST: usize = 10;
/// Rows that two images must share: one may be a slip of a matcher, two equal coordinates with decimals are no chance.
const SHARED_POINTS: usize = 3;
/// The same where all coordinates are whole or half pixels: a handful of them is equal by chance.
const SHARED_ROUNDED: usize = 10;
/// Share of an image's rows that are equal to those of its twin.
const SAME: f64 = 0.9;

/// Bits that are equal where the numbers are.
fn bits(value: f64) -> u64 {
    (value + 0.0).to_bits()
}

fn key(name: usize, row: &Row) -> Key {
    [name as u64, bits(row.xy[0]), bits(row.xy[1])]
}

/// Points of a table that have the measurements of another one.
pub fn points(table: &Table) -> Option<Mistake> {
    let pairs = equal_rows::pairs(table.rows, |k| {
        let row = (table.row)(k);
        (key(row.image, &row), row.point)
    });
    let twins = pairs.into_iter().filter(|(_, shared)| *shared >= SHARED_ROWS);
    // Each once, though it may be the twin of several.
    let second: BTreeSet<usize> = twins.map(|((_, second), _)| second).collect();
    if second.len() < FEWEST || (second.len() as f64) < SHARE * table.points as f64 {
        return None;
    }
    let names: Vec<String> = second.iter().map(|point| (table.point_name)(*point)).collect();
    let sentence = format!(
        "{}: {} of {} points ({}) have the measurements of another point, to the last digit.",
        table.of.words(),
        names.len(),
        table.points,
        words::list(&names)
    );
    let remedy = format!("Leave them out of {}: a list was appended twice, under other names.", table.of.file());
    let count = names.len() as f64;
    let mend = match table.of {
        Measured::Ties => vec![Edit::all("ties.csv", Change::Remove).of("point", &names)],
        // Which of two names has the right coordinates no table of images says.
        Measured::Marks => Vec::new(),
    };
    let found = Mistake::new("duplicated", table.of.key(), sentence, remedy);
    Some(found.of(names).sized(count, None, "points").undone_by(mend))
}

/// Images that have the measurements of another one.
pub fn images(tables: &Tables) -> Option<Mistake> {
    let ties = &tables.ties;
    let pairs = equal_rows::pairs(ties.rows, |k| {
        let row = (ties.row)(k);
        (key(row.point, &row), row.image)
    });
    let mut count = vec![0; tables.images.len()];
    ties.iter().for_each(|row| count[row.image] += 1);
    let is_rounded = ties.iter().all(|row| row.xy.iter().all(|own| (2.0 * own).fract() == 0.0));
    let needed = if is_rounded { SHARED_ROUNDED } else { SHARED_POINTS };
    let same = |((first, second), shared): &((usize, usize), usize)| {
        let least = count[*first].min(count[*second]);
        *shared >= needed && *shared as f64 >= SAME * least as f64
    };
    let second: BTreeSet<usize> = pairs.into_iter().filter(same).map(|((_, second), _)| second).collect();
    if second.is_empty() {
        return None;
    }
    let names: Vec<String> = second.iter().map(|image| tables.images[*image].name.clone()).collect();
    let sentence = format!(
        "Images: {} ({}) have the tie points of another image at the same coordinates, to the last digit; an image is \
         in the block twice.",
        names.len(),
        words::list(&names)
    );
    let remedy = "Leave one of the two out of images.csv, ties.csv and marks.csv: their rays add no information.";
    let mend = if would_lose_a_point(tables, &second) { Vec::new() } else { edits(&names) };
    let count = names.len() as f64;
    let found = Mistake::new("duplicated", "images", sentence, remedy.into());
    Some(found.of(names).sized(count, None, "images").undone_by(mend))
}

/// Is a surveyed point marked in these images alone? A control point without a mark is refused.
fn would_lose_a_point(tables: &Tables, images: &BTreeSet<usize>) -> bool {
    let mut kept = vec![false; tables.marks.points];
    let mut lost = vec![false; tables.marks.points];
    for row in tables.marks.iter() {
        let of_point = if images.contains(&row.image) { &mut lost } else { &mut kept };
        of_point[row.point] = true;
    }
    lost.iter().zip(&kept).any(|(lost, kept)| *lost && !kept)
}

fn edits(images: &[String]) -> Vec<Edit> {
    let files = ["ties.csv", "marks.csv", "images.csv"];
    files.map(|file| Edit::all(file, Change::Remove).of("image", images)).into()
}

#[cfg(test)]
mod tests {
    use super::super::tables::made;
    use super::*;

    /// Measurements of three images of 60 points, each point in all of them.
    fn rows() -> Vec<Row> {
        let row = |image: usize, point: usize| {
            let k = (61 * image + point) as f64;
            Row { image, point, xy: [4000.0 * (0.618_034 * k).fract(), 3000.0 * (0.754_878 * k).fract()], sigma: 0.5 }
        };
        (0..3).flat_map(|image| (0..60).map(move |point| row(image, point))).collect()
    }

    #[test]
    fn points_under_two_names_are_named() {
        let mut twice = rows();
        twice.extend(rows().into_iter().filter(|row| row.point < 40).map(|row| Row { point: row.point + 60, ..row }));
        let found = points(&made::table(Measured::Ties, twice)).expect("twins");
        assert_eq!((found.names.len(), found.value), (40, Some(40.0)));
        assert_eq!((found.names[0].as_str(), found.mend.len()), ("p60", 1));
    }

    #[test]
    fn some_features_of_two_orientations_are_left_alone() {
        let mut few = rows();
        few.extend(rows().into_iter().filter(|row| row.point < 5).map(|row| Row { point: row.point + 60, ..row }));
        assert!(points(&made::table(Measured::Ties, few)).is_none());
        assert!(points(&made::table(Measured::Ties, rows())).is_none());
        assert!(points(&made::table(Measured::Ties, Vec::new())).is_none());
    }

    #[test]
    fn an_image_under_two_names_is_named() {
        let mut twice = rows();
        twice.extend(rows().into_iter().filter(|row| row.image == 1).map(|row| Row { image: 5, ..row }));
        let mut tables = made::with_rows(twice);
        let found = images(&tables).expect("a twin");
        assert_eq!((found.names.as_slice(), found.mend.len()), (&["i5".to_string()][..], 3));
        // A point that is marked there alone would be lost.
        let mark = Row { image: 5, point: 0, xy: [10.0, 20.0], sigma: 0.5 };
        tables.marks = made::table(Measured::Marks, vec![mark]);
        assert!(images(&tables).expect("a twin").mend.is_empty());
    }

    #[test]
    fn few_equal_coordinates_are_a_twin_where_they_have_decimals() {
        let of_five = |round: bool| {
            let kept = rows().into_iter().filter(|row| row.image != 1 || row.point < 5);
            let rounded = |own: f64| if round { own.round() } else { own };
            let mut own: Vec<Row> = kept.map(|row| Row { xy: row.xy.map(rounded), ..row }).collect();
            own.extend(own.clone().into_iter().filter(|row| row.image == 1).map(|row| Row { image: 5, ..row }));
            images(&made::with_rows(own))
        };
        assert_eq!(of_five(false).expect("a twin").names, ["i5"]);
        assert!(of_five(true).is_none());
    }

    #[test]
    fn images_of_their_own_are_right() {
        assert!(images(&made::with_rows(rows())).is_none());
        assert!(images(&made::tables()).is_none());
    }
}
