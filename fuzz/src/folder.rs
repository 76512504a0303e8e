//! Bytes as the files of a folder.

use std::fmt::Display;
use std::path::Path;

/// Stands between the files of one input.
pub const SEPARATOR: &[u8] = b"\n=====\n";

/// Memory in place of a disk, where the system has it.
const MEMORY: &str = "/dev/shm";

/// Hands on a folder with the files `names`; the last ones are not there where the bytes end before.
pub fn with_files(names: &[&str], data: &[u8], read: impl FnOnce(&Path)) {
    let root = if Path::new(MEMORY).is_dir() { MEMORY.into() } else { std::env::temp_dir() };
    let folder = tempfile::tempdir_in(root).expect("a temporary folder");
    let mut rest = Some(data);
    for name in names {
        let Some(bytes) = rest else { break };
        let end = bytes.windows(SEPARATOR.len()).position(|part| part == SEPARATOR);
        let content = end.map_or(bytes, |end| &bytes[..end]);
        rest = end.map(|end| &bytes[end + SEPARATOR.len()..]);
        let path = folder.path().join(name);
        // Every name has a folder: at least the temporary one.
        std::fs::create_dir_all(path.parent().unwrap_or(&path)).expect("a folder in a temporary folder");
        std::fs::write(path, content).expect("a file in a temporary folder");
    }
    read(folder.path());
}

/// An error has a text.
pub fn said(error: impl Display) {
    assert!(!error.to_string().trim().is_empty(), "an error without a word");
}
