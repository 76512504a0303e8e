//! `source.json`: which block a run adjusted, or a laboratory works on.

use super::{FILES, ResidualLine, Row, SOURCE, SUMMARY};
use crate::io::table::write_json;
use crate::io::{Error, read_text};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::io::BufRead;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};

pub use super::provenance::Provenance;

/// Version of the file.
const FORMAT: u32 = 1;
/// Begins the name of a step of a laboratory.
const STEP_FOLDER: &str = "step-";

/// The file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Source {
    format: u32,
    block: String,
    /// The path as the system has it, where it is no UTF-8.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    block_bytes: Option<Vec<u8>>,
    /// Of a run: when, by which version, with which command, and in which coordinate system.
    #[serde(flatten)]
    provenance: Provenance,
    /// SHA-256 of what a laboratory works on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    laboratory_of: Option<String>,
}

impl Source {
    fn of(block: &Path) -> Self {
        let block = block.canonicalize().unwrap_or_else(|_| block.to_owned());
        let bytes = block.as_os_str().as_bytes();
        let block_bytes = block.to_str().is_none().then(|| bytes.to_vec());
        let provenance = Provenance::default();
        Self { format: FORMAT, block: block.display().to_string(), block_bytes, provenance, laboratory_of: None }
    }

    fn path(self) -> PathBuf {
        self.block_bytes.map_or_else(|| self.block.into(), |bytes| OsString::from_vec(bytes).into())
    }
}

fn read(dir: &Path) -> Result<Option<Source>, Error> {
    let path = dir.join(SOURCE);
    if !path.exists() {
        return Ok(None);
    }
    let unreadable = |source| Error::Read { path: path.clone(), source };
    let text = read_text(&path).map_err(unreadable)?;
    serde_json::from_str(&text).map(Some).map_err(|error| unreadable(error.into()))
}

/// Notes in the folder of a run which block it adjusted, in which coordinate system, when and by which command.
///
/// # Errors
/// What cannot be written.
pub fn write_source(dir: &Path, block: &Path, crs: &str) -> Result<(), Error> {
    write_json(&dir.join(SOURCE), &Source { provenance: Provenance::now(crs), ..Source::of(block) })
}

/// Where the run of a folder comes from; empty where that was not noted.
///
/// # Errors
/// A file that cannot be read.
pub fn read_provenance(dir: &Path) -> Result<Provenance, Error> {
    Ok(read(dir)?.map(|source| source.provenance).unwrap_or_default())
}

/// The folder of the block that a run adjusted, or a laboratory works on; `None` for a run of before it was noted.
///
/// # Errors
/// A file that cannot be read.
pub fn read_source(dir: &Path) -> Result<Option<PathBuf>, Error> {
    Ok(read(dir)?.map(Source::path))
}

/// Notes in the folder of a laboratory which block it works on, and the SHA-256 of that block's files.
///
/// # Errors
/// What cannot be written.
pub fn write_laboratory(dir: &Path, block: &Path, sha256: &str) -> Result<(), Error> {
    write_json(&dir.join(SOURCE), &Source { laboratory_of: Some(sha256.to_owned()), ..Source::of(block) })
}

/// The SHA-256 that [`write_laboratory`] noted; `None` for a laboratory of before it was noted.
///
/// # Errors
/// A file that cannot be read.
pub fn read_laboratory(dir: &Path) -> Result<Option<String>, Error> {
    Ok(read(dir)?.and_then(|source| source.laboratory_of))
}

/// Is it the folder of a laboratory?
pub fn is_laboratory(dir: &Path) -> bool {
    let Ok(Some(source)) = read(dir) else { return false };
    let is_step = |entry: std::fs::DirEntry| entry.file_name().to_string_lossy().starts_with(STEP_FOLDER);
    let has_steps = || std::fs::read_dir(dir).into_iter().flatten().flatten().any(is_step);
    source.laboratory_of.is_some() || (!dir.join(SUMMARY).exists() && has_steps())
}

/// Is it the folder of a run? By what its summary says: files of other programs have the same names.
pub fn is_run(dir: &Path) -> bool {
    let summary = read_text(&dir.join(SUMMARY)).ok().and_then(|text| serde_json::from_str(&text).ok());
    summary.is_some_and(|summary: serde_json::Value| summary["format"].is_u64() && summary["solvers"].is_object())
}

/// Is all that it has of a run the residuals of an adjustment that failed?
pub fn left_by_a_failure(dir: &Path) -> bool {
    let Ok(file) = crate::io::open(&dir.join(ResidualLine::FILE)) else { return false };
    let mut header = String::new();
    let read = std::io::BufReader::new(std::io::Read::take(file, 1 << 10)).read_line(&mut header);
    let others = FILES.iter().chain([&SUMMARY]).filter(|name| **name != ResidualLine::FILE);
    read.is_ok()
        && header.trim_end() == ResidualLine::COLUMNS.join(",")
        && others.clone().all(|name| !dir.join(name).exists())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_notes_where_it_comes_from() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(read_provenance(dir.path()).unwrap(), Provenance::default());
        write_source(dir.path(), Path::new("/nowhere/q"), "EPSG:32633").unwrap();
        let noted = read_provenance(dir.path()).unwrap();
        assert_eq!(
            (noted.crs.as_deref(), noted.version.as_deref()),
            (Some("EPSG:32633"), Some(env!("CARGO_PKG_VERSION")))
        );
        assert!(noted.written.is_some_and(|date| date.ends_with('Z')) && noted.command.is_some());
        // Of before that was noted.
        std::fs::write(dir.path().join(SOURCE), r#"{"format": 1, "block": "/nowhere/q"}"#).unwrap();
        assert_eq!(read_provenance(dir.path()).unwrap(), Provenance::default());
    }

    #[test]
    fn a_path_that_is_no_text_is_noted_and_read() {
        let dir = tempfile::tempdir().unwrap();
        let block = Path::new("/nowhere").join(OsString::from_vec(b"q\xff".to_vec()));
        write_source(dir.path(), &block, "local").unwrap();
        assert_eq!(read_source(dir.path()).unwrap(), Some(block));
        write_source(dir.path(), Path::new("/nowhere/q"), "local").unwrap();
        assert!(!std::fs::read_to_string(dir.path().join(SOURCE)).unwrap().contains("bytes"));
    }

    #[test]
    fn laboratories_and_runs_are_told_apart() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        assert!(!is_laboratory(dir.path()) && !is_run(dir.path()) && !left_by_a_failure(dir.path()));
        write_laboratory(dir.path(), &at("block"), "ab").unwrap();
        assert_eq!(read_laboratory(dir.path()).unwrap().as_deref(), Some("ab"));
        assert!(is_laboratory(dir.path()));
        // Of before its hash was noted.
        write_source(dir.path(), &at("block"), "local").unwrap();
        assert!(!is_laboratory(dir.path()));
        std::fs::create_dir(at("step-0001")).unwrap();
        assert!(is_laboratory(dir.path()));
        std::fs::write(at(SUMMARY), "{}").unwrap();
        assert!(!is_laboratory(dir.path()) && !is_run(dir.path()));
        std::fs::write(at(SUMMARY), r#"{"format": 1, "solvers": {}}"#).unwrap();
        assert!(is_run(dir.path()));
    }
}
