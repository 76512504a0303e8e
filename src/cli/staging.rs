//! Staging: a command writes its results into a temporary folder, which replaces the output when the results are
//! complete.
//!
//! The temporary folder lies beside the output. One rename makes a new output. One system call exchanges an existing
//! output with the temporary folder, so that a reader, and a user who kills the program, finds either the older or the
//! newer run, complete. Files that belong to no run are linked into the new folder first. The program removes the older
//! run after the exchange: a reader that holds the older folder open loses its files then and has to open the path
//! again.
//!
//! Some outputs cannot be exchanged: a mount point, the working directory, a folder of another user, or a file system
//! without that call. There the temporary folder lies inside the output, and the files move out of it one by one. A
//! program killed meanwhile leaves a list of the remaining moves, and the next command makes them ([`finish`]).
//!
//! The next command that writes to the place removes the temporary folders of killed programs:
//! [`crate::files::scratch`].

use crate::files::scratch::{Scratch, hold, is_left, is_unfinished};
use std::ffi::OsStr;
use std::fs;
use std::io::{self, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// The list of remaining moves, in a temporary folder inside the output. It has the file that moves last, then the
/// files of the older run to remove, one a line.
const WHOLE: &str = ".whole";
/// Bytes of a test file: an existing folder may still refuse files.
const PROBE_BYTES: usize = 1 << 16;

/// A temporary folder for results, and the output that it will replace.
#[derive(Debug)]
pub struct Staging {
    folder: PathBuf,
    staged: Scratch,
    inside: bool,
    // Declared after `staged`, so dropped after it: a parent must be empty by then.
    _parents: Parents,
}

impl Staging {
    /// For results of `room` bytes in `folder`, a path without links and `..`. The folder need not exist.
    ///
    /// # Errors
    /// A place that refuses files, or has less room.
    pub fn open(folder: &Path, room: u64) -> io::Result<Self> {
        let parents = Parents::make(folder)?;
        let (staged, inside) = match beside(folder)? {
            Some(parent) => match Scratch::new_in(&parent) {
                Err(_) if folder.is_dir() => (Scratch::new_in(folder)?, true),
                made => (made?, false),
            },
            None => (Scratch::new_in(folder)?, true),
        };
        probe(staged.path(), room)?;
        if folder.is_dir() && !inside {
            // A user who may not write to a folder may not replace it either.
            tempfile::tempfile_in(folder)?;
        }
        Ok(Self { folder: folder.to_owned(), staged, inside, _parents: parents })
    }

    /// The temporary folder, for the results.
    pub fn path(&self) -> &Path {
        self.staged.path()
    }

    /// Replaces the output by the temporary folder. Files of the older output stay, except those named in `own`. The
    /// file `last` moves last: where it exists, all results do.
    ///
    /// # Errors
    /// The system refuses a move.
    pub fn take_place(&self, own: &[&str], last: &str) -> io::Result<()> {
        let _held = hold();
        if !self.inside {
            if !self.folder.exists() {
                return fs::rename(self.path(), &self.folder);
            }
            if self.exchange(own, last).is_ok() {
                return Ok(());
            }
        }
        self.one_by_one(own, last)
    }

    fn exchange(&self, own: &[&str], last: &str) -> io::Result<()> {
        let (new, old) = (fs::metadata(self.path())?, fs::metadata(&self.folder)?);
        if [new.uid(), new.gid()] != [old.uid(), old.gid()] || holds_working_directory(&self.folder) {
            return Err(io::ErrorKind::Unsupported.into());
        }
        bring_along(&self.folder, self.path(), &|name| name == last || own.iter().any(|own| name == *own))?;
        fs::set_permissions(self.path(), old.permissions())?;
        exchange(self.path(), &self.folder)
    }

    fn one_by_one(&self, own: &[&str], last: &str) -> io::Result<()> {
        let gone = own.iter().filter(|name| !self.path().join(name).exists());
        let list: Vec<&str> = std::iter::once(last).chain(gone.copied()).collect();
        fs::write(self.path().join(WHOLE), list.join("\n"))?;
        settle(self.path(), &self.folder)
    }
}

/// Moves the complete results `staged` into `folder`, as far as an earlier program has not.
fn settle(staged: &Path, folder: &Path) -> io::Result<()> {
    let list = fs::read_to_string(staged.join(WHOLE))?;
    let last = list.lines().next().unwrap_or_default();
    if staged.join(last).exists() {
        list.lines().try_for_each(|name| remove_file(&folder.join(name)))?;
        move_entries(staged, folder, &|name| name != last && name != WHOLE)?;
        fs::rename(staged.join(last), folder.join(last))?;
    }
    Ok(())
}

/// Makes the moves that a killed program left undone in `folder`.
///
/// # Errors
/// The system refuses a move.
pub fn finish(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let staged = entry.path();
        if is_unfinished(&entry.file_name()) && staged.join(WHOLE).exists() && is_left(&staged) {
            settle(&staged, folder)?;
            fs::remove_dir_all(&staged)?;
        }
    }
    Ok(())
}

