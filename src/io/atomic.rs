//! Files that appear whole or not at all.

use super::Error;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Buffer of a table that is being written: few system calls, little memory.
const BUFFER_BYTES: usize = 1 << 18;

/// A file under a temporary name in its own folder; it takes its name with [`AtomicFile::commit`] and vanishes otherwise.
pub(super) struct AtomicFile {
    path: PathBuf,
    temporary: PathBuf,
    /// `None` once committed.
    writer: Option<BufWriter<File>>,
}

impl AtomicFile {
    pub(super) fn create(path: &Path) -> Result<Self, Error> {
        // Writers of the same file in one process need names of their own.
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let serial = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let temporary = path.with_file_name(format!(".{name}.{}-{serial}.tmp", std::process::id()));
        let file = File::create(&temporary).map_err(|source| Error::Write { path: path.to_owned(), source })?;
        Ok(Self { path: path.to_owned(), temporary, writer: Some(BufWriter::with_capacity(BUFFER_BYTES, file)) })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file its name, in place of an older one.
    pub(super) fn commit(mut self) -> Result<(), Error> {
        let renamed = self.flush().and_then(|()| fs::rename(&self.temporary, &self.path));
        renamed.map_err(|source| Error::Write { path: self.path.clone(), source })?;
        self.writer = None;
        Ok(())
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.as_mut().map_or(Ok(0), |writer| writer.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.as_mut().map_or(Ok(()), |writer| writer.flush())
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        if self.writer.take().is_some() {
            // Nothing to be done for a leftover that cannot be removed.
            let _ = fs::remove_file(&self.temporary);
        }
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

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("none").join("a.csv");
        let message = write_atomically(&path, b"").unwrap_err().to_string();
        assert_eq!(message, format!("{}: cannot write: No such file or directory (os error 2)", path.display()));
    }
}
