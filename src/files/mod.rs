//! Files that are read: regular ones alone, and held as a whole only where memory allows. Folders for what is being
//! written: [`scratch`]. Text in which values change: [`toml_text`]; XML: [`xml`].

pub(crate) mod scratch;
pub(crate) mod toml_text;
pub(crate) mod xml;

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Files that a block may have.
pub const OF_BLOCK: [&str; 6] = ["block.toml", "images.csv", "ties.csv", "points.csv", "control.csv", "marks.csv"];
/// Longest file that is held as a whole, bytes: a reconstruction of a hundred thousand images has less; what is longer
/// fills the memory.
const MOST_BYTES: u64 = 2 << 30;

/// Opens a file for reading. A pipe or a device in place of one, which might never end, is refused.
pub(crate) fn open(path: &Path) -> Result<File> {
    let kind = std::fs::metadata(path)?.file_type();
    if !kind.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "this is no regular file"));
    }
    File::open(path)
}

/// Reads a text file that [`open`] opens.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    std::io::read_to_string(bounded(path)?)
}

/// Reads a file that [`open`] opens.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    bounded(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn bounded(path: &Path) -> Result<File> {
    let file = open(path)?;
    let length = file.metadata()?.len();
    if length > MOST_BYTES {
        let text = format!("the file has {length} bytes, expected at most {MOST_BYTES}");
        return Err(Error::new(ErrorKind::FileTooLarge, text));
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_might_never_end_is_refused() {
        assert_eq!(read_text(Path::new("/dev/zero")).unwrap_err().to_string(), "this is no regular file");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sparse");
        // A hole takes no room.
        File::create(&path).unwrap().set_len(MOST_BYTES + 1).unwrap();
        assert_eq!(read(&path).unwrap_err().kind(), ErrorKind::FileTooLarge);
    }
}
