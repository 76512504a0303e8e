//! Parts of a block that have no common points.

use super::tables::{Table, Tables};
use crate::mistakes::Mistake;
use crate::mistakes::words;
use std::collections::{BTreeMap, BTreeSet};

/// Common surveyed points that fix a part to another one: as many as a similarity needs.
const COMMON: usize = 3;
/// Images of a part that is named: an image without common points has no shape that could be out of place.
const LEAST: usize = 2;

/// Sets of images, each known by one of its members (union-find).
struct Sets {
    parent: Vec<usize>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self { parent: (0..count).collect() }
    }

    fn of(&mut self, mut one: usize) -> usize {
        while self.parent[one] != one {
            // Halves the way for the next one who asks.
            self.parent[one] = self.parent[self.parent[one]];
            one = self.parent[one];
        }
        one
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.of(a), self.of(b));
        self.parent[a.max(b)] = a.min(b);
    }
}

/// Joins the images that see a common point.
fn join_by_points(sets: &mut Sets, ties: &Table) {
    let mut first = vec![None; ties.points];
    for row in ties.iter() {
        match first[row.point] {
            None => first[row.point] = Some(row.image),
            Some(image) => sets.join(image, row.image),
        }
    }
}

/// Joins parts that have three surveyed points in common, until no two of them have.
fn join_by_marks(sets: &mut Sets, marks: &Table) {
    loop {
        let mut seen: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        for row in marks.iter() {
            seen.entry(row.point).or_default().insert(sets.of(row.image));
        }
        let mut common: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for parts in seen.values() {
            for a in parts {
                parts.range(a + 1..).for_each(|b| *common.entry((*a, *b)).or_default() += 1);
            }
        }
        let joined: Vec<(usize, usize)> =
            common.into_iter().filter(|(_, points)| *points >= COMMON).map(|(pair, _)| pair).collect();
        if joined.is_empty() {
            return;
        }
        joined.into_iter().for_each(|(a, b)| sets.join(a, b));
    }
}

/// Parts without common points, named by the images of all but the largest.
pub fn judge(tables: &Tables) -> Option<Mistake> {
    let mut sets = Sets::new(tables.images.len());
    join_by_points(&mut sets, &tables.ties);
    join_by_marks(&mut sets, &tables.marks);
    let measured: BTreeSet<usize> = tables.ties.iter().map(|row| row.image).collect();
    let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    measured.into_iter().for_each(|image| parts.entry(sets.of(image)).or_default().push(image));
    let mut parts: Vec<Vec<usize>> = parts.into_values().filter(|images| images.len() >= LEAST).collect();
    parts.sort_by_key(|images| std::cmp::Reverse(images.len()));
    let [largest, smaller @ ..] = parts.as_slice() else { return None };
    if smaller.is_empty() {
        return None;
    }
    let names: Vec<String> = smaller.iter().flatten().map(|image| tables.images[*image].name.clone()).collect();
    let count = parts.len();
    let sentence = format!(
        "Images: {count} parts of the block have no common tie points and fewer than {COMMON} common surveyed points. \
         {} images ({}) are apart from the largest part of {}.",
        names.len(),
        words::list(&names),
        largest.len()
    );
    let remedy = "Match the images of the parts with each other, or adjust each part as a block (ties.csv).";
    let found = Mistake::new("unconnected", "images", sentence, remedy.into());
    Some(found.of(names).sized(count as f64, None, "parts"))
}

#[cfg(test)]
mod tests {
    use super::super::tables::{Measured, Row, made};
    use super::*;

    fn row(image: usize, point: usize) -> Row {
        Row { image, point, xy: [(50 * image) as f64, (7 * point) as f64], sigma: 0.5 }
    }

    /// Four images that see five points, and three others that see five other ones.
    fn parts() -> Vec<Row> {
        let of = |images: std::ops::Range<usize>, first: usize| {
            images.flat_map(move |image| (first..first + 5).map(move |point| row(image, point)))
        };
        of(0..4, 0).chain(of(4..7, 5)).collect()
    }

    #[test]
    fn the_smaller_part_is_named() {
        let found = judge(&made::with_rows(parts())).expect("two parts");
        assert_eq!((found.names.join(" "), found.value), ("i4 i5 i6".into(), Some(2.0)));
    }

    #[test]
    fn three_common_marks_connect_and_two_do_not() {
        let mut tables = made::with_rows(parts());
        for (points, parts) in [(3, 1), (2, 2)] {
            let marks = (0..points).flat_map(|point| [row(point, point), row(4 + point % 2, point)]).collect();
            tables.marks = made::table(Measured::Marks, marks);
            assert_eq!(judge(&tables).map_or(1.0, |found| found.value.unwrap_or(0.0)), f64::from(parts));
        }
    }

    #[test]
    fn one_block_is_right_and_lonely_images_are_no_part() {
        assert!(judge(&made::tables()).is_none());
        assert!(judge(&made::with_rows(Vec::new())).is_none());
        let mut lonely = made::tables();
        lonely.images.push(made::image(10, nalgebra::Vector3::zeros()));
        lonely.marks = made::table(Measured::Marks, vec![row(10, 0)]);
        assert!(judge(&lonely).is_none());
    }
}
