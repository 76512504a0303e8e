//! Finished cases on disk: one file each, written atomically, known again by a fingerprint of everything that it
//! depends on.

use super::case::Case;
use super::outcome::Outcome;
use crate::io::write_atomically;
use crate::scenario::preset_text;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Changes with the meaning of the file.
const FORMAT: u32 = 1;

/// A folder of finished cases.
#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
    /// What the results depend on beside the case: the program and the solvers.
    program: String,
}

/// The file of a case.
#[derive(Serialize, Deserialize)]
struct File {
    format: u32,
    fingerprint: String,
    case: Case,
    outcome: Outcome,
}

impl Store {
    /// Opens the folder, which is made where it is missing. `program` stands for what results depend on beside the
    /// case: a result of another program is not taken for one of this.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn open(folder: &Path, program: &str) -> Result<Self> {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        Ok(Self { folder: folder.to_owned(), program: program.into() })
    }

    /// The outcome of a case that was finished before under the same settings; `None` where there is none, or none that
    /// can be read.
    pub fn load(&self, case: &Case) -> Option<Outcome> {
        let text = crate::files::read(&self.path(case)).ok()?;
        let file: File = serde_json::from_slice(&text).ok()?;
        let same = file.format == FORMAT && file.case == *case && file.fingerprint == self.fingerprint(case).ok()?;
        same.then_some(file.outcome)
    }

    /// Keeps the outcome of a case.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&self, case: &Case, outcome: &Outcome) -> Result<()> {
        let file =
            File { format: FORMAT, fingerprint: self.fingerprint(case)?, case: case.clone(), outcome: outcome.clone() };
        write_atomically(&self.path(case), &serde_json::to_vec(&file)?)?;
        Ok(())
    }

    fn path(&self, case: &Case) -> PathBuf {
        self.folder.join(format!("{}.json", case.key))
    }

    /// Of the settings, the scenario's text and the program.
    fn fingerprint(&self, case: &Case) -> Result<String> {
        let text = serde_json::to_string(&(case, preset_text(&case.preset), &self.program))?;
        Ok(format!("{:016x}", fnv1a(text.as_bytes())))
    }
}

/// The 64-bit hash of Fowler, Noll and Vo: the same on every machine and in every version of the compiler.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hash_of_known_texts() {
        assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn a_result_is_known_again_under_its_own_settings_alone() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("cases"), "a").unwrap();
        let (case, outcome) = (Case::dike("x"), Outcome::Impossible { reason: "singular".into(), agreed: true });
        assert_eq!(store.load(&case), None);
        store.save(&case, &outcome).unwrap();
        assert_eq!(store.load(&case), Some(outcome));
        assert_eq!(store.load(&case.clone().fix("f")), None);
        assert_eq!(Store::open(&folder.path().join("cases"), "b").unwrap().load(&case), None);
        // A file cut short by a kill of the machine is no result.
        std::fs::write(store.path(&case), "{\"format\": 1").unwrap();
        assert_eq!(store.load(&case), None);
    }
}
