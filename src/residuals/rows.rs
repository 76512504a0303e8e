//! What the structure of the residuals showed, as rows of the run folder.

use super::Pictures;
use crate::block::Block;
use crate::run::folder::{self, ImageScaleRow, ProfileRow, SensorRow};

impl Pictures {
    /// Adds the rows of these pictures, of a `stage` of the diagnosis.
    pub fn add_rows(&self, rows: &mut folder::Pictures, block: &Block, stage: &str) {
        rows.sensor.extend(sensor(block, stage, self));
        rows.scales.extend(scales(block, stage, self));
        rows.profiles.extend(profiles(stage, self));
    }
}

fn sensor(block: &Block, stage: &str, pictures: &Pictures) -> impl Iterator<Item = SensorRow> {
    let cells = pictures.sensor.iter().flat_map(|grid| grid.cells.iter().map(move |cell| (grid.camera, cell)));
    cells.map(move |(camera, cell)| {
        let camera = &block.cameras[camera];
        SensorRow {
            stage: stage.into(),
            camera: camera.id.clone(),
            width_px: f64::from(camera.width_px),
            height_px: f64::from(camera.height_px),
            x: cell.centre[0],
            y: cell.centre[1],
            n: cell.n,
            dx: cell.mean[0],
            dy: cell.mean[1],
            p_value: finite(cell.p_value),
        }
    })
}

fn scales(block: &Block, stage: &str, pictures: &Pictures) -> impl Iterator<Item = ImageScaleRow> {
    pictures.images.iter().map(move |value| ImageScaleRow {
        stage: stage.into(),
        image: block.images[value.image].name.clone(),
        flight: block.flights[value.flight].clone(),
        scale_px: finite(value.scale),
        sigma_px: finite(value.scale_sigma),
    })
}

fn profiles(stage: &str, pictures: &Pictures) -> impl Iterator<Item = ProfileRow> {
    let bins = pictures.profiles.iter().flat_map(|profile| profile.bins.iter().map(move |bin| (profile, bin)));
    bins.map(move |(profile, bin)| ProfileRow {
        stage: stage.into(),
        against: profile.against.to_string(),
        component: profile.component.to_string(),
        unit: profile.unit.to_string(),
        x: bin.x,
        n: bin.n,
        mean_px: bin.mean,
        sigma_px: finite(bin.sigma),
    })
}

fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}
