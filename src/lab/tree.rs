//! The folder of a laboratory: one folder per step, each the complete folder of a run and a `step.json`. A step is
//! never changed. It is written under another name and renamed when it is complete: who kills the program loses the
//! step in progress and nothing else.

use super::change::Change;
use crate::io::table::write_json;
use crate::mistakes::Mistake;
use crate::run::folder::{is_run, read_laboratory, read_source, write_laboratory};
use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Version of `step.json`.
const FORMAT: u32 = 1;
/// What a step is, beside its run.
const STEP: &str = "step.json";
/// Begins the name of a step that is not complete.
const UNFINISHED: &str = ".step-";
/// Begins the name of a step.
const FINISHED: &str = "step-";
/// Begins the name of a block that was measured here.
const MEASURED: &str = "measured-";

/// The figures of a step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Per coordinate, px.
    pub tie_rms_px: Option<f64>,
    /// Of predictions of left-out measurements, px.
    pub heldout_px: Option<f64>,
    /// 3D, m.
    pub check_rms_m: Option<f64>,
    /// In height, m.
    pub check_height_rms_m: Option<f64>,
    /// Of the GNSS positions, 3D, m.
    #[serde(default)]
    pub gnss_rms_m: Option<f64>,
    /// `sqrt(v'Pv / redundancy)`.
    pub sigma0: Option<f64>,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Number of observations.
    pub observations: usize,
    /// Measurements that were set aside.
    pub outliers: usize,
}

/// `step.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// Version.
    pub format: u32,
    /// The step that it changed; none for a root.
    pub parent: Option<u32>,
    /// What it changed.
    pub change: Change,
    /// The same in words.
    pub words: String,
    /// Its figures.
    pub figures: Figures,
    /// `missing`, `unexplained`, `adequate` or `mistake`.
    pub verdict: String,
    /// Time that it took, s; none of a step of an earlier version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// Do the solvers agree?
    pub agree: Option<bool>,
    /// What has to be said with it: that effects have one derivation, and which.
    #[serde(default)]
    pub one_derivation: Option<String>,
    /// The first so many effects of the model are the user's own.
    pub own: usize,
    /// Groups of camera parameters that a step set free, with the values that they were held at, by camera.
    #[serde(default)]
    pub freed: BTreeMap<String, Vec<(usize, Vec<f64>)>>,
    /// Effects that were searched over the sensor, with the number of places.
    pub placed: BTreeMap<String, f64>,
    /// What the effects of its model did to the points, in the sentences of the report.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moved: Option<String>,
    /// What is recorded wrongly in its block, in a sentence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mistake: Option<String>,
    /// What is recorded wrongly in the block of a root, or of a step that mends.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mistakes: Vec<Mistake>,
    /// What a step that mends undid, in this order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub undone: Vec<Mistake>,
}

impl Saved {
    /// The version of this program.
    pub const FORMAT: u32 = FORMAT;
}

/// The folder. No other program works in it as long as one holds it.
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
    _lock: Arc<File>,
}

