//! Plausibility of the values in a block's tables: units and conventions that show without any adjustment.
//!
//! A focal length of 35 is no number of pixels, and measurements that all lie within two pixels of a corner are none in
//! pixels either. Such values are wrong whatever the rest of the block says, so nothing is estimated here. Each check
//! reads the tables as they are and knows one kind of mistake:
//!
//! | subject | kinds | file |
//! |---|---|---|
//! | `camera` | `focal-unit` | `focal` |
//! | `camera` | `principal-point-unit` | `principal_point` |
//! | `camera` | `distortion-unit` | `distortion` |
//! | `camera` | `sensor-size` | `sensor` |
//! | `ties`, `marks` | `normalised`, `millimetres` | `units` |
//! | `ties`, `marks` | `image-scale` | `scale` |
//! | `ties`, `marks` | `columns-exchanged` | `columns` |
//! | `ties`, `marks` | `whole-pixels` | `whole` |
//! | `ties`, `marks`, `images` | `duplicated` | `duplicated` |
//! | `images` | `unconnected` | `unconnected` |
//! | `images` | `time` | `time` |
//! | `images` | `velocity-unit` | `velocity` |
//! | `images` | `temperature-unit` | `temperature` |
//! | `control`, `check`, `gnss` | `geographic`, `other-frame` | `far` |
//! | `control`, `check` | `collapsed` | `same_place` |
//! | `control` | `too-few`, `in-line` | `datum`, where a datum of control is asked for |
//! | `control`, `check`, `gnss` | `axis-reversed`, `height-offset` | `below` |
//!
//! **A good block has none of them.** Each threshold is a constant with its reason, far from what instruments and
//! people do rightly; what may be right is not named. A mistake has edits (`mend`) where one reading alone is possible.
//!
//! What measurements from the centre of the image would show (`centred`) never gets here: a block whose measurements
//! are outside the sensor is refused when it is read.

mod below;
mod columns;
pub mod datum;
mod distortion;
mod duplicated;
mod equal_rows;
mod extent;
mod far;
mod flights;
mod focal;
pub mod placed;
mod principal_point;
mod same_place;
mod scale;
mod sensor;
mod tables;
mod temperature;
mod time;
mod unconnected;
mod units;
mod velocity;
mod whole;

pub use tables::{Camera, Image, Measured, Row, Surveyed, Table, Tables};

use super::Mistake;
use extent::Extent;

/// Mistakes that the values alone show, in the order of the table above.
pub fn judge(tables: &Tables) -> Vec<Mistake> {
    let [ties, marks] = [&tables.ties, &tables.marks].map(|table| extent::of(table, tables));
    let whole: Vec<Extent> = ties.iter().zip(&marks).map(|(ties, marks)| ties.with(marks)).collect();
    let mut found = focal::judge(tables);
    found.extend(principal_point::judge(tables));
    found.extend(distortion::judge(tables));
    found.extend(sensor::judge(tables, &whole));
    for (table, extents) in [(&tables.ties, &ties), (&tables.marks, &marks)] {
        found.extend(units::judge(table, tables, extents));
        found.extend(scale::judge(table, tables, extents));
        found.extend(columns::judge(table, tables, extents, &whole));
        found.extend(whole::judge(table));
        found.extend(duplicated::points(table));
    }
    found.extend(duplicated::images(tables));
    found.extend(unconnected::judge(tables));
    found.extend(time::judge(tables));
    found.extend(velocity::judge(tables));
    found.extend(temperature::judge(tables));
    found.extend(same_place::judge(tables));
    found
}

/// Where surveyed positions lie against the cameras. A network of tie points tells more, where there is one.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// Groups far away.
    pub far: Vec<Mistake>,
    /// Cameras below all that they look down on.
    pub below: Option<Mistake>,
}

/// Positions that lie where they cannot.
pub fn places(tables: &Tables) -> Places {
    let far = far::judge(tables);
    // Of what lies in another system heights say nothing.
    let below = if far.is_empty() { below::judge(tables) } else { None };
    Places { far, below }
}

#[cfg(test)]
mod tests {
    use super::tables::made;
    use super::*;

    #[test]
    fn a_good_block_has_no_mistake() {
        assert_eq!(judge(&made::tables()), []);
        let mut marked = made::tables();
        marked.marks = made::table(Measured::Marks, made::rows(4));
        assert_eq!(judge(&marked), []);
    }

    #[test]
    fn an_empty_block_is_no_mistake() {
        let mut empty = made::with_rows(Vec::new());
        empty.images.clear();
        assert_eq!(judge(&empty), []);
        empty.cameras.clear();
        assert_eq!(judge(&empty), []);
    }

    #[test]
    fn each_table_is_judged_alone() {
        let reduced = made::rows(10).into_iter().map(|row| Row { xy: row.xy.map(|value| 0.5 * value), ..row });
        let mut tables = made::tables();
        tables.marks = made::table(Measured::Marks, reduced.collect());
        let found = judge(&tables);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].kind.as_str(), found[0].subject.as_str()), ("image-scale", "marks"));
    }
}
