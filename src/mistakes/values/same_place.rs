//! Surveyed points with the same coordinates that an image sees at different places.

use super::tables::{Row, Tables};
use crate::mistakes::survey::Subject;
use crate::mistakes::{Mistake, words};
use std::collections::BTreeMap;

/// Distance of marks of one place in an image, px: even a bad mark is good to some pixels.
const APART_PX: f64 = 20.0;

/// Points that stand at one place, which the images contradict.
pub fn judge(tables: &Tables) -> Vec<Mistake> {
    [Subject::Control, Subject::Check].into_iter().filter_map(|subject| of_subject(tables, subject)).collect()
}

fn of_subject(tables: &Tables, subject: Subject) -> Option<Mistake> {
    let mut places: BTreeMap<[u64; 3], Vec<usize>> = BTreeMap::new();
    let own = tables.surveyed.iter().enumerate().filter(|(_, point)| point.subject == subject);
    let mut count = 0;
    for (k, point) in own {
        count += 1;
        // Zero has two signs.
        places.entry([0, 1, 2].map(|axis| (point.position[axis] + 0.0).to_bits())).or_default().push(k);
    }
    let same = places.into_values().filter(|same| same.len() > 1).max_by_key(Vec::len)?;
    if !are_apart(tables, &same) {
        return None;
    }
    let all = same.len() == count;
    let names = same.iter().filter(|_| !all).map(|k| tables.surveyed[*k].name.clone()).collect();
    let at = tables.surveyed[*same.first()?].position + tables.origin;
    Some(words::collapsed(subject, names, &at, same.len()))
}

/// Do most of the images that see two of the points see them at different places? Two names may be given to one nail,
/// and one of its marks may be a blunder.
fn are_apart(tables: &Tables, same: &[usize]) -> bool {
    let mut seen: BTreeMap<usize, Vec<Row>> = BTreeMap::new();
    for row in tables.marks.iter().filter(|row| same.contains(&row.point)) {
        seen.entry(row.image).or_default().push(row);
    }
    let distance = |a: &Row, b: &Row| (a.xy[0] - b.xy[0]).hypot(a.xy[1] - b.xy[1]);
    let several = seen.values().filter(|rows| rows.len() > 1);
    let is_apart = |rows: &&Vec<Row>| rows.iter().any(|row| distance(row, &rows[0]) > APART_PX);
    2 * several.clone().filter(is_apart).count() > several.count()
}

#[cfg(test)]
mod tests {
    use super::super::tables::made;
    use super::*;

    #[test]
    fn one_place_that_images_see_at_several_ones() {
        let mut tables = made::surveyed(&[[5.0, 6.0, 7.0]; 4]);
        let found = judge(&tables);
        assert_eq!((found.len(), found[0].kind.as_str()), (1, "collapsed"), "{found:?}");
        assert!(found[0].names.is_empty() && found[0].value == Some(4.0), "{found:?}");
        tables.surveyed[3].position.x += 1.0;
        assert_eq!(judge(&tables)[0].names, ["g0", "g1", "g2"]);
        tables.surveyed[2].position.x += 2.0;
        assert_eq!(judge(&tables)[0].names, ["g0", "g1"], "and the images see two nails");
        tables.surveyed[1].position.x += 3.0;
        assert!(judge(&tables).is_empty());
    }

    #[test]
    fn names_of_one_nail_are_seen_at_one_place() {
        let tables = made::surveyed(&[[5.0, 6.0, 7.0]; 4]);
        let marks = (0..12).map(|k| Row { image: k % 3, point: k / 3, xy: [400.0, 300.0], sigma: 0.5 });
        let tables = Tables { marks: made::table(super::super::Measured::Marks, marks.collect()), ..tables };
        assert!(judge(&tables).is_empty());
        // One of three images has a blunder.
        let mut rows: Vec<Row> = tables.marks.iter().collect();
        rows[0].xy[0] += 200.0;
        assert!(judge(&Tables { marks: made::table(super::super::Measured::Marks, rows), ..tables }).is_empty());
    }
}
