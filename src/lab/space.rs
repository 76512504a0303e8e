//! A node in space: cameras, tie points, errors of surveyed points, as bytes that a page draws without reading them one
//! by one.

use super::brush::Brush;
use super::state::Lab;
use anyhow::Result;
use serde_json::{Value, json};
use std::collections::HashSet;

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
    match &chosen {
        Some(_) => array("ties", &["x", "y", "z", "rms_px", "brushed"], None, ties.concat()),
        None => {
            array("ties", &["x", "y", "z", "rms_px"], None, ties.iter().flat_map(|row| row[..4].to_vec()).collect())
        }
    }
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
    let mut header = json!({ "origin": <[f64; 3]>::from(origin), "arrays": arrays }).to_string().into_bytes();
    header.resize(header.len().next_multiple_of(4), b' ');
    let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
    bytes.extend(header);
    numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    Ok(bytes)
}
