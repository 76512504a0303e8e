//! The measurements of a node one by one, by name, and what they come to.

use super::brush::Brush;
use super::change::Named;
use super::columns::Columns;
use super::state::Lab;
use crate::block::{Block, Measurement};
use crate::run::folder::OutlierRow;
use crate::run::set_aside::{MARK, TIE};
use anyhow::Result;
use serde_json::{Value, json};
use std::collections::{HashMap, HashSet};

/// A measurement by name.
pub fn named(block: &Block, columns: &Columns, k: usize) -> Named {
    let (image, point) = (columns.image[k] as usize, columns.point[k] as usize);
    let (kind, point) = match columns.tie[k] {
        true => (TIE, &block.tie_points[point].name),
        false => (MARK, &block.surveyed[point].name),
    };
    Named { image: block.images[image].name.clone(), point: point.clone(), kind: kind.into() }
}

/// Are all of these measurements in the block, each named once?
///
/// # Errors
/// Names the one that is not.
pub fn all_there(block: &Block, measurements: &[Named]) -> Result<(), String> {
    let mut wanted: HashSet<(&str, &str, &str)> = HashSet::new();
    for Named { image, point, kind } in measurements {
        if ![TIE, MARK].contains(&kind.as_str()) {
            return Err(format!("kind {kind:?} of a measurement: expected {TIE} or {MARK}"));
        }
        if !wanted.insert((kind, image, point)) {
            return Err(format!("the {kind} of point {point:?} in image {image:?} is named twice"));
        }
    }
    let image = |row: &Measurement| block.images[row.image.index()].name.as_str();
    for row in &block.ties {
        wanted.remove(&(TIE, image(row), block.tie_points[row.point.index()].name.as_str()));
    }
    for row in &block.marks {
        wanted.remove(&(MARK, image(row), block.surveyed[row.point.index()].name.as_str()));
    }
    match wanted.into_iter().next() {
        Some((kind, image, point)) => Err(format!("the block has no {kind} of point {point:?} in image {image:?}")),
        None => Ok(()),
    }
}

/// What was set aside in an image, and where it was measured.
pub fn set_aside_in<'a>(block: &Block, outliers: &'a [OutlierRow], image: usize) -> Vec<(&'a OutlierRow, [f64; 2])> {
    let name = &block.images[image].name;
    let own: HashMap<(&str, &str), &OutlierRow> = (outliers.iter().filter(|row| row.image == *name))
        .map(|row| ((row.kind.as_str(), row.point.as_str()), row))
        .collect();
    if own.is_empty() {
        return Vec::new();
    }
    let mut found = Vec::new();
    for (rows, kind) in [(&block.ties, TIE), (&block.marks, MARK)] {
        for row in rows.iter().filter(|row| row.image.index() == image) {
            let point = match kind {
                TIE => &block.tie_points[row.point.index()].name,
                _ => &block.surveyed[row.point.index()].name,
            };
            found.extend(own.get(&(kind, point.as_str())).map(|outlier| (*outlier, [row.x, row.y])));
        }
    }
    found
}

/// A page of the measurements of a node.
#[derive(Debug, Clone, Default)]
pub struct Page {
    /// Which of them.
    pub brush: Option<Brush>,
    /// Rows that are passed over.
    pub offset: usize,
    /// Rows of the page.
    pub limit: usize,
    /// The largest residual first; else in the order of the images.
    pub by_size: bool,
}

/// Measurements of a node, and what they come to.
///
/// # Errors
/// A node that is not done.
pub fn measurements(lab: &Lab, id: u32, page: &Page) -> Result<Value> {
    let view = lab.view(id)?;
    let block = &lab.source(id)?.block;
    let columns = &view.columns;
    let mut chosen: Vec<usize> = match &page.brush {
        Some(brush) => {
            let members = brush.members(columns);
            (0..columns.len()).filter(|k| members[*k]).collect()
        }
        None => (0..columns.len()).collect(),
    };
    let n = chosen.len();
    let mean = |values: &[f64]| (n > 0).then(|| chosen.iter().map(|k| values[*k]).sum::<f64>() / n as f64);
    let means = [mean(&columns.rx), mean(&columns.ry)];
    let rms = columns.rms(chosen.iter().copied().filter(|k| columns.tie[*k]));
    let marks = || chosen.iter().copied().filter(|k| !columns.tie[*k]);
    let marks = json!({ "n": marks().count(), "rms_px": columns.rms(marks()) });
    let mut images = vec![(0usize, 0.0); columns.images.len()];
    for k in &chosen {
        let sum = &mut images[columns.image[*k] as usize];
        *sum = (sum.0 + 1, sum.1 + columns.rx[*k].powi(2) + columns.ry[*k].powi(2));
    }
    let images: Vec<Value> = (images.iter().enumerate().filter(|(_, (n, _))| *n > 0))
        .map(|(image, (n, sum))| json!({ "image": image, "n": n, "rms_px": (sum / (2.0 * *n as f64)).sqrt() }))
        .collect();
    let size = |k: usize| columns.rx[k].hypot(columns.ry[k]) / f64::from(columns.sigma[k]);
    match page.by_size {
        // The summary alone is asked for while somebody brushes.
        _ if page.limit == 0 => {}
        true => chosen.sort_by(|a, b| size(*b).total_cmp(&size(*a))),
        false => chosen.sort_by_key(|k| columns.image[*k]),
    }
    let row = |k: usize| {
        let Named { image, point, kind } = named(block, columns, k);
        json!({
            "image": columns.image[k], "image_name": image, "point": point, "kind": kind, "x": columns.x[k],
            "y": columns.y[k],
            "rx": columns.rx[k], "ry": columns.ry[k], "sigma": columns.sigma[k], "normalised": size(k),
            "set_aside": false,
            "reason": null,
        })
    };
    // What was set aside belongs to whole images alone: it has no residual that a brush could hold.
    let aside = |row: &OutlierRow| {
        let image = block.images.iter().position(|image| image.name == row.image);
        json!({
            "image": image, "image_name": row.image, "point": row.point, "kind": row.kind, "x": null, "y": null,
            "rx": null, "ry": null,
            "sigma": null, "normalised": null, "set_aside": true, "reason": row.reason,
        })
    };
    let asides: Vec<&OutlierRow> = match page.brush {
        None => view.outliers.iter().collect(),
        Some(_) => Vec::new(),
    };
    let all = asides.len();
    let mut rows: Vec<Value> = asides.into_iter().skip(page.offset).take(page.limit).map(aside).collect();
    let first = page.offset.saturating_sub(all);
    let left = page.limit - rows.len();
    rows.extend(chosen.into_iter().skip(first).take(left).map(row));
    Ok(json!({ "total": columns.len(), "n": n, "rms_px": rms, "marks": marks, "mean_px": means, "images": images,
            "rows": rows }))
}
