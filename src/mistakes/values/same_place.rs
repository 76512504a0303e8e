//! Surveyed points with the same coordinates that an image sees at different places.

use super::tables::{Row, Tables};
use crate::mistakes::survey::Subject;
use crate::mistakes::{Mistake, words};
use std::collections::BTreeMap;

/// Equal positions that are no coincidence: two names may be given to one nail.
const FEWEST: usize = 3;
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
    let same = places.into_values().filter(|same| same.len() >= FEWEST).max_by_key(Vec::len)?;
    if !are_apart(tables, &same) {
        return None;
    }
    let all = same.len() == count;
    let names = same.iter().filter(|_| !all).map(|k| tables.surveyed[*k].name.clone()).collect();
    let at = tables.surveyed[*same.first()?].position + tables.origin;
    Some(words::collapsed(subject, names, &at, same.len()))
}

/// Does an image see two of the points at different places?
fn are_apart(tables: &Tables, same: &[usize]) -> bool {
    let mut first: BTreeMap<usize, Row> = BTreeMap::new();
    tables.marks.iter().filter(|row| same.contains(&row.point)).any(|row| {
        let other = first.entry(row.image).or_insert(row);
        (row.xy[0] - other.xy[0]).hypot(row.xy[1] - other.xy[1]) > APART_PX
    })
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
        assert!(judge(&tables).is_empty(), "two names may be given to one nail");
    }

    #[test]
    fn names_of_one_nail_are_seen_at_one_place() {
        let tables = made::surveyed(&[[5.0, 6.0, 7.0]; 4]);
        let marks = (0..12).map(|k| Row { image: k % 3, point: k / 3, xy: [400.0, 300.0], sigma: 0.5 });
        let tables = Tables { marks: made::table(super::super::Measured::Marks, marks.collect()), ..tables };
        assert!(judge(&tables).is_empty());
    }
}
