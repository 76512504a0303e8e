//! A node in space: cameras, tie points, errors of surveyed points, as bytes that a page draws without reading them one
//! by one.

use super::brush::Brush;
use super::state::Lab;
use anyhow::Result;
use serde_json::{Value, json};
use std::collections::HashSet;

/// Tie points that are sent at most: more would hide each other, and take long to draw.
const MOST_TIES: usize = 50_000;
/// How many of these are kept free for brushed ones, so that a small brush is seen in a large block.
const BRUSHED_TIES: usize = 10_000;

/// Which tie points are drawn, out of all of them and of those that are brushed: evenly many of the order of the block,
/// and the same whatever is brushed; of the others the brushed ones, evenly too.
fn drawn(brushed: &[bool]) -> Vec<bool> {
    let n = brushed.len();
    if n <= MOST_TIES {
        return vec![true; n];
    }
    let evenly = |place: usize, of: usize, most: usize| of <= most || (place + 1) * most / of > place * most / of;
    let mut drawn: Vec<bool> = (0..n).map(|place| evenly(place, n, MOST_TIES - BRUSHED_TIES)).collect();
    let left: Vec<usize> = (0..n).filter(|place| brushed[*place] && !drawn[*place]).collect();
    let added = (0..left.len()).filter(|place| evenly(*place, left.len(), BRUSHED_TIES));
    added.for_each(|place| drawn[left[place]] = true);
    drawn
}

/// The bytes: length of the header, header, arrays.
///
/// # Errors
/// A node that is not done.
pub fn space(lab: &Lab, id: u32, brush: Option<&Brush>) -> Result<Vec<u8>> {
    let view = lab.view(id)?;
    let block = &lab.source(id)?.block;
    let columns = &view.columns;
    let mut numbers: Vec<f32> = Vec::new();
    let mut arrays: Vec<Value> = Vec::new();
    let mut array = |name: &str, names: &[&str], ids: Option<Vec<&str>>, rows: Vec<f32>| {
        let count = rows.len() / names.len();
        arrays.push(match ids {
            Some(ids) => json!({ "name": name, "columns": names, "rows": count, "ids": ids }),
            None => json!({ "name": name, "columns": names, "rows": count }),
        });
        numbers.extend(rows);
    };
    let stations = columns.images.iter().flat_map(|image| {
        let [place, view, up] = [image.centre, image.view, image.up].map(|v| v.map(|v| v as f32));
        place.into_iter().chain(view).chain(up).chain([image.flight as f32])
    });
    let names = ["x", "y", "z", "ax", "ay", "az", "ux", "uy", "uz", "flight"];
    let ids = block.images.iter().map(|image| image.name.as_str()).collect();
    array("stations", &names, Some(ids), stations.collect());
    let chosen = brush.map(|brush| brush.members(columns));
    // Count and squares of the coordinates of each point, and how many of its measurements are brushed.
    let mut sums = vec![(0usize, 0.0, 0usize); block.tie_points.len()];
    for k in columns.tie_numbers() {
        let brushed = chosen.as_ref().is_some_and(|chosen| chosen[k]);
        let sum = &mut sums[columns.point[k] as usize];
        let squares = columns.rx[k].powi(2) + columns.ry[k].powi(2);
        *sum = (sum.0 + 2, sum.1 + squares, sum.2 + usize::from(brushed));
    }
    let known = sums.iter().zip(&columns.ties).filter(|((n, ..), place)| *n > 0 && place[0].is_finite());
    let ties: Vec<[f32; 5]> = known
        .map(|((n, sum, brushed), place)| {
            [place[0], place[1], place[2], (sum / *n as f64).sqrt() as f32, *brushed as f32]
        })
        .collect();
    let brushed: Vec<bool> = ties.iter().map(|row| row[4] > 0.0).collect();
    let all = json!({ "rows": ties.len(), "brushed": brushed.iter().filter(|brushed| **brushed).count() });
    let names = &["x", "y", "z", "rms_px", "brushed"][..if chosen.is_some() { 5 } else { 4 }];
    let shown = ties.iter().zip(drawn(&brushed)).filter(|(_, drawn)| *drawn);
    array("ties", names, None, shown.flat_map(|(row, _)| row[..names.len()].to_vec()).collect());
    let origin = block.origin;
    let marked = chosen.map(|chosen| {
        let marks = (0..columns.len()).filter(|k| chosen[*k] && !columns.tie[*k]);
        marks.map(|k| block.surveyed[columns.point[k] as usize].name.as_str()).collect::<HashSet<_>>()
    });
    for (name, role) in [("checks", "check"), ("control", "control")] {
        let rows = || view.run.checks.iter().filter(|row| row.role == role);
        let values = rows().flat_map(|row| {
            let place = [row.x - origin.x, row.y - origin.y, row.z - origin.z];
            let brushed = marked.as_ref().map(|marked| f64::from(u8::from(marked.contains(row.point.as_str()))));
            place.into_iter().chain([row.dx, row.dy, row.dz]).chain(brushed).map(|v| v as f32)
        });
        let ids = rows().map(|row| row.point.as_str()).collect();
        let names = ["x", "y", "z", "dx", "dy", "dz", "brushed"];
        array(name, &names[..if marked.is_some() { 7 } else { 6 }], Some(ids), values.collect());
    }
    let mut header =
        json!({ "origin": <[f64; 3]>::from(origin), "ties": all, "arrays": arrays }).to_string().into_bytes();
    header.resize(header.len().next_multiple_of(4), b' ');
    let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
    bytes.extend(header);
    numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crowd_is_thinned_evenly_and_a_small_brush_is_seen_in_it() {
        let count = |drawn: &[bool]| drawn.iter().filter(|drawn| **drawn).count();
        assert_eq!(count(&drawn(&vec![false; MOST_TIES])), MOST_TIES);
        let n = 342_001;
        let fixed = drawn(&vec![false; n]);
        assert_eq!(count(&fixed), MOST_TIES - BRUSHED_TIES);
        assert!(fixed.chunks(100).all(|chunk| count(chunk) <= 12), "nowhere denser than elsewhere");
        let few: Vec<bool> = (0..n).map(|k| (1000..1050).contains(&k)).collect();
        let seen = drawn(&few);
        assert!((1000..1050).all(|k| seen[k]), "every brushed point");
        assert!((0..n).all(|k| seen[k] == (fixed[k] || few[k])), "beside the same others");
        let many = drawn(&vec![true; n]);
        assert_eq!(count(&many), MOST_TIES);
        assert!((0..n).all(|k| many[k] || !fixed[k]));
    }
}
