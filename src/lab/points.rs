//! Surveyed points of a node by name: how far each is off, and where it was marked in the images.

use super::state::Lab;
use crate::run::set_aside::MARK;
use anyhow::Result;
use serde_json::{Value, json};
use std::collections::{HashMap, HashSet};

/// The surveyed points of a node, largest error first.
///
/// # Errors
/// A node that is not done.
pub fn points(lab: &Lab, id: u32) -> Result<Value> {
    let view = lab.view(id)?;
    let source = lab.source(id)?;
    let columns = &view.columns;
    // Of control and check points alike: the model predicts the marks of both.
    let residuals: HashMap<(u32, u32), [f64; 2]> = (0..columns.len())
        .filter(|k| !columns.tie[*k])
        .map(|k| ((columns.image[k], columns.point[k]), [columns.rx[k], columns.ry[k]]))
        .collect();
    let aside: HashSet<(&str, &str)> = view
        .outliers
        .iter()
        .filter(|row| row.kind == MARK)
        .map(|row| (row.image.as_str(), row.point.as_str()))
        .collect();
    let mut marks: HashMap<&str, Vec<Value>> = HashMap::new();
    for mark in &source.block.marks {
        let (image, point) = (mark.image.index(), mark.point.index());
        let name = source.block.surveyed[point].name.as_str();
        let image_name = source.block.images[image].name.as_str();
        let residual = residuals.get(&(image as u32, point as u32));
        marks.entry(name).or_default().push(json!({
            "image": image, "x": mark.x, "y": mark.y, "rx": residual.map(|r| r[0]), "ry": residual.map(|r| r[1]),
            "set_aside": aside.contains(&(image_name, name)),
        }));
    }
    let mut rows: Vec<_> = view.run.checks.iter().map(|row| (row.dx.hypot(row.dy).hypot(row.dz), row)).collect();
    rows.sort_by(|a, b| b.0.total_cmp(&a.0));
    let rows: Vec<Value> = rows
        .into_iter()
        .map(|(size, row)| {
            json!({
                "point": row.point, "role": row.role, "e": row.x, "n": row.y, "h": row.z, "dx_mm": 1e3 * row.dx,
                "dy_mm": 1e3 * row.dy,
                "dz_mm": 1e3 * row.dz, "size_mm": 1e3 * size,
                "marks": marks.remove(row.point.as_str()).unwrap_or_default(),
            })
        })
        .collect();
    Ok(json!({ "points": rows }))
}
