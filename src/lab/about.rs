//! What the page asks of the block, the tree and a node, as JSON.

use super::change::name;
use super::columns::Columns;
use super::figures::{NAMES, difference};
use super::node::{Node, State};
use super::quantity::Quantity;
use super::state::Lab;
use crate::block::{Block, Role};
use crate::camera::{GROUPS, PARAMETERS, UNITS};
use crate::effects::{Kind, catalogue};
use crate::io::model::read_model;
use crate::model::{Datum, Loss, TieWeights};
use anyhow::Result;
use serde_json::{Value, json};

/// The tree.
pub fn tree(lab: &Lab) -> Value {
    let nodes = lab.nodes();
    let of = |(id, node): (&u32, &Node)| {
        let base = json!({
            "id": id, "parent": node.parent, "state": state(&node.state), "change": node.change,
            "words": node.change.words(),
            "figures": null, "delta_words": null, "verdict": null, "agree": null, "one_derivation": null,
            "moved": null, "mistake": null,
            "error": null, "seconds": null,
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
                all.insert("moved".into(), json!(saved.moved));
                all.insert("mistake".into(), json!(saved.mistake));
                all.insert("seconds".into(), json!(saved.seconds));
            }
            State::Running(since) => drop(all.insert("seconds".into(), json!(since.elapsed().as_secs_f64()))),
            State::Failed(error) => drop(all.insert("error".into(), json!(error))),
            _ => {}
        }
        Value::Object(all)
    };
    let nodes: Vec<Value> = nodes.iter().map(of).collect();
    let setup = &lab.setup;
    json!({
        "block": setup.block.name, "folder": setup.folder.path().display().to_string(),
        "simulated": setup.simulated.is_some(),
        "nodes": nodes,
    })
}

fn state(state: &State) -> &'static str {
    match state {
        State::Waiting => "waiting",
        State::Running(_) => "running",
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
    let images = block.images.iter().zip(&columns.images).enumerate().map(|(number, (image, own))| {
        json!({
            "name": image.name, "photo": lab.setup.photos.as_ref().is_some_and(|photos| photos.has(number)),
            "camera": own.camera, "flight": own.flight, "time_s": known(own.time),
            "temperature_c": known(own.temperature), "e": own.centre[0] + origin.x, "n": own.centre[1] + origin.y,
            "h": own.centre[2] + origin.z,
        })
    });
    let surveyed = block.surveyed.iter().map(|point| {
        let [e, n, h] = <[f64; 3]>::from(point.position + origin);
        json!({ "name": point.name, "role": if point.role == Role::Control { "control" } else { "check" }, "e": e,
            "n": n, "h": h })
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
        "parameters": PARAMETERS.iter().zip(UNITS)
            .map(|(name, unit)| json!({ "name": name, "unit": unit })).collect::<Vec<_>>(),
        "groups": groups.collect::<Vec<_>>(),
        "flights": block.flights, "images": images.collect::<Vec<_>>(), "surveyed": surveyed.collect::<Vec<_>>(),
        "quantities": quantities.collect::<Vec<_>>(), "views": views(block),
        "datums": [Datum::Free, Datum::Control, Datum::Gnss, Datum::All],
        "losses": [Loss::None, Loss::Huber, Loss::Cauchy],
        "tie_weights": [TieWeights::Unit, TieWeights::Multi, TieWeights::Pairs], "effects": effects.collect::<Vec<_>>(),
        "ties": block.ties.len(), "marks": block.marks.len(), "tie_points": block.tie_points.len(),
    })
}

/// The figures that have something to show of this block.
fn views(block: &Block) -> Vec<&'static str> {
    let has_gnss = block.images.iter().any(|image| image.gnss.is_some());
    NAMES.into_iter().filter(|name| *name != "gnss" || has_gnss).collect()
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
            json!({ "name": name, "unit": unit(name), "value": parameter.value, "sigma": parameter.sigma,
                "free": parameter.free })
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
        "cameras": cameras.collect::<Vec<_>>(), "effects": effects.collect::<Vec<_>>(), "free": free,
        "tied": model.tie_dc_to_pp,
        "datum": model.datum, "loss": model.loss, "tie_weights": model.tie_weights,
        "sigma_factors": model.sigma_factors,
        "freed": lab.saved(id)?.freed.keys().collect::<Vec<_>>(),
        "outliers": { "n": view.outliers.len(), "rows": outliers.collect::<Vec<_>>() },
    }))
}
