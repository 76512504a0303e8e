//! An empty folder, and the program as it is installed.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// Where the package is installed, once for all tests; nothing of the source tree is in reach of it.
pub fn prefix() -> &'static Path {
    static PREFIX: OnceLock<PathBuf> = OnceLock::new();
    PREFIX.get_or_init(|| {
        let prefix = Path::new(env!("CARGO_TARGET_TMPDIR")).join("kit-prefix");
        let _ = std::fs::remove_dir_all(&prefix);
        let status = Command::new(root().join("scripts/install.sh"))
            .arg(&prefix)
            .arg(env!("CARGO_BIN_EXE_misclosure"))
            .stdout(std::process::Stdio::null())
            .status()
            .expect("a shell");
        assert!(status.success(), "the package is installed");
        prefix
    })
}

/// The source tree, for what a test compares with.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// An empty folder.
pub struct Place(tempfile::TempDir);

impl Place {
    pub fn new() -> Self {
        prefix();
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("a file");
    }

    /// A command in the folder, with the installed program on the path.
    pub fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let path = std::env::var("PATH").unwrap_or_default();
        let mut command = Command::new(program);
        command.current_dir(self.0.path()).env("PATH", format!("{}:{path}", prefix().join("bin").display()));
        command
    }

    /// The installed program with arguments as a shell divides them.
    pub fn run(&self, arguments: &str) -> Run {
        let output =
            self.command(prefix().join("bin/misclosure")).args(["--quiet"]).args(arguments.split(' ')).output();
        Run::of(output.expect("the program runs"))
    }

    /// [`Self::run`] that has to succeed, with the JSON that it prints.
    pub fn json(&self, arguments: &str) -> Value {
        let run = self.run(&format!("--json {arguments}"));
        assert_eq!(run.code, Some(0), "{arguments}: {}", run.errors);
        serde_json::from_str(&run.text).expect("JSON")
    }

    /// Compiles `source` to `NAME.so`.
    pub fn build(&self, name: &str, source: &str) {
        self.write(&format!("{name}.h"), source);
        let run = self.run(&format!("effects build {name}.h -o {name}.so"));
        assert_eq!((run.code, run.errors.as_str()), (Some(0), ""), "{}", run.text);
    }
}

/// What a run of the program came to.
pub struct Run {
    pub code: Option<i32>,
    pub text: String,
    pub errors: String,
}

impl Run {
    pub fn of(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
        Self { code: output.status.code(), text: text(output.stdout), errors: text(output.stderr) }
    }
}

/// A header of `examples/effects`.
pub fn example(name: &str) -> String {
    std::fs::read_to_string(root().join("examples/effects").join(name)).expect("an example")
}
