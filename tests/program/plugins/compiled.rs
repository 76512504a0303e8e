//! Shared libraries, compiled as the first lines of `effect.h` say.

use std::path::{Path, PathBuf};
use std::process::Command;

pub const CPP: [&str; 2] = ["c++", "-std=c++17"];
pub const C: [&str; 2] = ["c", "-std=c11"];

/// Compiles `source` to `NAME.so` in `folder`.
pub fn compile(folder: &Path, name: &str, source: &str, language: [&str; 2], options: &[String]) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (header, library) = (folder.join(format!("{name}.h")), folder.join(format!("{name}.so")));
    std::fs::write(&header, source).expect("a file");
    let [language, standard] = language;
    let status = Command::new("c++")
        .args([standard, "-O1", "-fPIC", "-shared", "-fvisibility=hidden", "-DMISCLOSURE_PLUGIN", "-I"])
        .arg(root.join("cpp"))
        .args(["-I", "/usr/include/eigen3", "-x", language])
        .args(options)
        .arg(&header)
        .arg("-o")
        .arg(&library)
        .status()
        .expect("a C++ compiler, which the build needs too");
    assert!(status.success(), "{name} does not compile");
    library
}
