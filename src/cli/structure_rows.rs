//! What the structure of the residuals showed, as rows of the run folder, before and after effects were added.

use crate::block::Block;
use crate::diagnose::fit::Fit;
use crate::diagnose::improve::Improvement;
use crate::diagnose::run::Diagnosed;
use crate::diagnose::structure::{Pictures, Structure};
use crate::measure::Predictor;
use crate::problem::PositionObservation;
use crate::run::folder::{self, BASE, FINAL, GnssRow, ImageScaleRow, ProfileRow, SensorRow};

/// The rows of both stages; those of the final one alone where nothing was added.
pub fn rows(diagnosed: &Diagnosed) -> folder::Pictures {
    let mut stages: Vec<(&str, &Structure)> = Vec::new();
    if !diagnosed.diagnosis.recommended.is_empty() {
        stages.push((BASE, &diagnosed.before));
    }
    stages.push((FINAL, &diagnosed.after));
    let mut rows = folder::Pictures::default();
    let Improvement { base, fit, .. } = &diagnosed.improvement;
    if stages.len() > 1 {
        rows.gnss.extend(gnss(BASE, base));
    }
    rows.gnss.extend(gnss(FINAL, fit));
    for (stage, structure) in stages {
        rows.sensor.extend(sensor(&diagnosed.block, stage, &structure.pictures));
        rows.scales.extend(scales(&diagnosed.block, stage, &structure.pictures));
        rows.profiles.extend(profiles(stage, &structure.pictures));
    }
    rows
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

fn gnss(stage: &str, fit: &Fit) -> Vec<GnssRow> {
    let Fit { problem, solution, .. } = fit;
    // A fit that was reported can be predicted.
    let Ok(predictor) = Predictor::new(problem, &solution.state) else { return Vec::new() };
    let row = |observation: &PositionObservation| {
        let image = observation.index as usize;
        let residual = observation.position - predictor.antenna(image)?;
        let context = &problem.image_contexts[image];
        let speed = context.velocity.xy().norm();
        let along = (speed > 0.0).then(|| context.velocity.xy() / speed);
        Some(GnssRow {
            stage: stage.into(),
            image: problem.image_names[image].clone(),
            time_s: finite(context.time_s),
            heading_deg: along.map(|along| along.x.atan2(along.y).to_degrees().rem_euclid(360.0)),
            along_m: along.map(|along| along.dot(&residual.xy())),
            across_m: along.map(|along| along.y * residual.x - along.x * residual.y),
            up_m: residual.z,
        })
    };
    problem.gnss.iter().filter_map(row).collect()
}

fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}
