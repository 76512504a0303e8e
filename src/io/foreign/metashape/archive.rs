//! The zip files of a project.

use super::super::super::error::{Error, Place};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use zip::ZipArchive;

/// Longest member that is unpacked, bytes: far beyond any project, and a file made to fill the memory is refused.
const MOST_BYTES: u64 = 1 << 32;

/// An open zip file.
pub(super) struct Archive {
    path: PathBuf,
    zip: ZipArchive<BufReader<File>>,
}

impl Archive {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let file = super::super::super::open(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
        let zip = ZipArchive::new(BufReader::new(file)).map_err(|error| {
            Error::content(path.display().to_string(), Place::File, format!("expected a zip file: {error}"))
        })?;
        Ok(Self { path: path.to_owned(), zip })
    }

    /// A member's name in messages.
    pub(super) fn name_of(&self, member: &str) -> String {
        format!("{}, {member}", self.path.display())
    }

    /// The bytes of a member.
    pub(super) fn bytes(&mut self, member: &str) -> Result<Vec<u8>, Error> {
        let name = self.name_of(member);
        let refuse = |problem: String| Error::content(&name, Place::File, problem);
        let file = self.zip.by_name(member).map_err(|error| refuse(format!("cannot be unpacked: {error}")))?;
        let mut bytes = Vec::new();
        let read = file.take(MOST_BYTES).read_to_end(&mut bytes);
        match read.map_err(|error| refuse(format!("cannot be unpacked: {error}")))? as u64 {
            MOST_BYTES => Err(refuse(format!("expected less than {MOST_BYTES} bytes, found more"))),
            _ => Ok(bytes),
        }
    }

    /// The text of a member.
    pub(super) fn text(&mut self, member: &str) -> Result<String, Error> {
        let bytes = self.bytes(member)?;
        String::from_utf8(bytes)
            .map_err(|_| Error::content(self.name_of(member), Place::File, "expected a text in UTF-8"))
    }
}
