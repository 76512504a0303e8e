//! A run folder, read back.

use super::rows::{
    CheckRow, FoundRow, ImageRow, ImageScaleRow, OutlierRow, PointRow, ProfileRow, ResidualLine, Row, SensorRow,
};
use super::{DIAGNOSIS, MODEL, SUMMARY};
use crate::io::{Error, Place};
use crate::run::summary::{FORMAT, Summary};
use serde::Deserialize;
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
    /// A file that is missing, cannot be read, is of another version, or lacks the rows that the summary speaks of; by name.
    pub fn read(dir: &Path) -> Result<Self, Error> {
        let diagnosis = dir.join(DIAGNOSIS);
        let summary: Summary = json(&dir.join(SUMMARY))?;
        let (tied, surveyed) = (summary.tie_rms_px.is_some(), summary.control.is_some() || summary.check.is_some());
        Ok(Self {
            model: text(&dir.join(MODEL))?,
            diagnosis: if diagnosis.exists() { Some(json(&diagnosis)?) } else { None },
            images: table(dir, ImageRow::FILE, ImageRow::COLUMNS, true)?,
            residuals: table(dir, ResidualLine::FILE, ResidualLine::COLUMNS, true)?,
            checks: table(dir, CheckRow::FILE, CheckRow::COLUMNS, surveyed)?,
            sensor: table(dir, SensorRow::FILE, SensorRow::COLUMNS, tied)?,
            scales: rows_of_diagnosis::<ImageScaleRow>(dir)?,
            found: rows_of_diagnosis::<FoundRow>(dir)?,
            profiles: rows_of_diagnosis::<ProfileRow>(dir)?,
            summary,
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
    let rows = rows(&path, OutlierRow::COLUMNS)?;
    Ok(Some((path, rows)))
}

/// The adjusted tie points of a folder.
///
/// # Errors
/// A file that cannot be read.
pub fn read_points(dir: &Path) -> Result<Vec<PointRow>, Error> {
    rows(&dir.join(PointRow::FILE), PointRow::COLUMNS)
}

fn text(path: &Path) -> Result<String, Error> {
    crate::io::read_text(path).map_err(|source| {
        let advice = if source.kind() == io::ErrorKind::NotFound { "; is this the folder of a run?" } else { "" };
        unreadable(path, io::Error::new(source.kind(), format!("{source}{advice}")))
    })
}

/// What every version of a file of JSON says of itself.
#[derive(Deserialize)]
struct Versioned {
    format: Option<u32>,
}

fn json<T: DeserializeOwned>(path: &Path) -> Result<T, Error> {
    let text = text(path)?;
    let wrong = |error: serde_json::Error| unreadable(path, error.into());
    // First: the keys of another version may be others.
    let found = serde_json::from_str::<Versioned>(&text).map_err(wrong)?.format;
    if found != Some(FORMAT) {
        let found = found.map_or_else(|| "no \"format\"".into(), |found| format!("\"format\": {found}"));
        return Err(refused(path, Place::File, format!("{found}, expected \"format\": {FORMAT}")));
    }
    serde_json::from_str(&text).map_err(wrong)
}

/// Rows of a table, all `columns` of which are there.
pub(super) fn rows<T: DeserializeOwned>(path: &Path, columns: &[&str]) -> Result<Vec<T>, Error> {
    let csv_error = |error: csv::Error| unreadable(path, error.into());
    let mut reader = csv::Reader::from_reader(crate::io::open(path).map_err(|error| unreadable(path, error))?);
    let header = reader.headers().map_err(csv_error)?;
    if let Some(missing) = columns.iter().find(|column| !header.iter().any(|name| name == **column)) {
        let problem = match header.is_empty() {
            true => format!("the file is empty, expected a header with the columns {}", columns.join(",")),
            false => format!("column {missing} is missing, expected {}", columns.join(",")),
        };
        return Err(refused(path, Place::Line(1), problem));
    }
    reader.deserialize().collect::<Result<_, _>>().map_err(csv_error)
}

/// [`rows`] of a table that is `filled` by what the summary says.
fn table<T: DeserializeOwned>(dir: &Path, file: &str, columns: &[&str], filled: bool) -> Result<Vec<T>, Error> {
    let path = dir.join(file);
    let rows = rows(&path, columns)?;
    if filled && rows.is_empty() {
        let problem = format!("the table has no rows, expected some, as {SUMMARY} has results of them");
        return Err(refused(&path, Place::File, problem));
    }
    Ok(rows)
}

/// Rows of a table that only a diagnosis writes; none where it is not there.
fn rows_of_diagnosis<R: Row + DeserializeOwned>(dir: &Path) -> Result<Vec<R>, Error> {
    let path = dir.join(R::FILE);
    if path.exists() { rows(&path, R::COLUMNS) } else { Ok(Vec::new()) }
}

fn refused(path: &Path, place: Place, problem: String) -> Error {
    Error::Content { file: path.display().to_string(), place, problem }
}

fn unreadable(path: &Path, source: io::Error) -> Error {
    Error::Read { path: path.to_owned(), source }
}
