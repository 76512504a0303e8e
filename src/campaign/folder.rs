//! The folder of a campaign. Every file in it appears whole or not at all.
//!
//! ```text
//! grid.toml  cases.jsonl  files/       the plan: it never changes
//! results/ab/ab12....json              one outcome a case
//! failures/ab/ab12....1.json           why an attempt failed
//! leases/ab/ab12....1                  who is at work
//! ```

use super::grid::{Grid, Planned};
use super::lease::{self, Lease};
use super::{Case, Outcome};
use crate::files::read_text;
use crate::io::write_atomically;
use anyhow::{Context, Result, bail, ensure};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashSet};
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Attempts at a case that fails.
pub const MOST_ATTEMPTS: usize = 3;
/// Workers that may die over a case before it is taken for the reason.
pub const MOST_DEATHS: usize = 10;
/// In the place of the generation of a failure: the case is worked no more.
const GIVEN_UP: usize = 0;
const CASES: &str = "cases.jsonl";
const GRID: &str = "grid.toml";
const FILES: &str = "files";
const RESULTS: &str = "results";
const FAILURES: &str = "failures";
const LEASES: &str = "leases";
/// Changes with the meaning of a result.
const FORMAT: u32 = 1;
/// Characters of an id that name its folder: a folder of a hundred thousand files is slow on some file systems.
const OF_FOLDER: usize = 2;

/// A planned campaign.
#[derive(Debug)]
pub struct Folder {
    root: PathBuf,
    /// Its cases, in the order of the plan.
    pub cases: Vec<Planned>,
}

#[derive(Serialize, Deserialize)]
struct Kept {
    format: u32,
    id: String,
    outcome: Outcome,
}

#[derive(Serialize, Deserialize)]
struct Failed {
    format: u32,
    id: String,
    reason: String,
}

/// How a case stands.
#[derive(Debug, Clone, PartialEq)]
pub enum State {
    /// Finished.
    Done,
    /// Given up, with the last reason.
    Failed(String),
    /// Somebody has it, or died over it.
    Taken,
    /// Nobody had it.
    Open,
}

impl Folder {
    /// Plans the campaign of a grid's file in a new folder.
    ///
    /// # Errors
    /// A grid, a case or a file of one that cannot be used; a folder that is not empty.
    pub fn plan(grid_file: &Path, root: &Path) -> Result<(Self, Grid)> {
        let grid = super::grid::read(grid_file)?;
        let mut cases = grid.cases().with_context(|| format!("{}", grid_file.display()))?;
        let beside = grid_file.parent().unwrap_or(Path::new(""));
        let mut files: BTreeMap<String, PathBuf> = BTreeMap::new();
        for case in &mut cases {
            let Some(path) = Case::path_of(&mut case.case) else { continue };
            let source = beside.join(&*path);
            let name =
                source.file_name().context("a case names a folder without a name")?.to_string_lossy().into_owned();
            *path = format!("{FILES}/{name}");
            let before = files.entry(name).or_insert_with(|| source.clone());
            ensure!(*before == source, "{} and {} have one name", before.display(), source.display());
        }
        for planned in &cases {
            Case::new(&planned.case, root)
                .with_context(|| format!("{}: case {:?}", grid_file.display(), planned.factors))?;
        }
        let is_empty = fs::read_dir(root).map_or(true, |mut entries| entries.next().is_none());
        ensure!(is_empty, "{}: a campaign needs a new folder or an empty one", root.display());
        for (name, source) in files {
            copy(&source, &root.join(FILES).join(name))?;
        }
        fs::create_dir_all(root).with_context(|| format!("{}: cannot be made", root.display()))?;
        fs::copy(grid_file, root.join(GRID)).with_context(|| format!("{}", root.join(GRID).display()))?;
        let mut text = String::new();
        for case in &cases {
            text += &serde_json::to_string(case)?;
            text.push('\n');
        }
        // With it the campaign is planned.
        write_atomically(&root.join(CASES), text.as_bytes())?;
        Ok((Self { root: root.to_owned(), cases }, grid))
    }