impl Folder {
    /// Opens the laboratory of a block in `path`, or begins it there; `sha256` is of the block as it is now. What a
    /// program that was killed left half done is removed.
    ///
    /// # Errors
    /// A folder of another block, of this block before it changed, of another program that still runs, or one with
    /// other things in it.
    pub fn open(path: &Path, block: &Path, sha256: &str) -> Result<Self> {
        fs::create_dir_all(path).with_context(|| format!("{}: cannot make the folder", path.display()))?;
        if is_run(path) {
            bail!("{}: this is the folder of a run; name another with -o", path.display());
        }
        let lock = File::open(path).with_context(|| format!("{}: cannot read", path.display()))?;
        // A file system without locks refuses nobody.
        if matches!(lock.try_lock(), Err(TryLockError::WouldBlock)) {
            bail!(
                "{}: another laboratory works in this folder; end it, or name another folder with -o",
                path.display()
            );
        }
        let block = block.canonicalize().unwrap_or_else(|_| block.to_owned());
        match read_source(path)? {
            Some(other) if other == block => match read_laboratory(path)? {
                Some(before) if before == sha256 => {}
                Some(_) => bail!(
                    "{}: the block {} has changed since; start again in another folder (-o), or restore the block",
                    path.display(),
                    block.display()
                ),
                // Of a program that noted no hash.
                None => write_laboratory(path, &block, sha256)?,
            },
            Some(other) => bail!(
                "{}: this is the laboratory of the block {}, not of {}; name another folder with -o",
                path.display(),
                other.display(),
                block.display()
            ),
            None if fs::read_dir(path)?.next().is_some() => bail!(
                "{}: this folder has other things in it and is no laboratory; name a new one with -o",
                path.display()
            ),
            None => write_laboratory(path, &block, sha256)?,
        }
        for name in names(path)?.iter().filter(|name| name.starts_with(UNFINISHED)) {
            fs::remove_dir_all(path.join(name)).with_context(|| format!("{}: cannot remove {name}", path.display()))?;
        }
        Ok(Self { path: path.canonicalize().unwrap_or_else(|_| path.to_owned()), _lock: Arc::new(lock) })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Folder of a step.
    pub fn step(&self, id: u32) -> PathBuf {
        self.path.join(format!("{FINISHED}{id:04}"))
    }

    /// Folder of the block that a root measured anew.
    pub fn measured(&self, id: u32) -> PathBuf {
        self.path.join(format!("{MEASURED}{id:04}"))
    }

    /// Every step, by number.
    ///
    /// # Errors
    /// A step that cannot be read, or is of another block.
    pub fn steps(&self) -> Result<BTreeMap<u32, Saved>> {
        let mut steps = BTreeMap::new();
        for name in names(&self.path)? {
            let Some(id) = name.strip_prefix(FINISHED).and_then(|number| number.parse().ok()) else { continue };
            let file = self.path.join(&name).join(STEP);
            let text = crate::files::read_text(&file).with_context(|| format!("{}: cannot read", file.display()))?;
            let saved: Saved =
                serde_json::from_str(&text).with_context(|| format!("{}: cannot read", file.display()))?;
            if saved.format != FORMAT {
                bail!("{}: format {}, expected {FORMAT}", file.display(), saved.format);
            }
            steps.insert(id, saved);
        }
        let alone = steps.iter().find(|(_, saved)| saved.parent.is_some_and(|parent| !steps.contains_key(&parent)));
        if let Some((id, saved)) = alone {
            let parent = saved.parent.unwrap_or_default();
            bail!("{}: its parent, step {parent}, is not there", self.step(*id).display());
        }
        Ok(steps)
    }

    /// Has `work` write the folder of a run, adds what the step is, and gives it its name when all of it is there.
    ///
    /// # Errors
    /// Those of `work`, and what cannot be written: then nothing is left of it.
    pub fn add(&self, id: u32, saved: &Saved, work: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let mut builder = tempfile::Builder::new();
        let staged = builder.prefix(UNFINISHED).tempdir_in(&self.path);
        let staged = staged.with_context(|| format!("{}: cannot write", self.path.display()))?;
        work(staged.path())?;
        write_json(&staged.path().join(STEP), saved)?;
        let target = self.step(id);
        #[cfg(unix)]
        fs::set_permissions(staged.path(), std::os::unix::fs::PermissionsExt::from_mode(0o755))?;
        fs::rename(staged.path(), &target).with_context(|| format!("{}: cannot write", target.display()))?;
        // It has another name now: there is nothing to remove.
        let _ = staged.keep();
        Ok(())
    }
}

fn names(path: &Path) -> Result<Vec<String>> {
    let entries = fs::read_dir(path).with_context(|| format!("{}: cannot read", path.display()))?;
    let mut names: Vec<String> = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saved(parent: Option<u32>) -> Saved {
        Saved {
            format: FORMAT,
            parent,
            change: Change::Base,
            words: "base model".into(),
            figures: Figures::default(),
            verdict: "missing".into(),
            seconds: None,
            agree: Some(true),
            one_derivation: None,
            own: 0,
            freed: BTreeMap::new(),
            placed: BTreeMap::new(),
            moved: None,
            mistake: None,
            mistakes: Vec::new(),
            undone: Vec::new(),
        }
    }

    #[test]
    fn steps_are_whole_or_not_there_and_are_read_back() {
        let root = tempfile::tempdir().unwrap();
        let (block, lab) = (root.path().join("block"), root.path().join("lab"));
        fs::create_dir(&block).unwrap();
        let folder = Folder::open(&lab, &block, "a").unwrap();
        folder.add(1, &saved(None), |dir| Ok(fs::write(dir.join("summary.json"), "{}")?)).unwrap();
        let error = folder.add(2, &saved(Some(1)), |_| bail!("no space")).unwrap_err();
        assert_eq!(error.to_string(), "no space");
        // What a killed program leaves.
        fs::create_dir(lab.join(".step-x")).unwrap();
        drop(folder);
        let folder = Folder::open(&lab, &block, "a").unwrap();
        let again = folder.clone();
        assert!(!lab.join(".step-x").exists());
        let steps = again.steps().unwrap();
        assert_eq!(steps.keys().copied().collect::<Vec<_>>(), [1]);
        assert_eq!(steps[&1], saved(None));
        folder.add(3, &saved(Some(2)), |_| Ok(())).unwrap();
        assert!(again.steps().unwrap_err().to_string().contains("its parent, step 2"));
    }

    #[test]
    fn the_folder_of_another_block_is_refused() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        for name in ["one", "two", "other"] {
            fs::create_dir(at(name)).unwrap();
        }
        drop(Folder::open(&at("lab"), &at("one"), "a").unwrap());
        let refused = |folder: &str, block: &str, hash: &str| {
            Folder::open(&at(folder), &at(block), hash).map(|_| ()).unwrap_err().to_string()
        };
        let error = refused("lab", "two", "a");
        assert!(error.contains("is the laboratory of the block") && error.contains("one"), "{error}");
        fs::write(at("other/notes.txt"), "").unwrap();
        let error = refused("other", "one", "a");
        assert!(error.contains("has other things in it"), "{error}");
        let error = refused("lab", "one", "b");
        assert!(
            error.contains("has changed since; start again in another folder (-o), or restore the block"),
            "{error}"
        );
        let open = Folder::open(&at("lab"), &at("one"), "a").unwrap();
        let error = refused("lab", "one", "a");
        assert!(error.contains("another laboratory works in this folder"), "{error}");
        fs::create_dir_all(open.step(1)).unwrap();
        crate::run::folder::write_source(&open.step(1), &at("one"), "local").unwrap();
        fs::write(open.step(1).join("summary.json"), r#"{"format": 1, "solvers": {}}"#).unwrap();
        let error = refused("lab/step-0001", "one", "a");
        assert!(error.contains("is the folder of a run"), "{error}");
    }
}
