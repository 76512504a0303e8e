//! Compiles an effect to a plug-in: a header with the system's C++ compiler, a Rust package with cargo.
//!
//! The library takes its name when it is whole: a build that fails leaves an older one as it was, and one that a
//! program has loaded is never written into.

use super::headers;
use crate::files::scratch::Scratch;
use serde_json::Value;
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Where Debian, and what was compiled by hand, has Eigen; elsewhere `CXXFLAGS` names it.
const EIGEN: [&str; 2] = ["/usr/include/eigen3", "/usr/local/include/eigen3"];

/// Why there is no plug-in.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Nothing to compile.
    #[error("{path}: cannot be read: {source}", path = .path.display())]
    Source {
        /// The file.
        path: PathBuf,
        /// The system's message.
        source: io::Error,
    },
    /// No compiler.
    #[error("`{program}` cannot be run: {source}; {advice}")]
    NoCompiler {
        /// What was called.
        program: String,
        /// The system's message.
        source: io::Error,
        /// What to install.
        advice: &'static str,
    },
    /// The compiler refused it.
    #[error("{path}: does not compile; {program} says:\n{message}{hint}", path = .path.display())]
    Refused {
        /// The source.
        path: PathBuf,
        /// The compiler.
        program: String,
        /// What it printed.
        message: String,
        /// What to do about it, where that is known.
        hint: String,
    },
    /// A Rust package that makes no library.
    #[error("{path}: the package makes no library: expected crate-type = [\"cdylib\"] in its \
             [lib]", path = .path.display())]
    NoLibrary {
        /// Its manifest.
        path: PathBuf,
    },
    /// The library cannot be written.
    #[error("{path}: cannot be written: {source}", path = .path.display())]
    Output {
        /// The library.
        path: PathBuf,
        /// The system's message.
        source: io::Error,
    },
}

/// Compiles `source`, a header or the folder of a Rust package, to `library`; what the compiler warned of is the
/// result.
///
/// # Errors
/// [`BuildError`].
pub fn build(source: &Path, library: &Path) -> Result<String, BuildError> {
    let unwritable = |source: io::Error| BuildError::Output { path: library.into(), source };
    let beside = library.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let work = Scratch::new_in(beside).map_err(unwritable)?;
    let made = work.path().join("plugin.so");
    let is_manifest = source.file_name() == Some(OsStr::new("Cargo.toml"));
    let warnings = if source.is_dir() || is_manifest {
        let manifest = if is_manifest { source.to_owned() } else { source.join("Cargo.toml") };
        cargo(&manifest, &made)?
    } else {
        cpp(source, work.path(), &made)?
    };
    std::fs::rename(&made, library).map_err(unwritable)?;
    Ok(warnings)
}

/// The words of an environment variable, else of `default`.
fn words(variable: &str, default: &str) -> Vec<String> {
    let text = std::env::var(variable).ok().filter(|text| !text.trim().is_empty());
    text.as_deref().unwrap_or(default).split_whitespace().map(String::from).collect()
}

fn readable(path: &Path) -> Result<(), BuildError> {
    let source = |source| BuildError::Source { path: path.into(), source };
    crate::files::open(path).map(drop).map_err(source)
}

fn run(command: &mut Command, advice: &'static str) -> Result<Output, BuildError> {
    let program = command.get_program().to_string_lossy().into_owned();
    command.output().map_err(|source| BuildError::NoCompiler { program, source, advice })
}

/// A header, with `CXX` (c++) and `CXXFLAGS`; `work` is a folder for the contract's headers.
fn cpp(header: &Path, work: &Path, library: &Path) -> Result<String, BuildError> {
    readable(header)?;
    headers::write(work).map_err(|source| BuildError::Output { path: work.into(), source })?;
    let compiler = words("CXX", "c++");
    let (program, options) = compiler.split_first().map_or(("c++", &[][..]), |(first, rest)| (first.as_str(), rest));
    let mut command = Command::new(program);
    command
        .args(options)
        .args(["-std=c++17", "-O3", "-fPIC", "-shared", "-fvisibility=hidden", "-Wall", "-Wextra"])
        .args(["-DMISCLOSURE_PLUGIN", "-I"])
        .arg(work)
        .args(EIGEN.iter().filter(|folder| Path::new(folder).is_dir()).flat_map(|folder| ["-isystem", folder]))
        .args(words("CXXFLAGS", ""))
        .args(["-x", "c++"])
        .arg(header)
        .arg("-o")
        .arg(library);
    let output = run(&mut command, "a C++ compiler is needed: install g++, or name another in CXX")?;
    let message = String::from_utf8_lossy(&output.stderr).trim_end().to_owned();
    if output.status.success() {
        return Ok(message);
    }
    let missing = |name: &str| message.contains(name) && message.contains("No such file");
    let hint = match () {
        () if missing("ceres/jet.h") => {
            "\nCeres' headers are missing: install libceres-dev (CXXFLAGS=-I... names another place)"
        }
        () if missing("Eigen/Core") => {
            "\nEigen's headers are missing: install libeigen3-dev (CXXFLAGS=-I... names another place)"
        }
        () => "",
    };
    Err(BuildError::Refused { path: header.into(), program: program.into(), message, hint: hint.into() })
}

/// A Rust package; cargo says which library it made.
fn cargo(manifest: &Path, library: &Path) -> Result<String, BuildError> {
    readable(manifest)?;
    let program = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let mut command = Command::new(&program);
    command
        .args(["build", "--release", "--lib", "--message-format=json-render-diagnostics", "--manifest-path"])
        .arg(manifest);
    let output = run(&mut command, "Rust is needed: install it with rustup (https://rustup.rs)")?;
    let message = String::from_utf8_lossy(&output.stderr).trim_end().to_owned();
    if !output.status.success() {
        return Err(BuildError::Refused { path: manifest.into(), program, message, hint: String::new() });
    }
    let lines = String::from_utf8_lossy(&output.stdout);
    let made = lines
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .filter_map(|line| shared_library(&line))
        .next_back();
    let Some(made) = made else { return Err(BuildError::NoLibrary { path: manifest.into() }) };
    std::fs::copy(&made, library).map_err(|source| BuildError::Output { path: library.into(), source })?;
    // Cargo says what it does on standard error; only warnings are worth repeating.
    Ok(if message.contains("warning") { message } else { String::new() })
}

/// The shared library of one of cargo's messages, if it is about one.
fn shared_library(message: &Value) -> Option<PathBuf> {
    let kinds = message["target"]["crate_types"].as_array()?;
    let is_library = message["reason"] == "compiler-artifact" && kinds.iter().any(|kind| kind == "cdylib");
    let files = message["filenames"].as_array()?.iter().filter_map(Value::as_str).map(PathBuf::from);
    let shared = |file: &PathBuf| file.extension().is_some_and(|extension| extension == "so" || extension == "dylib");
    files.into_iter().find(shared).filter(|_| is_library)
}
