//! Files of a run folder that the pictures of its page are drawn from: mean residuals over the sensor (`sensor.csv`), per image
//! (`image_scale.csv`) and against what was recorded (`profiles.csv`); stage `base` before effects were added, `final` after.

use crate::block::Block;
use crate::diagnose::run::Diagnosed;
use crate::diagnose::structure::{Pictures, Structure};
use crate::io::Error;
use crate::io::table::TableWriter;
use crate::run::{ResidualKind, ResidualRow, cell_means};
use std::path::Path;

const SENSOR: &str = "sensor.csv";
const IMAGES: &str = "image_scale.csv";
const PROFILES: &str = "profiles.csv";
const SENSOR_COLUMNS: [&str; 10] = ["stage", "camera", "width_px", "height_px", "x", "y", "n", "dx", "dy", "p_value"];

/// Removes what only a diagnosis writes, so that an adjustment into the folder of an older one is not taken for it.
///
/// # Errors
/// What cannot be removed.
pub fn remove(dir: &Path) -> Result<(), Error> {
    for name in ["diagnosis.json", IMAGES, PROFILES] {
        let path = dir.join(name);
        match std::fs::remove_file(&path) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => return Err(Error::Write { path, source }),
            _ => {}
        }
    }
    Ok(())
}

/// Writes the mean tie residuals over the sensor, without tests.
///
/// # Errors
/// What cannot be written.
pub fn write_means(dir: &Path, block: &Block, rows: &[ResidualRow]) -> Result<(), Error> {
    let mut table = TableWriter::create(&dir.join(SENSOR), &SENSOR_COLUMNS)?;
    for (c, camera) in block.cameras.iter().enumerate() {
        let size = [f64::from(camera.width_px), f64::from(camera.height_px)];
        let of_camera =
            |row: &&ResidualRow| row.kind == ResidualKind::Tie && block.images[row.image.index()].camera.index() == c;
        for cell in cell_means(size, rows.iter().filter(of_camera).map(|row| (row.observed, row.residual))) {
            table.text("final").text(&camera.id).number(size[0]).number(size[1]);
            table.number(cell.centre[0]).number(cell.centre[1]).text(&cell.n.to_string());
            table.number(cell.mean[0]).number(cell.mean[1]).optional(None).end_row()?;
        }
    }
    table.finish()
}

/// Writes what the structure of the residuals showed, before and after effects were added.
///
/// # Errors
/// What cannot be written.
pub fn write(dir: &Path, diagnosed: &Diagnosed) -> Result<(), Error> {
    let mut stages: Vec<(&str, &Structure)> = Vec::new();
    if !diagnosed.diagnosis.recommended.is_empty() {
        stages.push(("base", &diagnosed.before));
    }
    stages.push(("final", &diagnosed.after));
    let block = &diagnosed.block;
    let mut sensor = TableWriter::create(&dir.join(SENSOR), &SENSOR_COLUMNS)?;
    let mut images = TableWriter::create(&dir.join(IMAGES), &["stage", "image", "flight", "scale_px", "sigma_px"])?;
    let mut profiles = TableWriter::create(
        &dir.join(PROFILES),
        &["stage", "against", "component", "unit", "x", "n", "mean_px", "sigma_px"],
    )?;
    for (stage, structure) in stages {
        write_sensor(&mut sensor, block, stage, &structure.pictures)?;
        for value in &structure.pictures.images {
            let (image, flight) = (&block.images[value.image].name, &block.flights[value.flight]);
            images.text(stage).text(image).text(flight).optional(finite(value.scale));
            images.optional(finite(value.scale_sigma)).end_row()?;
        }
        for profile in &structure.pictures.profiles {
            for bin in &profile.bins {
                profiles.text(stage).text(profile.against).text(profile.component).text(profile.unit);
                profiles.number(bin.x).text(&bin.n.to_string()).number(bin.mean).optional(finite(bin.sigma));
                profiles.end_row()?;
            }
        }
    }
    sensor.finish()?;
    images.finish()?;
    profiles.finish()
}

fn write_sensor(table: &mut TableWriter, block: &Block, stage: &str, pictures: &Pictures) -> Result<(), Error> {
    for grid in &pictures.sensor {
        let camera = &block.cameras[grid.camera];
        for cell in &grid.cells {
            table.text(stage).text(&camera.id);
            table.number(f64::from(camera.width_px)).number(f64::from(camera.height_px));
            table.number(cell.centre[0]).number(cell.centre[1]).text(&cell.n.to_string());
            table.number(cell.mean[0]).number(cell.mean[1]).optional(finite(cell.p_value)).end_row()?;
        }
    }
    Ok(())
}

fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}