/// Makes sure that `folder` takes files; makes a missing one.
///
/// # Errors
/// It does not.
pub fn writable(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    probe(Scratch::new_in(folder)?.path(), 0)
}

#[cfg(any(target_os = "linux", target_vendor = "apple"))]
fn exchange(new: &Path, old: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, new, CWD, old, RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_vendor = "apple")))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// The parent of the output; `None` where the output cannot be exchanged.
fn beside(folder: &Path) -> io::Result<Option<PathBuf>> {
    let Some(parent) = folder.parent() else { return Ok(None) };
    match fs::metadata(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Some(parent.to_owned())),
        Err(error) => Err(error),
        Ok(found) if !found.is_dir() => Err(io::Error::new(io::ErrorKind::NotADirectory, "this is not a folder")),
        Ok(found) => {
            let same = fs::metadata(parent)?.dev() == found.dev();
            Ok((same && !holds_working_directory(folder)).then(|| parent.to_owned()))
        }
    }
}

/// After an exchange the working directory would be the older folder, which is removed.
fn holds_working_directory(folder: &Path) -> bool {
    std::env::current_dir().is_ok_and(|current| current.starts_with(folder))
}

/// Makes sure that `folder` takes a file and that its file system has `room` bytes left.
fn probe(folder: &Path, room: u64) -> io::Result<()> {
    let mut file = tempfile::tempfile_in(folder)?;
    file.write_all(&[0; PROBE_BYTES])?;
    drop(file);
    let Ok(system) = rustix::fs::statvfs(folder) else { return Ok(()) };
    let free = system.f_bavail.saturating_mul(system.f_frsize);
    // Some file systems report no size.
    if system.f_blocks > 0 && free < room {
        let megabytes = |bytes: u64| bytes.div_ceil(1_000_000);
        let text = format!("there are {} MB left, results may take {} MB", megabytes(free), megabytes(room));
        return Err(io::Error::new(io::ErrorKind::StorageFull, text));
    }
    Ok(())
}

/// The missing parents of the output, which `make` creates. Dropping removes those that are still empty.
#[derive(Debug)]
struct Parents(Vec<PathBuf>);

impl Parents {
    fn make(folder: &Path) -> io::Result<Self> {
        let missing = folder.ancestors().skip(1).take_while(|parent| !parent.exists()).map(Path::to_owned).collect();
        let parents = Self(missing);
        if let Some(parent) = folder.parent() {
            fs::create_dir_all(parent)?;
        }
        Ok(parents)
    }
}

impl Drop for Parents {
    fn drop(&mut self) {
        for parent in &self.0 {
            // The system refuses to remove a folder that holds anything.
            let _ = fs::remove_dir(parent);
        }
    }
}

/// Hard-links the files of `from` into `to`, except existing ones and those that `left` names. A link copies and loses
/// nothing.
fn bring_along(from: &Path, to: &Path, left: &dyn Fn(&OsStr) -> bool) -> io::Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (name, target) = (entry.file_name(), to.join(entry.file_name()));
        if left(&name) || is_unfinished(&name) {
            continue;
        }
        if entry.file_type()?.is_dir() {
            if !target.is_dir() {
                fs::create_dir(&target)?;
                fs::set_permissions(&target, entry.metadata()?.permissions())?;
            }
            bring_along(&entry.path(), &target, &|_| false)?;
        } else if target.symlink_metadata().is_err() {
            fs::hard_link(entry.path(), target)?;
        }
    }
    Ok(())
}

