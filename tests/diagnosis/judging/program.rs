//! The program as a user runs it: `misclosure improve`, and the keys of its answer that scripts rely on.

use serde::Deserialize;
use std::path::Path;
use std::process::{Command, Output};
use std::time::Instant;

/// What `improve` found.
#[derive(Debug, Clone, Deserialize)]
pub struct Found {
    /// `adequate`, `missing` or `unexplained`.
    pub verdict: String,
    /// Effects of the final model.
    pub recommended: Vec<String>,
    /// Every effect of the catalogue.
    pub candidates: Vec<Candidate>,
    /// One row per model tried, the final one last.
    pub ledger: Vec<Row>,
    /// How long it took.
    #[serde(default)]
    pub seconds: f64,
}

/// An effect of the catalogue.
#[derive(Debug, Clone, Deserialize)]
pub struct Candidate {
    /// Its id.
    pub effect: String,
    /// Those that the block cannot tell from it.
    pub inseparable_from: Vec<String>,
}

/// A model of the ledger.
#[derive(Debug, Clone, Deserialize)]
pub struct Row {
    /// 3D RMS of the check points, m.
    pub check_rms_m: Option<f64>,
}

impl Found {
    /// Is `other` declared inseparable from `id`?
    pub fn inseparable(&self, id: &str, other: &str) -> bool {
        let entry = self.candidates.iter().find(|candidate| candidate.effect == id);
        entry.is_some_and(|candidate| candidate.inseparable_from.iter().any(|partner| partner == other))
    }

    /// 3D RMS of the check points at the end, mm; NaN without any.
    pub fn check_mm(&self) -> f64 {
        self.ledger.last().and_then(|row| row.check_rms_m).map_or(f64::NAN, |rms| 1e3 * rms)
    }
}

/// Improves a block on one thread.
///
/// # Errors
/// A run that failed or whose answer cannot be read, in words.
pub fn improve(block: &Path) -> Result<Found, String> {
    let scratch = tempfile::tempdir().map_err(|error| error.to_string())?;
    let started = Instant::now();
    let Output { status, stdout, stderr } = Command::new(env!("CARGO_BIN_EXE_misclosure"))
        .arg("improve")
        .arg(block)
        .arg("-o")
        .arg(scratch.path().join("run"))
        .args(["--free", "all", "--datum", "all", "--json", "--quiet", "--threads", "1"])
        .output()
        .map_err(|error| error.to_string())?;
    if !status.success() {
        return Err(format!("{status}: {}", String::from_utf8_lossy(&stderr).trim()));
    }
    let found: Found = serde_json::from_slice(&stdout).map_err(|error| format!("no diagnosis: {error}"))?;
    Ok(Found { seconds: started.elapsed().as_secs_f64(), ..found })
}
