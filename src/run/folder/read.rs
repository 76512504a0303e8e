//! A run folder, read back.

use super::rows::{
    CheckRow, CovarianceRow, FoundRow, GnssRow, ImageRow, ImageScaleRow, ModelCheckRow, OutlierRow, PointRow,
    ProfileRow, ResidualLine, ResidualRef, Row, SensorRow,
};
use super::source::{Provenance, read_provenance};
use super::{DIAGNOSIS, MODEL, SUMMARY};
use crate::io::{Error, Place};
use crate::run::summary::{FORMAT, Rows, Summary};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::io;
use std::path::{Path, PathBuf};

/// What the page of a run is made from. `D` is what stands in `diagnosis.json`: a run does not know what a diagnosis
/// is.
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
    /// `checks.csv`.
    pub checks: Vec<CheckRow>,
    /// `parameter_covariance.csv`; empty where no covariance was computed.
    pub covariance: Vec<CovarianceRow>,
    /// `gnss.csv`; empty where the block has no GNSS positions, or nothing to compare them with.
    pub gnss: Vec<GnssRow>,
    /// `sensor.csv`.
    pub sensor: Vec<SensorRow>,
    /// `image_scale.csv`; empty for an adjustment.
    pub scales: Vec<ImageScaleRow>,
    /// Pictures of the effects that were found; empty where none was.
    pub found: Vec<FoundRow>,
    /// `profiles.csv`; empty for an adjustment.
    pub profiles: Vec<ProfileRow>,
    /// `checks_by_model.csv`; empty for an adjustment, and where a diagnosis added nothing.
    pub checks_by_model: Vec<ModelCheckRow>,
    /// Where the run comes from; nothing of it is known of a folder of before it was noted.
    pub provenance: Provenance,
}

impl<D: DeserializeOwned> RunFolder<D> {
    /// Reads the folder, without the residuals of its measurements: [`each_residual`] reads those one by one.
    ///
    /// # Errors
    /// A file that is missing, cannot be read, is of another version, or lacks the rows that the summary speaks of; by
    /// name.
    pub fn read(dir: &Path) -> Result<Self, Error> {
        let diagnosis = dir.join(DIAGNOSIS);
        let summary: Summary = json(&dir.join(SUMMARY))?;
        let rows = summary.rows;
        let (tied, surveyed) = (summary.tie_rms_px.is_some(), summary.control.is_some() || summary.check.is_some());
        Ok(Self {
            model: text(&dir.join(MODEL))?,
            diagnosis: if diagnosis.exists() { Some(json(&diagnosis)?) } else { None },
            images: table(dir, ImageRow::FILE, ImageRow::COLUMNS, true, rows.map(|rows| rows.images))?,
            checks: whole(dir, surveyed, rows.map(|rows| rows.checks))?,
            covariance: rows_where_there::<CovarianceRow>(dir)?,
            gnss: rows_where_there::<GnssRow>(dir)?,
            sensor: whole(dir, tied, None)?,
            scales: rows_where_there::<ImageScaleRow>(dir)?,
            found: rows_where_there::<FoundRow>(dir)?,
            profiles: rows_where_there::<ProfileRow>(dir)?,
            checks_by_model: rows_where_there::<ModelCheckRow>(dir)?,
            provenance: read_provenance(dir)?,
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

/// Hands every residual of a folder to `take`, in the order of the file.
///
/// # Errors
/// A file that cannot be read, that has no rows, or fewer than the run wrote.
pub fn each_residual(dir: &Path, mut take: impl FnMut(ResidualRef<'_>)) -> Result<(), Error> {
    let path = dir.join(ResidualLine::FILE);
    let csv_error = |error: csv::Error| unreadable(&path, error.into());
    let mut reader = reader(&path, ResidualLine::COLUMNS)?;
    let header = reader.headers().map_err(csv_error)?.clone();
    let mut record = csv::StringRecord::new();
    let mut found = 0;
    while reader.read_record(&mut record).map_err(csv_error)? {
        take(record.deserialize(Some(&header)).map_err(csv_error)?);
        found += 1;
    }
    complete(&path, found, true, expected_rows(dir)?.map(|rows| rows.residuals))
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
    whole(dir, false, expected_rows(dir)?.map(|rows| rows.points))
}

/// The residuals of a folder, all of them.
///
/// # Errors
/// As [`each_residual`].
pub(super) fn read_residuals(dir: &Path) -> Result<Vec<ResidualLine>, Error> {
    whole(dir, true, expected_rows(dir)?.map(|rows| rows.residuals))
}

/// What the summary says of the tables.
fn expected_rows(dir: &Path) -> Result<Option<Rows>, Error> {
    Ok(json::<Summary>(&dir.join(SUMMARY))?.rows)
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
    reader(path, columns)?.deserialize().collect::<Result<_, _>>().map_err(|error| unreadable(path, error.into()))
}

/// A reader of a table, all `columns` of which are there.
fn reader(path: &Path, columns: &[&str]) -> Result<csv::Reader<impl io::Read>, Error> {
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
    Ok(reader)
}

/// [`rows`] of a table that is `filled` by what the summary says, and has as many rows as `expected`.
fn whole<R: Row + DeserializeOwned>(dir: &Path, filled: bool, expected: Option<usize>) -> Result<Vec<R>, Error> {
    table(dir, R::FILE, R::REQUIRED, filled, expected)
}

/// See [`whole`].
fn table<T: DeserializeOwned>(
    dir: &Path,
    file: &str,
    columns: &[&str],
    filled: bool,
    expected: Option<usize>,
) -> Result<Vec<T>, Error> {
    let path = dir.join(file);
    let rows = rows(&path, columns)?;
    complete(&path, rows.len(), filled, expected)?;
    Ok(rows)
}

fn complete(path: &Path, found: usize, filled: bool, expected: Option<usize>) -> Result<(), Error> {
    match expected {
        _ if filled && found == 0 => Err(without_rows(path)),
        Some(expected) if expected != found => {
            let problem = format!("the table has {found} rows, expected {expected}, which the run wrote ({SUMMARY})");
            Err(refused(path, Place::File, problem))
        }
        _ => Ok(()),
    }
}

fn without_rows(path: &Path) -> Error {
    let problem = format!("the table has no rows, expected some, as {SUMMARY} has results of them");
    refused(path, Place::File, problem)
}

/// Rows of a table that not every run has; none where it is not there.
fn rows_where_there<R: Row + DeserializeOwned>(dir: &Path) -> Result<Vec<R>, Error> {
    let path = dir.join(R::FILE);
    if path.exists() { rows(&path, R::REQUIRED) } else { Ok(Vec::new()) }
}

fn refused(path: &Path, place: Place, problem: String) -> Error {
    Error::Content { file: path.display().to_string(), place, problem }
}

fn unreadable(path: &Path, source: io::Error) -> Error {
    Error::Read { path: path.to_owned(), source }
}
