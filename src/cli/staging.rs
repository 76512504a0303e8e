//! Results on their way: written into a folder of their own, which takes the place of the output when all of them are there.
//!
//! It lies beside the output. A new output is there by one rename. One that is there already is exchanged with the new one, by one call
//! of the system: whoever looks, or kills the program, finds one complete folder, the older or the newer. Files that are not of a run come along.
//!
//! Some outputs cannot be exchanged: where something is mounted, the working directory, a folder of another user, or a file system without
//! such a call. There the results lie inside the output and take their names one by one; who kills the program then leaves a list of what
//! is still to be done, and the next command does it ([`finish`]).
//!
//! What a killed program leaves of this, the next command that writes there removes: [`crate::files::scratch`].

use crate::files::scratch::{Scratch, is_left, is_unfinished};
use std::ffi::OsStr;
use std::fs;
use std::io::{self, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// In a folder of results that are whole and take their names one by one: which files of an older run go, the last one first.
const WHOLE: &str = ".whole";
/// Written where results will be, and removed: a folder may be there and not take a file.
const PROBE_BYTES: usize = 1 << 16;
/// A folder for results, and where they will be.
#[derive(Debug)]
pub struct Staging {
    folder: PathBuf,
    staged: Scratch,
    inside: bool,
    // Behind the folder in it: dropped later.
    _parents: Parents,
}

impl Staging {
    /// For results of `room` bytes in `folder`, a path without links and `..`, which need not be there.
    ///
    /// # Errors
    /// A place that cannot be written to, or has less room.
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
            // It gives its place to the new one, but is not to be replaced where it may not be written.
            tempfile::tempfile_in(folder)?;
        }
        Ok(Self { folder: folder.to_owned(), staged, inside, _parents: parents })
    }

    /// Where results are written.
    pub fn path(&self) -> &Path {
        self.staged.path()
    }

    /// Gives what was written its place. Of an older folder the files `own` that were not written again go, others stay; where `last` is,
    /// everything is.
    ///
    /// # Errors
    /// What the system refuses.
    pub fn take_place(&self, own: &[&str], last: &str) -> io::Result<()> {
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

/// Gives the whole results `staged` their names in `folder`.
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

/// Goes on where a program was killed while its results took their names in `folder`.
///
/// # Errors
/// What the system refuses.
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

/// Makes sure that files can be written into `folder`, which is made where it is missing.
///
/// # Errors
/// Why not.
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

/// The folder that the output lies in, where the output can give its place to another; `None` where not.
fn beside(folder: &Path) -> io::Result<Option<PathBuf>> {
    let Some(parent) = folder.parent() else { return Ok(None) };
    match fs::metadata(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Some(parent.to_owned())),
        Err(error) => Err(error),
        Ok(found) if !found.is_dir() => Err(io::Error::new(io::ErrorKind::NotADirectory, "this is no folder")),
        Ok(found) => {
            let same = fs::metadata(parent)?.dev() == found.dev();
            Ok((same && !holds_working_directory(folder)).then(|| parent.to_owned()))
        }
    }
}

/// Whoever stands in a folder would stand in the old one after an exchange.
fn holds_working_directory(folder: &Path) -> bool {
    std::env::current_dir().is_ok_and(|current| current.starts_with(folder))
}

/// Can `room` bytes be written into `folder`?
fn probe(folder: &Path, room: u64) -> io::Result<()> {
    let mut file = tempfile::tempfile_in(folder)?;
    file.write_all(&[0; PROBE_BYTES])?;
    drop(file);
    let Ok(system) = rustix::fs::statvfs(folder) else { return Ok(()) };
    let free = system.f_bavail.saturating_mul(system.f_frsize);
    // Some file systems do not tell their size.
    if system.f_blocks > 0 && free < room {
        let megabytes = |bytes: u64| bytes.div_ceil(1_000_000);
        let text = format!("there are {} MB left, results may take {} MB", megabytes(free), megabytes(room));
        return Err(io::Error::new(io::ErrorKind::StorageFull, text));
    }
    Ok(())
}

/// Folders above the output that were made for it; they go again where nothing was put into them.
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
            // Only an empty one goes.
            let _ = fs::remove_dir(parent);
        }
    }
}

/// Links everything of `from` into `to` that is not there and not to be `left`: hard links, so that nothing is copied and nothing lost.
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
        assert!(names(root.path()).is_empty(), "what was not finished leaves nothing");
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
    fn what_cannot_be_exchanged_is_moved_file_by_file() {
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
    fn what_a_kill_interrupts_is_gone_on_with() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("run");
        // Killed after any number of the names.
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
    fn a_place_that_takes_nothing_is_refused_at_once() {
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
