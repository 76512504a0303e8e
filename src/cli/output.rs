//! Where a command may write, and how: never over measurements, and whole or not at all.
//!
//! A folder that is a block, lies in one or holds the block that is read is no place for results, by whatever path it is named. Results are
//! written into a folder of their own inside the output, and take their names when all of them are there: what fails on the way leaves an older
//! run as it was.

use super::Usage;
use crate::block::Block;
use crate::io::block::{is_block, read_block};
use crate::run::folder::{FILES, SUMMARY};
use anyhow::Context;
use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// Begins the name of a folder whose files have not taken their names yet.
const UNFINISHED: &str = ".misclosure-";

/// A folder with one of these is a run, whole or begun.
const RUN_MARKS: [&str; 2] = ["model.toml", SUMMARY];
/// What an adjustment that failed leaves, without a mark of a run.
const LEFT_BY_A_FAILURE: [&str; 1] = ["residuals.csv"];

/// A folder for results that was found to be a place for them.
#[derive(Debug)]
pub struct Output {
    folder: PathBuf,
}

impl Output {
    /// For a run: its folder may be there, with an older run in it, or with files that no run has.
    ///
    /// # Errors
    /// A folder where measurements could be lost: also one with tables of a run's names that are of none.
    pub fn of_run(folder: &Path, block: &Path) -> Result<Self, Usage> {
        beside_blocks(folder, Some(block))?;
        let has = |name: &str| folder.join(name).exists();
        let is_run = RUN_MARKS.iter().any(|name| has(name));
        if let Some(name) = FILES.iter().find(|name| !is_run && !LEFT_BY_A_FAILURE.contains(name) && has(name)) {
            return Err(refused(folder, &format!("holds a {name} that is of no run; name another folder")));
        }
        Ok(Self { folder: folder.to_owned() })
    }

