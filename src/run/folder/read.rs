//! A run folder, read back.

use super::rows::{CheckRow, FoundRow, ImageRow, ImageScaleRow, OutlierRow, ProfileRow, ResidualLine, Row, SensorRow};
use super::{DIAGNOSIS, MODEL, SUMMARY};
use crate::io::Error;
use crate::run::summary::Summary;
use serde::de::DeserializeOwned;
use std::io;
use std::path::{Path, PathBuf};

/// What the page of a run is made from. `D` is what stands in `diagnosis.json`: a run does not know what a diagnosis is.
#[derive(Debug, Clone)]
pub struct RunFolder<D> {
    /// `summary.json`.
    pub summary: Summary,
    /// `model.toml`, as it stands.
    pub model: String,
    /// `diagnosis.json`; `None` for an adjustment.
    pub diagnosis: Option<D>,
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
    /// Pictures of the effects that were found; empty where none was.
    pub found: Vec<FoundRow>,
    /// `profiles.csv`; empty for an adjustment.
    pub profiles: Vec<ProfileRow>,
}

impl<D: DeserializeOwned> RunFolder<D> {
    /// Reads the folder.
    ///
    /// # Errors
    /// A file that is missing or cannot be read, by name.
    pub fn read(dir: &Path) -> Result<Self, Error> {
        let diagnosis = dir.join(DIAGNOSIS);
        Ok(Self {
            summary: json(&dir.join(SUMMARY))?,
            model: text(&dir.join(MODEL))?,
            diagnosis: if diagnosis.exists() { Some(json(&diagnosis)?) } else { None },
            images: rows(&dir.join(ImageRow::FILE))?,
            residuals: rows(&dir.join(ResidualLine::FILE))?,
            checks: rows(&dir.join(CheckRow::FILE))?,
            sensor: rows(&dir.join(SensorRow::FILE))?,
            scales: rows_of_diagnosis(&dir.join(ImageScaleRow::FILE))?,
            found: rows_of_diagnosis(&dir.join(FoundRow::FILE))?,
            profiles: rows_of_diagnosis(&dir.join(ProfileRow::FILE))?,
        })
    }
}

impl<D> RunFolder<D> {
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

/// What the run of a folder set aside, with the file that says so; `None` where it has no such file.
///
/// # Errors
/// A file that cannot be read.
pub fn read_outliers(dir: &Path) -> Result<Option<(PathBuf, Vec<OutlierRow>)>, Error> {
    let path = dir.join(OutlierRow::FILE);
    if !path.exists() {
        return Ok(None);
    }
    let rows = rows(&path)?;
    Ok(Some((path, rows)))
}

fn text(path: &Path) -> Result<String, Error> {
    crate::io::read_text(path).map_err(|source| {
        let advice = if source.kind() == io::ErrorKind::NotFound { "; is this the folder of a run?" } else { "" };
        unreadable(path, io::Error::new(source.kind(), format!("{source}{advice}")))
    })
}

fn json<T: DeserializeOwned>(path: &Path) -> Result<T, Error> {
    serde_json::from_str(&text(path)?).map_err(|error| unreadable(path, error.into()))
}

pub(super) fn rows<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, Error> {
    let read =
        || -> Result<Vec<T>, csv::Error> { csv::Reader::from_reader(crate::io::open(path)?).deserialize().collect() };
    read().map_err(|error| unreadable(path, error.into()))
}

/// Rows of a table that only a diagnosis writes; none where it is not there.
fn rows_of_diagnosis<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, Error> {
    if path.exists() { rows(path) } else { Ok(Vec::new()) }
}

fn unreadable(path: &Path, source: io::Error) -> Error {
    Error::Read { path: path.to_owned(), source }
}
