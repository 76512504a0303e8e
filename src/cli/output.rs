//! Where a command may write: never over measurements, and complete results or none.
//!
//! A command refuses an output that is a block, lies in a block or holds the block that it reads, whatever path names
//! it. It also refuses a laboratory, and a folder with files that are named like those of a run but belong to none.
//! Before it computes anything, it checks that the output takes files and has room for them. How results get there:
//! [`super::staging`].

use super::staging::{self, Staging};
use super::{Console, Usage};
use crate::block::Block;
use crate::files::scratch::is_unfinished;
use crate::io::block::{is_block, read_block};
use crate::run::folder::{FILES, REPORT, SUMMARY, is_laboratory, is_run, left_by_a_failure};
use anyhow::Context;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// Bytes of a report, its pictures and `diagnosis.json`, at most: ten runs had 0.2 to 1.5 MB.
const PAGE_BYTES: u64 = 8 << 20;
/// Bytes of a run's tables per byte of the block's, at most. Measured: 2.5 for two blocks of UAVs (72,000 and 60,000
/// tie measurements), 3.0 to 3.6 for three dikes. Two mapping blocks had 3.5 and 3.6, three of close range 2.6 to 3.5.
const RUN_PER_BLOCK: u64 = 4;

/// An output that a command may write to.
#[derive(Debug)]
pub struct Output {
    folder: PathBuf,
    staging: Staging,
}

impl Output {
    /// For a run. An existing folder may hold an older run, and files that no run has.
    ///
    /// # Errors A folder where measurements could be lost, or files that are named like those of a run but belong to
    /// none. A folder that refuses files.
    pub fn of_run(folder: &Path, block: &Path) -> anyhow::Result<Self> {
        run_may_replace(folder, block)?;
        Self::open(folder, PAGE_BYTES + RUN_PER_BLOCK * table_bytes(block))
    }

