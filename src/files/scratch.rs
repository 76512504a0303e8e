//! Folders for what is being written. A program that is killed leaves its own behind; the next one that needs a folder there removes it. A
//! program that still runs holds a lock on its own.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
use std::path::Path;
use tempfile::TempDir;

/// Begins the name of such a folder.
const UNFINISHED: &str = ".misclosure-";
/// Tries to make a folder that nobody removes before it is locked.
const TRIES: usize = 10;

/// A new folder, which vanishes with this.
#[derive(Debug)]
pub(crate) struct Scratch {
    folder: TempDir,
    /// `None` on a file system without locks.
    _lock: Option<File>,
}

impl Scratch {
    /// In `parent`; what killed programs left there goes.
    pub(crate) fn new_in(parent: &Path) -> io::Result<Self> {
        sweep(parent);
        // Such as any new folder has, where the default for temporary ones lets nobody else read.
        let permissions: fs::Permissions = std::os::unix::fs::PermissionsExt::from_mode(0o777);
        for _ in 0..TRIES {
            let builder =
                || tempfile::Builder::new().prefix(UNFINISHED).permissions(permissions.clone()).tempdir_in(parent);
            let folder = builder()?;
            let lock = File::open(folder.path()).and_then(|file| file.lock().map(|()| file)).ok();
            // Who tidies up may have been faster than the lock.
            if folder.path().exists() {
                return Ok(Self { folder, _lock: lock });
            }
        }
        Err(io::ErrorKind::ResourceBusy.into())
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Is it left of a program that was killed, or of one that still runs?
pub(crate) fn is_unfinished(name: &OsStr) -> bool {
    name.to_string_lossy().starts_with(UNFINISHED)
}

/// Does no program that runs hold this folder?
pub(crate) fn is_left(folder: &Path) -> bool {
    // A file system without locks tells nothing: the folder stays.
    File::open(folder).is_ok_and(|file| file.try_lock().is_ok())
}

/// Removes what killed programs left. What cannot be removed is no reason to fail.
fn sweep(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if is_unfinished(&entry.file_name()) && is_left(&entry.path()) {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_program_left_goes_and_what_another_holds_stays() {
        let root = tempfile::tempdir().unwrap();
        let running = Scratch::new_in(root.path()).unwrap();
        let killed = root.path().join(format!("{UNFINISHED}x"));
        fs::create_dir(&killed).unwrap();
        fs::write(killed.join("half"), "").unwrap();
        fs::write(root.path().join("mine"), "").unwrap();
        let new = Scratch::new_in(root.path()).unwrap();
        assert!(
            !killed.exists() && running.path().exists() && new.path().exists() && root.path().join("mine").exists()
        );
        drop((running, new));
        assert_eq!(fs::read_dir(root.path()).unwrap().count(), 1);
    }
}
