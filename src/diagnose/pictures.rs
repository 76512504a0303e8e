//! What the structure of the residuals showed, as rows of the run folder, before and after effects were added.

use super::shown::marks;
use super::structure::{Pictures, Structure};
use crate::block::Block;
use crate::measure::MeasureError;
use crate::run::fit::Fit;
use crate::run::folder::{self, BASE, FINAL, FoundRow, ImageScaleRow, ProfileRow, SensorRow, WITH, WITHOUT};

/// What the pictures of a diagnosis are drawn from.
pub struct Shown<'a> {
    /// The block without outliers.
    pub block: &'a Block,
    /// The model that is handed on.
    pub fit: &'a Fit,
    /// What was taken in.
    pub added: &'a [String],
    /// Structure before anything was added; `None` where nothing was, or it is not to be shown.
    pub before: Option<&'a Structure>,
    /// Structure that is left.
    pub after: &'a Structure,
}

impl Shown<'_> {
    /// The rows of both stages; those of the final one alone where there is no other.
    ///
    /// # Errors
    /// A model without one of the effects that cannot be projected.
    pub fn rows(&self) -> Result<folder::Pictures, MeasureError> {
        let before = self.before.map(|before| (BASE, before));
        let mut rows = folder::Pictures { found: self.found()?, ..folder::Pictures::default() };
        for (stage, structure) in before.into_iter().chain([(FINAL, self.after)]) {
            rows.sensor.extend(sensor(self.block, stage, &structure.pictures));
            rows.scales.extend(scales(self.block, stage, &structure.pictures));
            rows.profiles.extend(profiles(stage, &structure.pictures));
        }
        Ok(rows)
    }

    /// The picture of every effect that was found.
    fn found(&self) -> Result<Vec<FoundRow>, MeasureError> {
        let mut rows = Vec::new();
        for effect in self.added {
            for mark in marks(self.fit, effect)? {
                rows.push(FoundRow {
                    effect: effect.clone(),
                    stage: if mark.with { WITH } else { WITHOUT }.into(),
                    against: mark.against.into(),
                    component: mark.component.into(),
                    unit: mark.unit.into(),
                    camera: mark.y.map_or(String::new(), |_| self.block.cameras[mark.camera].id.clone()),
                    x: mark.x,
                    y: mark.y,
                    n: mark.n,
                    mean: mark.mean,
                    sigma: mark.sigma,
                });
            }
        }
        Ok(rows)
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
