//! Measurements that a run set aside: the rows of its `outliers.csv`, and a block without them.

use super::folder::OutlierRow;
use crate::block::{Block, Measurement};
use crate::io::{Error, Place};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// A tie-point measurement, in the column `kind`.
pub const TIE: &str = "tie";
/// A mark, in the column `kind`.
pub const MARK: &str = "mark";

/// The block without the measurements of `rows`, which were read from `file`.
///
/// # Errors
/// A row that names a measurement which the block does not have, or twice, by its line.
pub fn without(block: &Block, rows: &[OutlierRow], file: &Path) -> Result<Block, Error> {
    let mut lines: HashMap<(&str, &str, &str), usize> = HashMap::new();
    let wrong = |number: usize, problem: String| {
        // Line 1 has the names of the columns.
        Error::Content { file: file.display().to_string(), place: Place::Line(number as u64 + 2), problem }
    };
    for (number, row) in rows.iter().enumerate() {
        let OutlierRow { image, point, kind, .. } = row;
        if ![TIE, MARK].contains(&kind.as_str()) {
            return Err(wrong(number, format!("kind {kind:?}: expected `{TIE}` or `{MARK}`")));
        }
        if lines.insert((kind, image, point), number).is_some() {
            return Err(wrong(number, format!("point {point:?} in image {image:?} stands here a second time")));
        }
    }
    let mut found: HashSet<usize> = HashSet::new();
    let mut kept = |kind: &str, measurements: &[Measurement], name: &dyn Fn(&Measurement) -> String| {
        let mut kept = Vec::with_capacity(measurements.len());
        for row in measurements {
            let image = block.images[row.image.index()].name.as_str();
            match lines.get(&(kind, image, name(row).as_str())) {
                Some(number) => drop(found.insert(*number)),
                None => kept.push(*row),
            }
        }
        kept
    };
    let ties = kept(TIE, &block.ties, &|row| block.tie_points[row.point.index()].name.clone());
    let marks = kept(MARK, &block.marks, &|row| block.surveyed[row.point.index()].name.clone());
    if let Some((number, row)) = rows.iter().enumerate().find(|(number, _)| !found.contains(number)) {
        let OutlierRow { image, point, kind, .. } = row;
        return Err(wrong(number, format!("the block has no {kind} of point {point:?} in image {image:?}")));
    }
    Ok(block.with_measurements(ties, marks))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{Scenario, simulate};

    #[test]
    fn named_measurements_go_and_unknown_ones_are_refused_by_line() {
        let scenario = Scenario::preset("closerange", &[("points".to_string(), 60.0)].into()).unwrap();
        let block = simulate(&scenario, 1).unwrap().block;
        let row = |kind: &str, image: &str, point: &str| OutlierRow {
            image: image.into(),
            point: point.into(),
            kind: kind.into(),
            reason: String::new(),
        };
        let name = |row: &Measurement| block.images[row.image.index()].name.clone();
        let (tie, mark) = (&block.ties[5], &block.marks[3]);
        let wanted = [
            row(TIE, &name(tie), &block.tie_points[tie.point.index()].name),
            row(MARK, &name(mark), &block.surveyed[mark.point.index()].name),
        ];
        let file = Path::new("outliers.csv");
        let left = without(&block, &wanted, file).unwrap();
        assert_eq!((left.ties.len() + 1, left.marks.len() + 1), (block.ties.len(), block.marks.len()));
        assert!(!left.ties.contains(tie) && !left.marks.contains(mark));
        let message = |rows: &[OutlierRow]| without(&block, rows, file).unwrap_err().to_string();
        let [tie, mark] = wanted;
        let unknown = row(TIE, &tie.image, "nobody");
        assert!(
            message(&[tie.clone(), unknown]).starts_with("outliers.csv:3: the block has no tie of point \"nobody\"")
        );
        assert!(message(&[tie.clone(), mark, tie.clone()]).starts_with("outliers.csv:4: point"));
        assert!(message(&[row("ray", "a", "b")]).starts_with("outliers.csv:2: kind \"ray\": expected `tie` or `mark`"));
    }
}