    /// Opens a planned campaign.
    ///
    /// # Errors
    /// A folder that holds none.
    pub fn open(root: &Path) -> Result<Self> {
        let path = root.join(CASES);
        if !path.exists() {
            bail!("{}: this is no campaign: it has no {CASES} (misclosure campaign plan makes one)", root.display());
        }
        let text = read_text(&path).with_context(|| format!("{}", path.display()))?;
        let lines: Vec<&str> = text.lines().collect();
        let case = |(line, text): (usize, &&str)| {
            serde_json::from_str(text).with_context(|| format!("{}:{}: no case", path.display(), line + 1))
        };
        let cases = lines.par_iter().enumerate().map(case).collect::<Result<_>>()?;
        Ok(Self { root: root.to_owned(), cases })
    }

    /// Its path.
    pub fn root(&self) -> &Path {
        &self.root
    }

    fn place(&self, of: &str, id: &str) -> PathBuf {
        self.root.join(of).join(&id[..OF_FOLDER.min(id.len())])
    }

    fn result(&self, id: &str) -> PathBuf {
        self.place(RESULTS, id).join(format!("{id}.json"))
    }

    /// Is a case finished?
    pub fn is_done(&self, id: &str) -> bool {
        self.result(id).exists()
    }

    /// Folder of the leases of a case.
    pub(super) fn leases(&self, id: &str) -> PathBuf {
        self.place(LEASES, id)
    }

    /// Takes a generation of a case's lease; `None`: somebody has it.
    ///
    /// # Errors
    /// A folder that takes no file.
    pub(super) fn claim(&self, id: &str, generation: usize) -> Result<Option<Lease>> {
        let leases = self.leases(id);
        fs::create_dir_all(&leases).with_context(|| format!("{}: cannot be made", leases.display()))?;
        lease::claim(&leases, id, generation)
    }

    /// Attempts at a case that failed.
    pub(super) fn attempts(&self, id: &str) -> usize {
        let of_case = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with(&format!("{id}."));
        fs::read_dir(self.place(FAILURES, id)).map_or(0, |all| all.flatten().filter(of_case).count())
    }

    /// Is a case worked no more?
    pub(super) fn is_given_up(&self, id: &str) -> bool {
        self.has_failed(id, GIVEN_UP) || self.attempts(id) >= MOST_ATTEMPTS
    }

    /// Did the attempt of a generation fail?
    pub(super) fn has_failed(&self, id: &str, generation: usize) -> bool {
        self.failure(id, generation).exists()
    }

    fn failure(&self, id: &str, generation: usize) -> PathBuf {
        self.place(FAILURES, id).join(format!("{id}.{generation}.json"))
    }

    /// Keeps what a case gave, and gives its lease back.
    ///
    /// # Errors
    /// A folder that takes no file: nothing was kept.
    pub(super) fn finish(&self, id: &str, lease: &Lease, outcome: Outcome) -> Result<()> {
        let kept = Kept { format: FORMAT, id: id.into(), outcome };
        put(&lease.part(), &self.result(id), &serde_json::to_vec(&kept)?)?;
        lease::release(&self.leases(id), id, lease.generation);
        Ok(())
    }

    /// Keeps why an attempt failed.
    ///
    /// # Errors
    /// See [`Self::finish`].
    pub(super) fn fail(&self, id: &str, lease: &Lease, reason: String) -> Result<()> {
        self.note(id, lease, lease.generation, reason)
    }

    /// Keeps why a case is worked no more.
    ///
    /// # Errors
    /// See [`Self::finish`].
    pub(super) fn give_up(&self, id: &str, lease: &Lease, reason: String) -> Result<()> {
        self.note(id, lease, GIVEN_UP, reason)
    }

    fn note(&self, id: &str, lease: &Lease, generation: usize, reason: String) -> Result<()> {
        let failed = Failed { format: FORMAT, id: id.into(), reason };
        put(&lease.part(), &self.failure(id, generation), &serde_json::to_vec(&failed)?)
    }

    /// Forgets failed attempts and leases: what was given up may be worked again. Nobody may be at work.
    ///
    /// # Errors
    /// A folder that cannot be removed.
    pub fn forget_failures(&self) -> Result<()> {
        for folder in [FAILURES, LEASES].map(|name| self.root.join(name)).iter().filter(|folder| folder.exists()) {
            fs::remove_dir_all(folder).with_context(|| format!("{}: cannot be removed", folder.display()))?;
        }
        Ok(())
    }