fn move_entries(from: &Path, to: &Path, wanted: &dyn Fn(&OsStr) -> bool) -> io::Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if !wanted(&entry.file_name()) {
            continue;
        }
        if entry.file_type()?.is_dir() {
            fs::create_dir_all(&target)?;
            move_entries(&entry.path(), &target, &|_| true)?;
        } else {
            fs::rename(entry.path(), target)?;
        }
    }
    Ok(())
}

fn remove_file(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let name = |entry: io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(name).collect();
        names.sort();
        names
    }

    fn write(folder: &Path, files: &[&str]) -> io::Result<Staging> {
        let staging = Staging::open(folder, 0)?;
        fs::create_dir_all(staging.path().join("sub"))?;
        for file in files {
            fs::write(staging.path().join(file), "new")?;
        }
        Ok(staging)
    }

    #[test]
    fn files_appear_together_or_not_at_all() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("deep/run");
        drop(write(&folder, &["a", "last"]).unwrap());
        assert!(names(root.path()).is_empty(), "unfinished results leave nothing");
        write(&folder, &["a", "sub/c", "last"]).unwrap().take_place(&["a", "b"], "last").unwrap();
        fs::write(folder.join("notes"), "mine").unwrap();
        fs::create_dir(folder.join("old")).unwrap();
        fs::write(folder.join("old/notes"), "mine").unwrap();
        let before = fs::metadata(&folder).unwrap();
        drop(write(&folder, &["b", "last"]).unwrap());
        assert_eq!(names(&folder), ["a", "last", "notes", "old", "sub"]);
        write(&folder, &["b", "last"]).unwrap().take_place(&["a", "b"], "last").unwrap();
        assert_eq!(names(&folder), ["b", "last", "notes", "old", "sub"]);
        assert_eq!(fs::read_to_string(folder.join("old/notes")).unwrap(), "mine");
        assert_eq!(names(&folder.join("sub")), ["c"]);
        assert_eq!(fs::metadata(&folder).unwrap().permissions(), before.permissions());
        assert_eq!(names(&root.path().join("deep")), ["run"]);
    }

    #[test]
    fn an_output_that_cannot_be_exchanged_gets_its_files_one_by_one() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("run");
        write(&folder, &["a", "last"]).unwrap().take_place(&["a", "b"], "last").unwrap();
        fs::write(folder.join("notes"), "mine").unwrap();
        let staged = Scratch::new_in(&folder).unwrap();
        let staging = Staging { folder: folder.clone(), staged, inside: true, _parents: Parents(Vec::new()) };
        for file in ["b", "last"] {
            fs::write(staging.path().join(file), "new").unwrap();
        }
        staging.take_place(&["a", "b"], "last").unwrap();
        drop(staging);
        assert_eq!(names(&folder), ["b", "last", "notes", "sub"]);
    }

    #[test]
    fn moves_that_a_kill_interrupted_are_finished() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("run");
        // Killed after any number of moves.
        for done in 0..4 {
            let _ = fs::remove_dir_all(&folder);
            let staged = folder.join(".misclosure-x");
            fs::create_dir_all(&staged).unwrap();
            fs::write(folder.join("old"), "").unwrap();
            fs::write(staged.join(WHOLE), "last\nold").unwrap();
            for (k, name) in ["a", "b", "last"].iter().enumerate() {
                let to = if k < done { &folder } else { &staged };
                fs::write(to.join(name), "new").unwrap();
            }
            if done > 0 {
                fs::remove_file(folder.join("old")).unwrap();
            }
            finish(&folder).unwrap();
            assert_eq!(names(&folder), ["a", "b", "last"], "{done}");
        }
    }

    #[test]
    fn a_place_that_refuses_files_is_refused_at_once() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("file"), "").unwrap();
        for path in ["file", "file/run"] {
            assert!(Staging::open(&root.path().join(path), 0).is_err(), "{path}");
        }
        let error = Staging::open(&root.path().join("run"), u64::MAX).unwrap_err();
        assert!(error.to_string().contains("MB left, results may take"), "{error}");
        assert_eq!(names(root.path()), ["file"]);
    }
}
