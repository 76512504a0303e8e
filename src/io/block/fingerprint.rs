//! Is a block the one that it was? By the SHA-256 of its files.

use super::{BLOCK, CONTROL, Error, IMAGES, MARKS, POINTS, TIES};
use sha2::{Digest, Sha256};
use std::io::{self, BufRead, BufReader};
use std::path::Path;

/// Bytes read at a time.
const BUFFER_BYTES: usize = 1 << 18;

/// SHA-256, hexadecimal, of the files of the block in `folder`: names and bytes. Other files in the folder do not
/// count.
///
/// # Errors
/// [`Error::Read`].
pub fn fingerprint(folder: &Path) -> Result<String, Error> {
    let mut hash = Sha256::new();
    for name in [BLOCK, IMAGES, TIES, POINTS, CONTROL, MARKS] {
        let path = folder.join(name);
        match add(&mut hash, name, &path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            read => read.map_err(|source| Error::Read { path, source })?,
        }
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

fn add(hash: &mut Sha256, name: &str, path: &Path) -> io::Result<()> {
    let mut file = BufReader::with_capacity(BUFFER_BYTES, super::super::open(path)?);
    // The length, too: no two blocks have the same sequence of bytes.
    let length = file.get_ref().metadata()?.len();
    hash.update(format!("{name} {length}\n"));
    loop {
        let bytes = file.fill_buf()?;
        if bytes.is_empty() {
            return Ok(());
        }
        hash.update(bytes);
        let length = bytes.len();
        file.consume(length);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn only_what_belongs_to_the_block_counts() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write(BLOCK, "a");
        write(TIES, "b");
        let before = fingerprint(folder.path()).unwrap();
        assert_eq!(before.len(), 64);
        write("notes.txt", "c");
        assert_eq!(fingerprint(folder.path()).unwrap(), before);
        for name in [TIES, POINTS, MARKS] {
            write(name, "x");
            let changed = fingerprint(folder.path()).unwrap();
            assert_ne!(changed, before, "{name}");
            fs::remove_file(folder.path().join(name)).unwrap();
        }
        write(TIES, "b");
        assert_eq!(fingerprint(folder.path()).unwrap(), before);
    }
}
