//! What the page asks of the block, the tree and a node, as JSON.

use super::brush::Brush;
use super::change::{Named, name};
use super::columns::{Columns, Quantity};
use super::figures::{NAMES, difference};
use super::state::{Lab, Node, State};
use crate::block::{Block, Measurement, Role};
use crate::camera::{GROUPS, PARAMETERS, UNITS};
use crate::effects::{Kind, catalogue};
use crate::io::model::read_model;
use crate::model::{Datum, Loss, TieWeights};
use crate::run::folder::OutlierRow;
use crate::run::set_aside::{MARK, TIE};
use anyhow::Result;
use serde_json::{Value, json};
use std::collections::{HashMap, HashSet};

/// The tree.
pub fn tree(lab: &Lab) -> Value {
    let nodes = lab.nodes();
    let of = |(id, node): (&u32, &Node)| {
        let base = json!({
            "id": id, "parent": node.parent, "state": state(&node.state), "change": node.change, "words": node.change.words(),
            "figures": null, "delta_words": null, "verdict": null, "agree": null, "one_derivation": null, "error": null,
        });
        let Value::Object(mut all) = base else { return base };
        if let Some(figures) = &node.figures {
            let before = node.parent.and_then(|parent| nodes.get(&parent)?.figures.as_ref());
            all.insert("figures".into(), json!(figures));
            all.insert("delta_words".into(), json!(before.map(|before| difference(before, figures))));
        }
        match &node.state {
            State::Done(saved) => {
                all.insert("verdict".into(), json!(saved.verdict));
                all.insert("agree".into(), json!(saved.agree));
                all.insert("one_derivation".into(), json!(saved.one_derivation));
            }
            State::Failed(error) => drop(all.insert("error".into(), json!(error))),
            _ => {}
        }
        Value::Object(all)
    };
    let nodes: Vec<Value> = nodes.iter().map(of).collect();
    let setup = &lab.setup;
    json!({
        "block": setup.block.name, "folder": setup.folder.path().display().to_string(), "simulated": setup.simulated.is_some(),
        "nodes": nodes,
    })
}

fn state(state: &State) -> &'static str {
    match state {
        State::Waiting => "waiting",
        State::Running => "running",
        State::Done(_) => "done",
        State::Failed(_) => "failed",
        State::Cancelled => "cancelled",
    }
}

/// The block.
pub fn block(lab: &Lab) -> Value {
    let block = &lab.setup.block;
    let columns = Columns::of_block(block, &[], &[]);
    let known = |value: f64| Some(value).filter(|value| value.is_finite());
    let mut counts = vec![0; block.cameras.len()];
    block.images.iter().for_each(|image| counts[image.camera.index()] += 1);
    let cameras = block.cameras.iter().zip(counts).map(|(camera, images)| {
        json!({ "id": camera.id, "width_px": camera.width_px, "height_px": camera.height_px, "images": images })
    });
    let origin = block.origin;
    let images = block.images.iter().zip(&columns.images).map(|(image, own)| {
        json!({
            "name": image.name, "camera": own.camera, "flight": own.flight, "time_s": known(own.time),
            "temperature_c": known(own.temperature), "e": own.centre[0] + origin.x, "n": own.centre[1] + origin.y,
            "h": own.centre[2] + origin.z,
        })
    });
    let surveyed = block.surveyed.iter().map(|point| {
        let [e, n, h] = <[f64; 3]>::from(point.position + origin);
        json!({ "name": point.name, "role": if point.role == Role::Control { "control" } else { "check" }, "e": e, "n": n, "h": h })
    });
    let quantities = Quantity::ALL
        .iter()
        .filter(|(quantity, ..)| is_recorded(&columns, *quantity))
        .map(|(quantity, label, unit)| json!({ "id": name(quantity), "label": label, "unit": unit }));
    let effects = catalogue().iter().map(|effect| {
        let descriptor = effect.descriptor();
        let kind = if descriptor.kind == Kind::Physical { "physical" } else { "empirical" };
        json!({ "id": descriptor.id, "about": descriptor.summary, "kind": kind })
    });
    let groups = GROUPS.iter().map(|(name, indices)| {
        json!({ "name": name, "parameters": indices.iter().map(|k| PARAMETERS[*k]).collect::<Vec<_>>() })
    });
    json!({
        "name": block.name, "crs": block.crs, "origin": <[f64; 3]>::from(origin),
        "cameras": cameras.collect::<Vec<_>>(),
        "parameters": PARAMETERS.iter().zip(UNITS).map(|(name, unit)| json!({ "name": name, "unit": unit })).collect::<Vec<_>>(),
        "groups": groups.collect::<Vec<_>>(),
        "flights": block.flights, "images": images.collect::<Vec<_>>(), "surveyed": surveyed.collect::<Vec<_>>(),
        "quantities": quantities.collect::<Vec<_>>(), "views": NAMES,
        "datums": [Datum::Free, Datum::Control, Datum::Gnss, Datum::All], "losses": [Loss::None, Loss::Huber, Loss::Cauchy],
        "tie_weights": [TieWeights::Unit, TieWeights::Multi, TieWeights::Pairs], "effects": effects.collect::<Vec<_>>(),
        "ties": block.ties.len(), "marks": block.marks.len(), "tie_points": block.tie_points.len(),
    })
}

