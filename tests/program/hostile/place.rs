//! A temporary folder with a small block and a run of it, in which a test starts the program.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use tempfile::TempDir;

/// Points of the block: an adjustment takes a fraction of a second.
const POINTS: &str = "points=150";

/// A folder with `block`, and `run`, an adjustment of it.
pub struct Place(TempDir);

/// How the program ended.
#[derive(Debug)]
pub struct Ended {
    /// `None` where a signal ended it.
    pub code: Option<i32>,
    pub text: String,
    pub errors: String,
}

impl From<Output> for Ended {
    fn from(output: Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Self { code: output.status.code(), text: text(&output.stdout), errors: text(&output.stderr) }
    }
}

impl Ended {
    /// Asserts the code and a part of the message, and that there was no panic.
    pub fn expect(&self, code: i32, what: &str) {
        assert!(self.code == Some(code) && self.errors.contains(what), "expected {code} and {what:?}: {self:?}");
        assert!(!self.errors.contains("panicked") && !self.errors.contains("internal error"), "{self:?}");
    }
}

/// A name that is not UTF-8.
pub fn odd() -> OsString {
    OsString::from_vec(b"q\xff".to_vec())
}

impl Place {
    /// The first call simulates and adjusts; later ones copy.
    pub fn new() -> Self {
        static FIRST: OnceLock<TempDir> = OnceLock::new();
        let first = FIRST.get_or_init(|| {
            let place = Self(tempfile::tempdir().expect("a folder"));
            place.run(["simulate", "closerange", "-o", "truth", "--set", POINTS]).expect(0, "");
            place.run(["inject", "truth", "-o", "block", "--error", "noise:px=0.3"]).expect(0, "");
            place.run(["adjust", "block", "-o", "run"]).expect(0, "");
            place.run(["export", "colmap", "block", "-o", "colmap", "--approximate"]).expect(0, "");
            place.0
        });
        let place = Self(tempfile::tempdir().expect("a folder"));
        copy(first.path(), place.path());
        place
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn at(&self, name: impl AsRef<Path>) -> PathBuf {
        self.path().join(name)
    }

    pub fn command<S: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_misclosure"));
        command.args(arguments).current_dir(self.path()).stdin(Stdio::null());
        command
    }

    pub fn run<S: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Ended {
        self.command(arguments).output().expect("the program runs").into()
    }

    /// Runs the program after `before`, commands of a shell such as `ulimit -v 100000;`. After 300 s it ends with code
    /// 124.
    pub fn run_under<S: AsRef<OsStr>>(&self, before: &str, arguments: impl IntoIterator<Item = S>) -> Ended {
        let mut command = Command::new("bash");
        command.args(["-c", &format!("{before} exec timeout 300 \"$@\""), "bash", env!("CARGO_BIN_EXE_misclosure")]);
        command.args(arguments).current_dir(self.path()).stdin(Stdio::null()).env("RUST_BACKTRACE", "0");
        command.output().expect("a shell").into()
    }

    /// Names in a folder, hidden ones too.
    pub fn names(&self, folder: &str) -> Vec<String> {
        let name =
            |entry: std::io::Result<fs::DirEntry>| entry.expect("entry").file_name().to_string_lossy().into_owned();
        let mut names: Vec<String> = fs::read_dir(self.at(folder)).expect("a folder").map(name).collect();
        names.sort();
        names
    }
}

pub fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).expect("a folder") {
        let (path, target) = {
            let entry = entry.expect("entry");
            (entry.path(), to.join(entry.file_name()))
        };
        if path.is_dir() {
            fs::create_dir_all(&target).expect("a folder");
            copy(&path, &target);
        } else {
            fs::copy(&path, &target).expect("a file");
        }
    }
}

/// Is a run complete? Its summary states the rows of its tables; report and figures must exist.
pub fn is_whole(run: &Path) -> Result<(), String> {
    let text = fs::read_to_string(run.join("summary.json")).map_err(|error| format!("summary.json: {error}"))?;
    let summary: serde_json::Value = serde_json::from_str(&text).map_err(|error| format!("summary.json: {error}"))?;
    for (table, rows) in [("images", "images"), ("points", "points"), ("residuals", "residuals"), ("checks", "checks")]
    {
        let file = format!("{table}.csv");
        let text = fs::read_to_string(run.join(&file)).map_err(|error| format!("{file}: {error}"))?;
        let (found, expected) = (text.lines().count() - 1, summary["rows"][rows].as_u64().expect("rows"));
        if found as u64 != expected {
            return Err(format!("{file}: {found} rows, expected {expected}"));
        }
    }
    for file in ["model.toml", "source.json", "report.html", "figures"] {
        if !run.join(file).exists() {
            return Err(format!("{file} is missing"));
        }
    }
    Ok(())
}
