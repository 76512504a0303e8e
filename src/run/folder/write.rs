//! A run folder, written.

use super::measured::{gnss_rows, lines, sensor_means};
use super::rows::{FoundRow, ImageRow, ImageScaleRow, ModelCheckRow, OutlierRow, ProfileRow, Row, SensorRow};
use super::solved::Solved;
use super::{DIAGNOSIS, MODEL, SUMMARY, covariance};
use crate::block::Block;
use crate::io::table::{TableWriter, write_json};
use crate::io::{self, Error};
use crate::model::Model;
use crate::run::summary::Summary;
use crate::run::{GnssResidual, ResidualRow, Run};
use serde::Serialize;
use std::path::Path;

/// What the pictures of a diagnosis are drawn from; stage [`super::BASE`] before effects were added, [`super::FINAL`]
/// after.
#[derive(Debug, Clone, Default)]
pub struct Pictures {
    /// Mean residuals over the sensor.
    pub sensor: Vec<SensorRow>,
    /// Scale residuals per image.
    pub scales: Vec<ImageScaleRow>,
    /// Pictures of the effects that were found.
    pub found: Vec<FoundRow>,
    /// Mean residuals against what was recorded.
    pub profiles: Vec<ProfileRow>,
    /// Surveyed points before effects were added and after; empty where none were.
    pub checks: Vec<ModelCheckRow>,
}

/// Writes model, summary and tables into `dir`, which is made when it is not there; files of an older run are replaced.
/// `rows` are the residuals of the run, `gnss` those of the GNSS positions.
///
/// # Errors
/// What cannot be written.
pub fn write(
    dir: &Path,
    block: &Block,
    model: &Model,
    run: &Run,
    rows: &[ResidualRow],
    gnss: &[GnssResidual],
) -> Result<(), Error> {
    std::fs::create_dir_all(dir).map_err(|source| Error::Write { path: dir.to_owned(), source })?;
    let solved = Solved::of(block, model, run);
    io::model::write_model(model, &dir.join(MODEL))?;
    io::block::write_images(&solved.adjusted_images(), &dir.join(ImageRow::FILE))?;
    write_rows(dir, solved.points())?;
    write_rows(dir, lines(block, rows))?;
    write_rows(dir, solved.checks())?;
    let covariance = solved.precision().map(|(covariance, sigma0)| covariance::rows(&run.problem, covariance, sigma0));
    write_rows(dir, covariance.into_iter().flatten())?;
    write_rows(dir, gnss_rows(block, gnss))?;
    remove_diagnosis(dir)?;
    write_rows(dir, sensor_means(block, rows))?;
    // Last: where it is, the run is complete.
    write_json(&dir.join(SUMMARY), &Summary::of(block, run, rows))
}

/// Writes residuals alone: all that there is to say of an adjustment that failed.
///
/// # Errors
/// What cannot be written.
pub fn write_residuals(dir: &Path, block: &Block, rows: &[ResidualRow]) -> Result<(), Error> {
    write_rows(dir, lines(block, rows))
}

/// Adds to the folder of a run what was set aside before it was adjusted.
///
/// # Errors
/// What cannot be written.
pub fn write_outliers(dir: &Path, rows: Vec<OutlierRow>) -> Result<(), Error> {
    write_rows(dir, rows.into_iter())
}

/// Adds to the folder of a run what a diagnosis found; its means over the sensor replace those of the run.
///
/// # Errors
/// What cannot be written.
pub fn write_diagnosis<D: Serialize>(dir: &Path, diagnosis: &D, pictures: Pictures) -> Result<(), Error> {
    write_json(&dir.join(DIAGNOSIS), diagnosis)?;
    write_rows(dir, pictures.sensor.into_iter())?;
    write_rows(dir, pictures.scales.into_iter())?;
    write_rows(dir, pictures.found.into_iter())?;
    write_rows(dir, pictures.profiles.into_iter())?;
    match pictures.checks.is_empty() {
        true => Ok(()),
        false => write_rows(dir, pictures.checks.into_iter()),
    }
}

/// Removes what only a diagnosis writes, so that an adjustment into the folder of an older one is not taken for it.
fn remove_diagnosis(dir: &Path) -> Result<(), Error> {
    for name in [DIAGNOSIS, ImageScaleRow::FILE, ProfileRow::FILE, FoundRow::FILE, ModelCheckRow::FILE] {
        let path = dir.join(name);
        match std::fs::remove_file(&path) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => return Err(Error::Write { path, source }),
            _ => {}
        }
    }
    Ok(())
}

pub(super) fn write_rows<R: Row>(dir: &Path, rows: impl Iterator<Item = R>) -> Result<(), Error> {
    let mut table = TableWriter::create(&dir.join(R::FILE), R::COLUMNS)?;
    for row in rows {
        row.put(&mut table);
        table.end_row()?;
    }
    table.finish()
}

#[cfg(test)]
mod tests {
    use super::super::FINAL;
    use super::super::read::rows;
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let row = ImageScaleRow {
            stage: FINAL.into(),
            image: "a, \"b\"".into(),
            flight: "1".into(),
            scale_px: Some(0.1 + 0.2),
            sigma_px: None,
        };
        write_rows(dir.path(), std::iter::once(row.clone())).unwrap();
        assert_eq!(rows::<ImageScaleRow>(&dir.path().join("image_scale.csv"), ImageScaleRow::COLUMNS).unwrap(), [row]);
    }

    #[test]
    fn a_diagnosis_of_an_older_run_goes() {
        let dir = tempfile::tempdir().unwrap();
        write_diagnosis(dir.path(), &"found", Pictures::default()).unwrap();
        let files = || {
            let mut names: Vec<_> = std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
            names.sort();
            names
        };
        assert_eq!(files(), ["diagnosis.json", "found.csv", "image_scale.csv", "profiles.csv", "sensor.csv"]);
        remove_diagnosis(dir.path()).unwrap();
        assert_eq!(files(), ["sensor.csv"]);
    }
}
