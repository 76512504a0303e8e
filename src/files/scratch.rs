//! Temporary folders for unfinished results. A program that runs locks its folder. A killed program leaves its folder
//! behind, without a lock; the next program that makes a folder in the same place removes it. A program that a user
//! interrupts removes its own ([`remove_all`]).

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::TempDir;

/// First characters of the name of a temporary folder.
const UNFINISHED: &str = ".misclosure-";
/// Attempts to make a folder that no other program removes before it is locked.
const TRIES: usize = 10;

/// The temporary folders of this program. Whoever moves results out of one holds the list meanwhile.
static HELD: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// The list of temporary folders: while a caller has it, [`remove_all`] waits.
pub(crate) fn hold() -> MutexGuard<'static, Vec<PathBuf>> {
    HELD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary folders of this program, which ends now: the list stays locked.
pub(crate) fn remove_all() {
    let held = hold();
    held.iter().for_each(|folder| remove(folder));
    std::mem::forget(held);
}

/// Removes a folder into which another thread may write meanwhile: under another name nothing new gets into it. A
/// thread that makes its folders anew makes them a few times at most.
fn remove(folder: &Path) {
    for number in 0..TRIES {
        let mut name = folder.as_os_str().to_owned();
        name.push(format!("-{number}"));
        let moved = PathBuf::from(name);
        if fs::rename(folder, &moved).is_err() {
            return;
        }
        // A call that found the folder before it moved may still write into it, once in each thread.
        (0..TRIES).any(|_| fs::remove_dir_all(&moved).is_ok());
    }
}

/// A temporary folder; dropping removes it.
#[derive(Debug)]
pub(crate) struct Scratch {
    folder: TempDir,
    /// `None` on a file system without locks.
    _lock: Option<File>,
}

impl Scratch {
    /// In `parent`. Removes the folders that killed programs left there.
    pub(crate) fn new_in(parent: &Path) -> io::Result<Self> {
        sweep(parent);
        // Those of any new folder; the default for temporary folders lets nobody else read.
        let permissions: fs::Permissions = std::os::unix::fs::PermissionsExt::from_mode(0o777);
        for _ in 0..TRIES {
            let builder =
                || tempfile::Builder::new().prefix(UNFINISHED).permissions(permissions.clone()).tempdir_in(parent);
            let mut held = hold();
            let folder = builder()?;
            held.push(folder.path().to_owned());
            drop(held);
            let lock = File::open(folder.path()).and_then(|file| file.lock().map(|()| file)).ok();
            // Another program may have removed it before the lock.
            let made = Self { folder, _lock: lock };
            if made.path().exists() {
                return Ok(made);
            }
        }
        Err(io::ErrorKind::ResourceBusy.into())
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let mut held = hold();
        let _ = fs::remove_dir_all(self.path());
        held.retain(|held| held != self.folder.path());
    }
}

/// Is this the name of a temporary folder, of a program that runs or was killed?
pub(crate) fn is_unfinished(name: &OsStr) -> bool {
    name.to_string_lossy().starts_with(UNFINISHED)
}

/// Did a killed program leave this folder?
pub(crate) fn is_left(folder: &Path) -> bool {
    // On a file system without locks nobody knows: the folder stays.
    File::open(folder).is_ok_and(|file| file.try_lock().is_ok())
}

/// Removes the folders that killed programs left. One that cannot be removed is no reason to fail.
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
    fn a_folder_goes_while_it_is_written_to() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join(format!("{UNFINISHED}x"));
        for _ in 0..50 {
            fs::create_dir(&folder).unwrap();
            std::thread::scope(|scope| {
                let writer = scope.spawn(|| {
                    // Until the folder has gone.
                    (0..100_000).take_while(|k| fs::write(folder.join(k.to_string()), "").is_ok()).count()
                });
                while fs::read_dir(&folder).unwrap().count() < 20 {}
                remove(&folder);
                assert!(writer.join().unwrap() >= 20);
            });
            assert_eq!(fs::read_dir(root.path()).unwrap().count(), 0);
        }
    }

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