    /// For a block: a new folder, or an empty one.
    ///
    /// # Errors
    /// As [`Self::of_run`], and any other folder.
    pub fn of_block(folder: &Path, from: Option<&Path>) -> anyhow::Result<Self> {
        beside_blocks(folder, from)?;
        outside_laboratories(folder, resolved(folder).ancestors())?;
        let unreadable = |error: io::Error| Usage(format!("{}: cannot read: {error}", folder.display()));
        match fs::read_dir(folder) {
            Ok(entries) => {
                // Temporary folders of killed programs belong to nobody.
                if entries.flatten().any(|entry| !is_unfinished(&entry.file_name())) {
                    return Err(refused(folder, "is not empty; a block needs a new folder or an empty one").into());
                }
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(unreadable(error).into()),
        }
        Self::open(folder, from.map_or(0, table_bytes))
    }

    /// For new tables of an existing block, whose other tables stay.
    ///
    /// # Errors
    /// A block that refuses files.
    pub fn into_block(folder: &Path) -> anyhow::Result<Self> {
        staging::finish(&resolved(folder)).with_context(|| cannot_write(folder))?;
        Self::open(folder, table_bytes(folder))
    }

    fn open(folder: &Path, room: u64) -> anyhow::Result<Self> {
        let staging = Staging::open(&resolved(folder), room).with_context(|| cannot_write(folder))?;
        Ok(Self { folder: folder.to_owned(), staging })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Says that an older run in the folder is about to be replaced; scripts rely on it that it is.
    pub fn tell_replaced(&self, console: &Console) {
        if is_run(&resolved(&self.folder)) {
            console.message(&format!("{}: replaces the run that is there", self.folder.display()));
        }
    }

    /// Has `work` write files into a temporary folder, which then replaces the output: where the file `last` exists,
    /// all files do. The files `own` of an older run are removed, others stay. Returns the result of `work`.
    ///
    /// # Errors
    /// Those of `work`, and a refused write. The output is then as it was.
    pub fn write<T>(
        &self,
        own: &[&str],
        last: &str,
        work: impl FnOnce(&Path) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let made = work(self.staging.path())?;
        self.staging.take_place(own, last).with_context(|| cannot_write(&self.folder))?;
        Ok(made)
    }
}

fn cannot_write(folder: &Path) -> String {
    format!("output {}: cannot write", folder.display())
}

/// Refuses a folder that a run may not replace.
fn run_may_replace(folder: &Path, block: &Path) -> Result<(), Usage> {
    beside_blocks(folder, Some(block))?;
    let target = resolved(folder);
    outside_laboratories(folder, target.ancestors())?;
    staging::finish(&target).map_err(|error| Usage(format!("{}: {error}", cannot_write(folder))))?;
    if is_run(&target) || left_by_a_failure(&target) {
        return Ok(());
    }
    match FILES.iter().chain([&REPORT, &SUMMARY]).find(|name| target.join(name).exists()) {
        Some(name) => Err(refused(folder, &format!("holds a {name} that is of no run; name another folder"))),
        None => Ok(()),
    }
}

/// Makes sure, before anything is computed, that a folder takes files; for results that are neither a run nor a block.
///
/// # Errors
/// It does not; and as [`beside_blocks`].
pub fn writable_beside_blocks(folder: &Path, read: Option<&Path>) -> anyhow::Result<()> {
    beside_blocks(folder, read)?;
    outside_laboratories(folder, resolved(folder).ancestors())?;
    staging::writable(folder).with_context(|| cannot_write(folder))
}

/// Bytes of the files in a folder.
fn table_bytes(source: &Path) -> u64 {
    let entries = fs::read_dir(source).into_iter().flatten().flatten();
    let files = entries.filter_map(|entry| entry.metadata().ok()).filter(fs::Metadata::is_file);
    files.map(|file| file.len()).sum()
}

/// Refuses an output that is a block, lies in a block or holds the block `read`.
///
/// # Errors
/// Says which of these, and what to do.
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

/// Refuses a folder in a laboratory, whose steps never change.
fn outside_laboratories<'a>(folder: &Path, mut places: impl Iterator<Item = &'a Path>) -> Result<(), Usage> {
    match places.find(|place| is_laboratory(place)) {
        Some(lab) => {
            let what =
                format!("lies in the laboratory {}, whose steps never change; name another folder", lab.display());
            Err(refused(folder, &what))
        }
        None => Ok(()),
    }
}

/// Refuses a folder that cannot become a laboratory: as [`beside_blocks`], the folder of a run, and one in another
/// laboratory.
///
/// # Errors
/// Says which, and what to do.
#[cfg(feature = "lab")]
pub fn may_be_laboratory(folder: &Path, block: Option<&Path>) -> Result<(), Usage> {
    beside_blocks(folder, block)?;
    let target = resolved(folder);
    outside_laboratories(folder, target.ancestors().skip(1))?;
    if is_run(&target) {
        return Err(refused(folder, "is the folder of a run; name another folder"));
    }
    Ok(())
}

/// Reads a block that was just written, and refuses one that no command could read.
///
/// # Errors
/// What is wrong with the block.
pub fn usable(block: &Path) -> anyhow::Result<Block> {
    read_block(block).map(|loaded| loaded.block).context("these options make no block that can be adjusted")
}

fn refused(folder: &Path, what: &str) -> Usage {
    Usage(format!("output {}: {what}", folder.display()))
}

/// The path without links and `..`, as far as it exists; the rest as the program would make it.
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
        // At each step: the next `..` goes up from the target of a link.
        if let Ok(real) = all.canonicalize() {
            all = real;
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

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
            assert!(error.to_string().contains(what), "{path}: {error}");
            assert!(Output::of_block(&at(path), Some(&block)).is_err(), "{path}");
        }
        Output::of_run(&at("site/run"), &block).unwrap();
        Output::of_run(&at("link-run"), &at("link")).unwrap();
        fs::create_dir(at("notes")).unwrap();
        Output::of_block(&at("notes"), None).unwrap();
        fs::write(at("notes/a.txt"), "").unwrap();
        assert!(Output::of_block(&at("notes"), None).unwrap_err().to_string().contains("is not empty"));
        Output::of_run(&at("notes"), &block).unwrap();
        for name in ["points.csv", "model.toml", "summary.json", "residuals.csv", "report.html"] {
            fs::write(at("notes").join(name), "mine").unwrap();
            let error = Output::of_run(&at("notes"), &block).unwrap_err().to_string();
            let of_none = format!("holds a {name} that is of no run");
            assert!(error.contains(&of_none), "{error}");
            fs::remove_file(at("notes").join(name)).unwrap();
        }
        fs::write(at("notes/residuals.csv"), "image,point,kind,x,y,rx,ry,sigma\n").unwrap();
        Output::of_run(&at("notes"), &block).unwrap();
        fs::write(at("notes/summary.json"), r#"{"format": 1, "solvers": {}}"#).unwrap();
        fs::write(at("notes/points.csv"), "").unwrap();
        Output::of_run(&at("notes"), &block).unwrap();
    }
}
