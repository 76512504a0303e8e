//! The folder of a run: what it holds, written and read. File names and columns stand in this room and nowhere else.
//!
//! Poses, points and their standard deviations are in the survey's system where a similarity took the block there, else
//! in the adjustment's own.

mod adjusted;
mod covariance;
mod measured;
mod provenance;
mod read;
mod rows;
mod solved;
mod source;
mod surveyed;
mod tables;
mod write;

pub use crate::io::write_atomically;
pub use adjusted::Adjusted;
pub use measured::gnss_rows;
pub(crate) use provenance::state_command;
pub use read::{RunFolder, each_residual, read_outliers, read_points};
use rows::Row;
pub use rows::{
    CheckRow, CovarianceRow, FoundRow, GnssRow, ImageRow, ImageScaleRow, ModelCheckRow, OutlierRow, PointRow,
    ProfileRow, ResidualLine, ResidualRef, SensorRow,
};
pub use source::{
    Provenance, is_laboratory, is_run, left_by_a_failure, read_laboratory, read_provenance, read_source,
    write_laboratory, write_source,
};
pub use surveyed::checks_by_model;
pub use tables::Tables;
pub use write::{Pictures, write, write_diagnosis, write_outliers, write_residuals};

/// Every file that a run may have, its last apart.
pub const FILES: [&str; 18] = [
    MODEL,
    SOURCE,
    OutlierRow::FILE,
    ImageRow::FILE,
    PointRow::FILE,
    ResidualLine::FILE,
    CheckRow::FILE,
    GnssRow::FILE,
    SensorRow::FILE,
    DIAGNOSIS,
    ImageScaleRow::FILE,
    ProfileRow::FILE,
    FoundRow::FILE,
    ModelCheckRow::FILE,
    MENDED,
    CAMERAS_GEOJSON,
    POINTS_GEOJSON,
    CovarianceRow::FILE,
];

/// The images of a run on the globe.
pub const CAMERAS_GEOJSON: &str = "cameras.geojson";
/// Control and check points of a run on the globe, with their errors.
pub const POINTS_GEOJSON: &str = "points.geojson";

/// Which block was adjusted.
const SOURCE: &str = "source.json";
/// The model as used.
const MODEL: &str = "model.toml";
/// What was found; where it is, the run is complete.
pub const SUMMARY: &str = "summary.json";
/// The page of a run.
pub const REPORT: &str = "report.html";
/// Which mistakes were undone in the block that was adjusted.
pub const MENDED: &str = "mended.toml";
/// What a diagnosis found.
const DIAGNOSIS: &str = "diagnosis.json";

/// Before effects were added, and with them.
pub const BASE: &str = "base";
/// See [`BASE`].
pub const FINAL: &str = "final";

/// The final model with an effect switched off, and with it.
pub const WITHOUT: &str = "without";
/// See [`WITHOUT`].
pub const WITH: &str = "with";
