//! Data beside the project, which not every machine has.

use std::io::Write;
use std::path::{Path, PathBuf};

/// The folder `../shared/NAME`; `None` where it is not there, said on standard error past the capture of passing tests.
pub fn shared(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    writeln!(std::io::stderr(), "skipped: no ../shared/{name}").expect("standard error");
    None
}