/// Can residuals be held against it in this block? What follows from the measurement itself always can.
fn is_recorded(columns: &Columns, quantity: Quantity) -> bool {
    let of_images = |value: fn(&super::columns::ImageColumns) -> f64| {
        let mut values = columns.images.iter().map(value);
        let first = values.next().unwrap_or(f64::NAN);
        first.is_finite() && values.any(|value| (value - first).abs() > 1e-9 * first.abs().max(1.0))
    };
    match quantity {
        Quantity::Time => of_images(|image| image.time),
        Quantity::Temperature => of_images(|image| image.temperature),
        Quantity::Speed => of_images(|image| image.speed),
        Quantity::Heading => of_images(|image| image.heading),
        _ => true,
    }
}

/// The model of a node.
///
/// # Errors
/// A node that is not done.
pub fn model(lab: &Lab, id: u32) -> Result<Value> {
    let view = lab.view(id)?;
    let model = read_model(&lab.setup.folder.step(id).join("model.toml"), &|id| lab.effect(id))?;
    let unit = |name: &str| PARAMETERS.iter().position(|other| *other == name).map_or("", |k| UNITS[k]);
    let cameras = view.run.summary.cameras.0.iter().map(|(id, parameters)| {
        let parameters = parameters.0.iter().map(|(name, parameter)| {
            json!({ "name": name, "unit": unit(name), "value": parameter.value, "sigma": parameter.sigma, "free": parameter.free })
        });
        json!({ "id": id, "parameters": parameters.collect::<Vec<_>>() })
    });
    let effects = view.run.summary.effects.0.iter().map(|(id, parameters)| {
        let parameters = parameters.0.iter().map(|(name, parameter)| {
            json!({ "name": name, "unit": parameter.unit, "value": parameter.value, "sigma": parameter.sigma })
        });
        json!({ "id": id, "parameters": parameters.collect::<Vec<_>>() })
    });
    let free: Vec<&str> = (0..PARAMETERS.len()).filter(|k| model.free[*k]).map(|k| PARAMETERS[k]).collect();
    let outliers = view
        .outliers
        .iter()
        .map(|row| json!({ "image": row.image, "point": row.point, "kind": row.kind, "reason": row.reason }));
    Ok(json!({
        "cameras": cameras.collect::<Vec<_>>(), "effects": effects.collect::<Vec<_>>(), "free": free, "tied": model.tie_dc_to_pp,
        "datum": model.datum, "loss": model.loss, "tie_weights": model.tie_weights, "sigma_factors": model.sigma_factors,
        "freed": lab.saved(id)?.freed.keys().collect::<Vec<_>>(),
        "outliers": { "n": view.outliers.len(), "rows": outliers.collect::<Vec<_>>() },
    }))
}

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
            "image": columns.image[k], "image_name": image, "point": point, "kind": kind, "x": columns.x[k], "y": columns.y[k],
            "rx": columns.rx[k], "ry": columns.ry[k], "sigma": columns.sigma[k], "normalised": size(k), "set_aside": false,
            "reason": null,
        })
    };
    // What was set aside belongs to whole images alone: it has no residual that a brush could hold.
    let aside = |row: &OutlierRow| {
        let image = block.images.iter().position(|image| image.name == row.image);
        json!({
            "image": image, "image_name": row.image, "point": row.point, "kind": row.kind, "x": null, "y": null, "rx": null, "ry": null,
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
    Ok(
        json!({ "total": columns.len(), "n": n, "rms_px": rms, "marks": marks, "mean_px": means, "images": images, "rows": rows }),
    )
}

/// The commands that reproduce a node from the shell.
///
/// # Errors
/// A node that is not done.
pub fn commands(lab: &Lab, id: u32) -> Result<Value> {
    lab.saved(id)?;
    let source = lab.source(id)?;
    let quoted = |path: &std::path::Path| format!("'{}'", path.display().to_string().replace('\'', "'\\''"));
    let folder = lab.setup.folder.step(id);
    let run = format!("step-{id:04}-again");
    Ok(json!({ "commands": [
        format!("misclosure adjust {} -o {run} --model {}", quoted(&source.path), quoted(&folder.join("model.toml"))),
        format!("misclosure report {}", quoted(&folder)),
    ] }))
}
