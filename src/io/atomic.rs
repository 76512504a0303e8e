//! Files that appear whole or not at all.

use super::Error;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::{Builder, NamedTempFile};

/// Buffer of a table that is being written: few system calls, little memory.
const BUFFER_BYTES: usize = 1 << 18;

/// A file under a temporary name in its own folder; it takes its name with [`AtomicFile::commit`] and vanishes
/// otherwise.
pub(super) struct AtomicFile {
    path: PathBuf,
    writer: BufWriter<NamedTempFile>,
}

impl AtomicFile {
    pub(super) fn create(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::Write { path: path.to_owned(), source };
        // A bare name has the empty path as its folder.
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // Said here, as the temporary file's own error would name the temporary file.
        std::fs::metadata(folder).map_err(failed)?;
        let file = temporary().tempfile_in(folder).map_err(failed)?;
        Ok(Self { path: path.to_owned(), writer: BufWriter::with_capacity(BUFFER_BYTES, file) })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file its name, in place of an older one.
    pub(super) fn commit(self) -> Result<(), Error> {
        let failed = |source| Error::Write { path: self.path.clone(), source };
        let file = self.writer.into_inner().map_err(|error| failed(error.into_error()))?;
        file.persist(&self.path).map(drop).map_err(|error| failed(error.error))
    }
}

/// Names and permissions of a temporary file: those of any new file, where the system's default for temporary ones lets
/// nobody else read.
fn temporary() -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Writes `bytes` as the file `path`, whole or not at all: into a temporary file of the same folder, then renamed.
///
/// # Errors
/// [`Error::Write`]; an older file is then untouched.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(bytes).map_err(|source| Error::Write { path: path.to_owned(), source })?;
    file.commit()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn replaces_whole_and_leaves_no_trace_when_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        write_atomically(&path, b"old").unwrap();
        {
            let mut half = AtomicFile::create(&path).unwrap();
            half.write_all(b"half").unwrap();
        }
        assert_eq!(fs::read(&path).unwrap(), b"old");
        write_atomically(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn whoever_may_read_any_new_file_may_read_it() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (plain, written) = (folder.path().join("plain"), folder.path().join("written"));
        fs::write(&plain, b"").unwrap();
        write_atomically(&written, b"").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&written), mode(&plain));
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("none").join("a.csv");
        let message = write_atomically(&path, b"").unwrap_err().to_string();
        assert_eq!(message, format!("{}: cannot write: No such file or directory (os error 2)", path.display()));
    }
}
