//! The folder of a run, read back: what its page is made from.

use crate::diagnose::verdict::Diagnosis;
use crate::run::summary::Summary;
use anyhow::{Context, Result};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// A row of `images.csv`.
#[derive(Debug, Clone, Deserialize)]
pub struct ImageRow {
    /// Name.
    pub image: String,
    /// Flight.
    pub flight: String,
    /// Projection centre, m.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// See `x`.
    pub z: f64,
}

/// A row of `residuals.csv`.
#[derive(Debug, Clone, Deserialize)]
pub struct ResidualLine {
    /// Image.
    pub image: String,
    /// `tie` or `mark`.
    pub kind: String,
    /// Observed minus computed, px.
    pub rx: f64,
    /// See `rx`.
    pub ry: f64,
}

/// A row of `checks.csv`.
#[derive(Debug, Clone, Deserialize)]
pub struct CheckRow {
    /// `control` or `check`.
    pub role: String,
    /// Computed minus surveyed, m.
    pub dx: f64,
    /// See `dx`.
    pub dy: f64,
    /// See `dx`.
    pub dz: f64,
    /// Position, m.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// See `x`.
    pub z: f64,
}

/// A row of `sensor.csv`: the mean residual of a cell.
#[derive(Debug, Clone, Deserialize)]
pub struct SensorRow {
    /// `base` or `final`.
    pub stage: String,
    /// Camera.
    pub camera: String,
    /// Size of the sensor, px.
    pub width_px: f64,
    /// See `width_px`.
    pub height_px: f64,
    /// Middle of the cell, px.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// Mean residual, px.
    pub dx: f64,
    /// See `dx`.
    pub dy: f64,
    /// Of this cell alone; `None` where it was not tested.
    pub p_value: Option<f64>,
}

/// A row of `image_scale.csv`.
#[derive(Debug, Clone, Deserialize)]
pub struct ImageScaleRow {
    /// `base` or `final`.
    pub stage: String,
    /// Flight.
    pub flight: String,
    /// Scale residual of the image: displacement at half the diagonal, px; `None` where the model absorbs it.
    pub scale_px: Option<f64>,
    /// Its standard deviation, px.
    pub sigma_px: Option<f64>,
}

/// A row of `profiles.csv`.
#[derive(Debug, Clone, Deserialize)]
pub struct ProfileRow {
    /// `base` or `final`.
    pub stage: String,
    /// Quantity.
    pub against: String,
    /// Component of the residual.
    pub component: String,
    /// Unit of `x`.
    pub unit: String,
    /// Middle of the bin.
    pub x: f64,
    /// Mean residual, px.
    pub mean_px: f64,
    /// Its standard deviation, px.
    pub sigma_px: Option<f64>,
}

/// Everything.
#[derive(Debug, Clone)]
pub struct RunFolder {
    /// `summary.json`.
    pub summary: Summary,
    /// `model.toml`, as it stands.
    pub model: String,
    /// `diagnosis.json`; `None` for an adjustment.
    pub diagnosis: Option<Diagnosis>,
    /// `images.csv`.
    pub images: Vec<ImageRow>,
    /// `residuals.csv`.
    pub residuals: Vec<ResidualLine>,
    /// `checks.csv`.
    pub checks: Vec<CheckRow>,
    /// `sensor.csv`.
    pub sensor: Vec<SensorRow>,
    /// `image_scale.csv`; empty for an adjustment.
    pub scales: Vec<ImageScaleRow>,
    /// `profiles.csv`; empty for an adjustment.
    pub profiles: Vec<ProfileRow>,
}

impl RunFolder {
    /// Reads the folder.
    ///
    /// # Errors
    /// A file that is missing or cannot be read, by name.
    pub fn read(dir: &Path) -> Result<Self> {
        let diagnosis = dir.join("diagnosis.json");
        let diagnosed = diagnosis.exists();
        let of_diagnosis = |name: &str| dir.join(name).exists();
        Ok(Self {
            summary: json(&dir.join("summary.json"))?,
            model: text(&dir.join("model.toml"))?,
            diagnosis: if diagnosed { Some(json(&diagnosis)?) } else { None },
            images: rows(&dir.join("images.csv"))?,
            residuals: rows(&dir.join("residuals.csv"))?,
            checks: rows(&dir.join("checks.csv"))?,
            sensor: rows(&dir.join("sensor.csv"))?,
            scales: if of_diagnosis("image_scale.csv") { rows(&dir.join("image_scale.csv"))? } else { Vec::new() },
            profiles: if of_diagnosis("profiles.csv") { rows(&dir.join("profiles.csv"))? } else { Vec::new() },
        })
    }

    /// Names of the flights, in the order of the images.
    pub fn flights(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for image in &self.images {
            if !names.contains(&image.flight) {
                names.push(image.flight.clone());
            }
        }
        names
    }
}

fn text(path: &Path) -> Result<String> {
    std::fs::read_to_string(path)
        .with_context(|| format!("cannot read {}: is this the folder of a run?", path.display()))
}

fn json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    serde_json::from_str(&text(path)?).with_context(|| format!("cannot read {}", path.display()))
}

fn rows<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>> {
    let context = || format!("cannot read {}", path.display());
    let mut reader = csv::Reader::from_path(path).with_context(context)?;
    reader.deserialize().collect::<Result<_, _>>().with_context(context)
}