    /// What a finished case gave; `None` where it is not finished.
    ///
    /// # Errors
    /// A file that is no result.
    pub fn outcome(&self, id: &str) -> Result<Option<Outcome>> {
        let path = self.result(id);
        if !path.exists() {
            return Ok(None);
        }
        let kept: Kept = serde_json::from_slice(&crate::files::read(&path)?)
            .with_context(|| format!("{}: no result of this program", path.display()))?;
        ensure!(kept.format == FORMAT && kept.id == id, "{}: the result of another case", path.display());
        Ok(Some(kept.outcome))
    }

    /// How every case stands, in the order of the plan.
    ///
    /// # Errors
    /// A failure that cannot be read.
    pub fn states(&self) -> Result<Vec<State>> {
        let [done, failures, leases] = [RESULTS, FAILURES, LEASES].map(|name| names(&self.root.join(name)));
        let done: HashSet<String> = done.into_iter().collect();
        let taken: HashSet<&str> = leases.iter().filter_map(|name| name.split('.').next()).collect();
        let mut failed: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for name in &failures {
            let mut parts = name.split('.');
            let (Some(id), Some(Ok(generation))) = (parts.next(), parts.next().map(str::parse)) else { continue };
            failed.entry(id).or_default().push(generation);
        }
        let state = |case: &Planned| {
            let id = case.id.as_str();
            let attempts = failed.get(id);
            if done.contains(&format!("{id}.json")) {
                return Ok(State::Done);
            }
            let given_up = |own: &&Vec<usize>| own.contains(&GIVEN_UP) || own.len() >= MOST_ATTEMPTS;
            if let Some(last) = attempts.filter(given_up).and_then(|own| own.iter().max()) {
                let path = self.failure(id, *last);
                let failed: Failed = serde_json::from_slice(&crate::files::read(&path)?)
                    .with_context(|| format!("{}: no failure of this program", path.display()))?;
                return Ok(State::Failed(failed.reason));
            }
            Ok(if attempts.is_some() || taken.contains(id) { State::Taken } else { State::Open })
        };
        self.cases.iter().map(state).collect()
    }
}

/// Names of the files in the folders of a folder.
fn names(folder: &Path) -> Vec<String> {
    let folders: Vec<fs::DirEntry> = fs::read_dir(folder).into_iter().flatten().flatten().collect();
    let of_one = |entry: &fs::DirEntry| {
        let files = fs::read_dir(entry.path()).into_iter().flatten().flatten();
        files.map(|file| file.file_name().to_string_lossy().into_owned()).collect::<Vec<_>>()
    };
    folders.par_iter().flat_map_iter(of_one).collect()
}

/// Puts a file in its place: written under the name `part`, on the disk, then renamed.
fn put(part: &Path, place: &Path, bytes: &[u8]) -> Result<()> {
    let cannot = || format!("{}: cannot write", place.display());
    let folder = place.parent().context("a result lies in a folder")?;
    fs::create_dir_all(folder).with_context(cannot)?;
    let written = File::create(part).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    if let Err(error) = written {
        let _ = fs::remove_file(part);
        return Err(error).with_context(cannot);
    }
    fs::rename(part, place).with_context(cannot)?;
    // The name, too, outlives a loss of power, where the file system can say so.
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
    Ok(())
}

fn copy(source: &Path, to: &Path) -> Result<()> {
    let cannot = || format!("{}: cannot be copied", source.display());
    if !source.is_dir() {
        fs::create_dir_all(to.parent().unwrap_or(to)).with_context(cannot)?;
        return fs::copy(source, to).map(drop).with_context(cannot);
    }
    fs::create_dir_all(to).with_context(cannot)?;
    for name in crate::files::OF_BLOCK.iter().filter(|name| source.join(name).is_file()) {
        fs::copy(source.join(name), to.join(name)).with_context(cannot)?;
    }
    let truth = source.join("truth");
    if truth.is_dir() { copy(&truth, &to.join("truth")) } else { Ok(()) }
}
