//! The zip files of a project.

use super::super::super::error::{Error, Place};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use zip::ZipArchive;

/// Longest member, unpacked, bytes. The program holds a member as a whole.
const MOST_BYTES: u64 = 2 << 30;
/// Largest ratio of unpacked to packed bytes. Documents of projects have 10 to 30, tables of points 1 to 3; a file with
/// a larger ratio was made to fill memory.
const MOST_TIMES: u64 = 100;
/// A member of up to this many unpacked bytes may have any ratio.
const HARMLESS_BYTES: u64 = 16 << 20;

/// An open zip file.
pub(super) struct Archive {
    path: PathBuf,
    length: u64,
    zip: ZipArchive<BufReader<File>>,
}

impl Archive {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let file = super::super::super::open(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
        let length = file.metadata().map_or(0, |metadata| metadata.len());
        let zip = ZipArchive::new(BufReader::new(file)).map_err(|error| {
            Error::content(path.display().to_string(), Place::File, format!("expected a zip file: {error}"))
        })?;
        Ok(Self { path: path.to_owned(), length, zip })
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
        // The packed size is the file's claim: it cannot exceed the length of the file.
        let packed = file.compressed_size().min(self.length);
        let most = packed.saturating_mul(MOST_TIMES).clamp(HARMLESS_BYTES, MOST_BYTES);
        let too_long =
            || refuse(format!("is packed to {packed} bytes, expected at most {most} when unpacked, found more"));
        // The unpacked size is a claim too, so the program counts the bytes as it reads.
        if file.size() > most {
            return Err(too_long());
        }
        let mut bytes = Vec::new();
        let read = file.take(most + 1).read_to_end(&mut bytes);
        match read.map_err(|error| refuse(format!("cannot be unpacked: {error}")))? as u64 {
            length if length > most => Err(too_long()),
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
