//! `misclosure check BLOCK`: validates a block and prints what is in it.

use super::diagnosis_text::mistakes_text;
use super::mistakes::of_block;
use super::text::multiplicity;
use super::{Answer, Console};
use crate::block::Block;
use crate::block::inventory::{Inventory, PointInventory};
use crate::camera::F;
use crate::io::block::{SetAside, read_block};
use crate::report::numbers::{fixed, significant};
use crate::report::tables::Table;
use crate::run::cost::{Cost, Task};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Validates a block, searches it for mistakes, and prints its contents
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  misclosure check dike           its contents, or what is wrong with it and where
  misclosure check dike --json    the same for a program")]
pub struct Arguments {
    /// Folder of the block
    block: PathBuf,
}

/// Runs the command.
pub fn run(arguments: &Arguments, console: &Console, threads: usize) -> anyhow::Result<Answer> {
    let loaded = read_block(&arguments.block)?;
    let inventory = Inventory::of(&loaded.block);
    let mut text = text(&loaded.block, &inventory, &loaded.set_aside);
    let mut json = as_json(&loaded.block, &inventory, &loaded.set_aside);
    let progress = console.progress("check");
    progress.step("holding the survey against the shape that the images give");
    let mistakes = of_block(loaded.block, threads);
    drop(progress);
    json["mistakes"] = serde_json::to_value(&mistakes)?;
    if !mistakes.is_empty() {
        text = format!("MISTAKES\n{}\n{text}", mistakes_text(&mistakes));
    }
    Ok(Answer { text, json, failure: None })
}

fn text(block: &Block, inventory: &Inventory, set_aside: &SetAside) -> String {
    let mut text = format!("Block `{}`, coordinate system `{}`: valid\n\n", block.name, block.crs);
    let mut cameras = Table::new("").text("camera", "").number("width", "px").number("height", "px").number("f", "px");
    for camera in &block.cameras {
        let [f, ..] = camera.interior;
        cameras.row([camera.id.clone(), camera.width_px.to_string(), camera.height_px.to_string(), fixed(f, 2)]);
    }
    text += &cameras.to_text();
    let mut flights = (Table::new("").text("flight", ""))
        .number("images", "")
        .number("tie measurements", "")
        .number("time span", "s")
        .number("pixel on object", "mm");
    for flight in &inventory.flights {
        flights.row([
            flight.name.clone(),
            flight.images.to_string(),
            flight.tie_measurements.to_string(),
            flight.span_s.map_or("-".into(), |span| fixed(span, 0)),
            flight.gsd_m.map_or("-".into(), |gsd| significant(gsd * 1e3, 3)),
        ]);
    }
    flights.row(["all".into(), block.images.len().to_string(), block.ties.len().to_string(), "-".into(), "-".into()]);
    text += "\n";
    text += &flights.to_text();
    let mut points = Table::new("").text("points", "").number("points", "").number("image measurements", "");
    let kinds = [("tie", inventory.ties), ("control", inventory.control), ("check", inventory.check)];
    for (name, kind) in kinds {
        points.row([name.into(), kind.points.to_string(), kind.measurements.to_string()]);
    }
    text += "\n";
    text += &points.to_text();
    text += &format!("\n{} tie points have approximate coordinates.\n", inventory.positions);
    if let Some(mean) = inventory.mean_multiplicity() {
        text += &multiplicity(mean, &inventory.multiplicity);
    }
    let columns = inventory.columns.iter().filter(|(_, images)| *images > 0);
    let columns: Vec<String> = columns
        .map(|(name, images)| match *images == block.images.len() {
            true => name.to_string(),
            false => format!("{name} ({} of {} images)", images, block.images.len()),
        })
        .collect();
    text += &format!(
        "Optional columns of images.csv: {}\n",
        if columns.is_empty() { "none".into() } else { columns.join("; ") }
    );
    if !block.extra_image_columns.is_empty() {
        let names: Vec<&str> = block.extra_image_columns.iter().map(|(name, _)| name.as_str()).collect();
        text += &format!("Unknown columns, kept and not used: {}\n", names.join(", "));
    }
    let [adjust, diagnose] = [Task::Adjust, Task::Diagnose].map(|task| Cost::of(block, task).in_words());
    text += &format!("Set aside: {set_aside}\n");
    text + &format!("Estimated for two threads: adjust --solver native {adjust}, diagnose {diagnose}\n")
}

/// What is in a block, and what of it was set aside, for programs.
pub fn as_json(block: &Block, inventory: &Inventory, set_aside: &SetAside) -> Value {
    let points = |p: &PointInventory| json!({ "points": p.points, "measurements": p.measurements });
    let flights = inventory.flights.iter().map(|flight| {
        json!({ "flight": flight.name, "images": flight.images, "tie_measurements": flight.tie_measurements,
                "span_s": flight.span_s, "gsd_m": flight.gsd_m })
    });
    let cameras = block.cameras.iter().map(|camera| {
        let (width, height) = (camera.width_px, camera.height_px);
        json!({ "camera": camera.id, "width_px": width, "height_px": height, "f": camera.interior[F] })
    });
    let cost = |task: Task| {
        let Cost { seconds, bytes, .. } = Cost::of(block, task);
        json!({ "seconds": seconds, "bytes": bytes })
    };
    let columns: serde_json::Map<String, Value> =
        inventory.columns.iter().map(|(name, images)| (name.to_string(), json!(images))).collect();
    json!({
        "format": 1, "block": block.name, "crs": block.crs, "images": block.images.len(),
        "cameras": cameras.collect::<Vec<_>>(), "flights": flights.collect::<Vec<_>>(),
        "ties": points(&inventory.ties), "control": points(&inventory.control), "check": points(&inventory.check),
        "tie_positions": inventory.positions, "multiplicity": inventory.multiplicity,
        "mean_multiplicity": inventory.mean_multiplicity(), "images_with": columns,
        "unknown_columns": block.extra_image_columns.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        "set_aside": {
            "one_ray_points": set_aside.one_ray_points, "unmeasured_points": set_aside.unmeasured_points,
            "unmarked_checks": set_aside.unmarked_checks, "unused_cameras": set_aside.unused_cameras,
            "positionless_gnss_sigmas": set_aside.positionless_gnss_sigmas,
        },
        "cost": { "adjust": cost(Task::Adjust), "diagnose": cost(Task::Diagnose) },
    })
}