    /// For a block: a new folder, or an empty one.
    ///
    /// # Errors
    /// As [`Self::of_run`], and any other folder.
    pub fn of_block(folder: &Path, from: Option<&Path>) -> Result<Self, Usage> {
        beside_blocks(folder, from)?;
        let unreadable = |error: io::Error| Usage(format!("{}: cannot read: {error}", folder.display()));
        match fs::read_dir(folder) {
            Ok(mut entries) => match entries.next() {
                Some(_) => Err(refused(folder, "is not empty; a block needs a new folder or an empty one")),
                None => Ok(Self { folder: folder.to_owned() }),
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Self { folder: folder.to_owned() }),
            Err(error) => Err(unreadable(error)),
        }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Has `work` write files into a folder that it is given; they move to the output when it is done, the file `last` at the end: where it is,
    /// everything is. Of an older run the files `own` that are not written again are removed. Gives what `work` gives.
    ///
    /// # Errors
    /// Those of `work`, and what cannot be written; until the files move, the output is as it was.
    pub fn write<T>(
        &self,
        own: &[&str],
        last: &str,
        work: impl FnOnce(&Path) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let new = !self.folder.exists();
        let written = self.stage(work).and_then(|(staged, made)| self.take(staged.path(), own, last).map(|()| made));
        if new && written.is_err() {
            // Only an empty one goes.
            let _ = fs::remove_dir(&self.folder);
        }
        written
    }

    fn stage<T>(&self, work: impl FnOnce(&Path) -> anyhow::Result<T>) -> anyhow::Result<(tempfile::TempDir, T)> {
        let cannot = || format!("{}: cannot write", self.folder.display());
        fs::create_dir_all(&self.folder).with_context(cannot)?;
        for entry in fs::read_dir(&self.folder).with_context(cannot)?.flatten() {
            // Of a program that was killed.
            if entry.file_name().to_string_lossy().starts_with(UNFINISHED) {
                fs::remove_dir_all(entry.path()).with_context(cannot)?;
            }
        }
        let staged = tempfile::Builder::new().prefix(UNFINISHED).tempdir_in(&self.folder).with_context(cannot)?;
        let made = work(staged.path())?;
        Ok((staged, made))
    }

    fn take(&self, staged: &Path, own: &[&str], last: &str) -> anyhow::Result<()> {
        let cannot = || format!("{}: cannot write", self.folder.display());
        remove_file(&self.folder.join(last)).with_context(cannot)?;
        for name in own.iter().filter(|name| !staged.join(name).exists()) {
            remove_file(&self.folder.join(name)).with_context(cannot)?;
        }
        move_entries(staged, &self.folder, &|name| name != last).with_context(cannot)?;
        fs::rename(staged.join(last), self.folder.join(last)).with_context(cannot)
    }
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

/// Refuses a folder for results that is a block, lies in a block or holds the block `read`.
///
/// # Errors
/// Says which, and what to do.
pub fn beside_blocks(folder: &Path, read: Option<&Path>) -> Result<(), Usage> {
    let target = resolved(folder);
    if is_block(&target) {
        return Err(refused(folder, "is a block, whose measurements would be lost; name another folder"));
    }
    if let Some(block) = target.ancestors().skip(1).find(|ancestor| is_block(ancestor)) {
        let what = format!("lies in the block {}; name a folder outside of it", block.display());
        return Err(refused(folder, &what));
    }
    match read.map(resolved) {
        Some(block) if block.starts_with(&target) => {
            Err(refused(folder, "holds the block that is read; name another folder"))
        }
        _ => Ok(()),
    }
}

/// A block that was just written, read again; refuses one that no command could read: what was asked for does not make one.
///
/// # Errors
/// What is wrong with it.
pub fn usable(block: &Path) -> anyhow::Result<Block> {
    read_block(block).map(|loaded| loaded.block).context("what was asked for makes no block that could be adjusted")
}

fn refused(folder: &Path, what: &str) -> Usage {
    Usage(format!("output {}: {what}", folder.display()))
}

/// The path without links and `..`, as far as it exists; the rest as it would be made.
fn resolved(path: &Path) -> PathBuf {
    let mut all = std::env::current_dir().unwrap_or_default();
    for component in path.components() {
        match component {
            Component::ParentDir => {
                all.pop();
            }
            Component::CurDir => {}
            other => all.push(other),
        }
        // Before the next `..`, which goes up from where a link leads.
        if let Ok(real) = all.canonicalize() {
            all = real;
        }
    }
    all
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

    #[test]
    fn folders_where_measurements_could_be_lost_are_refused() {
        let root = tempfile::tempdir().unwrap();
        let block = root.path().join("site/block");
        fs::create_dir_all(block.join("truth")).unwrap();
        fs::write(block.join("block.toml"), "").unwrap();
        std::os::unix::fs::symlink(&block, root.path().join("link")).unwrap();
        std::os::unix::fs::symlink(root.path().join("site"), root.path().join("site-link")).unwrap();
        let at = |path: &str| root.path().join(path);
        for (path, what) in [
            ("site/block", "is a block"),
            ("site/block/", "is a block"),
            ("link", "is a block"),
            ("site/../link", "is a block"),
            ("new/../site/block", "is a block"),
            ("site-link/block", "is a block"),
            ("link/../block", "is a block"),
            ("site/block/run", "lies in the block"),
            ("link/truth", "lies in the block"),
            ("site", "holds the block"),
            ("site-link", "holds the block"),
            (".", "holds the block"),
        ] {
            let error = Output::of_run(&at(path), &block).unwrap_err();
            assert!(error.0.contains(what), "{path}: {error}");
            assert!(Output::of_block(&at(path), Some(&block)).is_err(), "{path}");
        }
        Output::of_run(&at("site/run"), &block).unwrap();
        Output::of_run(&at("link-run"), &at("link")).unwrap();
        fs::create_dir(at("notes")).unwrap();
        Output::of_block(&at("notes"), None).unwrap();
        fs::write(at("notes/a.txt"), "").unwrap();
        assert!(Output::of_block(&at("notes"), None).unwrap_err().0.contains("is not empty"));
        Output::of_run(&at("notes"), &block).unwrap();
        // Somebody's own tables, without a block.toml or before it is written.
        fs::write(at("notes/points.csv"), "").unwrap();
        assert!(Output::of_run(&at("notes"), &block).unwrap_err().0.contains("holds a points.csv that is of no run"));
        fs::write(at("notes/summary.json"), "").unwrap();
        Output::of_run(&at("notes"), &block).unwrap();
    }

    #[test]
    fn files_appear_together_or_not_at_all() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("run");
        let output = Output { folder: folder.clone() };
        let write = |files: &'static [&'static str], fails: bool| {
            output.write(&["a", "b"], "last", |staged| {
                fs::create_dir(staged.join("sub"))?;
                for file in files {
                    fs::write(staged.join(file), "new")?;
                }
                if fails { anyhow::bail!("no space") } else { Ok(()) }
            })
        };
        assert_eq!(write(&["a", "last"], true).unwrap_err().to_string(), "no space");
        assert!(!folder.exists());
        write(&["a", "sub/c", "last"], false).unwrap();
        fs::write(folder.join("notes"), "").unwrap();
        assert_eq!(names(&folder), ["a", "last", "notes", "sub"]);
        assert_eq!(write(&["b", "last"], true).unwrap_err().to_string(), "no space");
        assert_eq!(names(&folder), ["a", "last", "notes", "sub"]);
        // What a killed program left.
        fs::create_dir(folder.join(format!("{UNFINISHED}x"))).unwrap();
        write(&["b", "sub/c", "last"], false).unwrap();
        assert_eq!(names(&folder), ["b", "last", "notes", "sub"]);
    }
}
