//! Whatever is in a file, its reader refuses it or makes a block of it: our own files with bytes and words changed at random.

use super::fixture::{block, camera, export, import};
use misclosure::io::foreign::{ImportOptions, registry};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs;
use std::path::PathBuf;

/// Altered files per format.
const COUNT: usize = 100;

/// Words that parsers stumble over.
const WORDS: [&str; 8] = ["-1", "0", "nan", "1e308", "99999999999999999999", "", "\u{feff}", "-"];

#[test]
fn altered_files_make_no_reader_panic() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut small = block(camera([0.0; 7]));
    // Without distortion: to fit one takes longer than all the reading.
    small.surveyed.clear();
    small.marks.clear();
    for format in registry().iter().filter(|format| format.exporter().is_some()) {
        let folder = tempfile::tempdir().expect("a folder");
        export(format.name(), &small, folder.path(), true).expect("it can be written");
        let mut files: Vec<PathBuf> =
            fs::read_dir(folder.path()).expect("a folder").map(|e| e.expect("a file").path()).collect();
        files.retain(|path| path.is_file());
        files.sort();
        // Formats of one file are read by it, the others by their folder.
        let whole = [folder.path().to_path_buf()].into_iter().chain(files.clone());
        let options = ImportOptions { approximate: true, ..ImportOptions::default() };
        let source =
            whole.into_iter().find(|path| import(format.name(), path, &options).is_ok()).expect("it is read back");
        let mut refused = 0;
        for _ in 0..COUNT {
            let file = &files[random.random_range(0..files.len())];
            let before = fs::read(file).expect("a file");
            fs::write(file, altered(&before, &mut random)).expect("a file");
            refused += usize::from(import(format.name(), &source, &options).is_err());
            fs::write(file, before).expect("a file");
        }
        assert!(refused > COUNT / 10, "{}: {refused} of {COUNT} were refused", format.name());
    }
}

fn altered(bytes: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let at = random.random_range(0..bytes.len().max(1)).min(bytes.len().saturating_sub(1));
    match random.random_range(0..4) {
        0 => bytes.truncate(at),
        1 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte = random.random()),
        2 => {
            let end = (at + random.random_range(1..9)).min(bytes.len());
            bytes.splice(at..end, [0xff; 8]);
        }
        _ => {
            let blank = |byte: &u8| byte.is_ascii_whitespace();
            let begin = bytes[..at].iter().rposition(blank).map_or(0, |blank| blank + 1);
            let end = bytes[at..].iter().position(blank).map_or(bytes.len(), |length| at + length);
            bytes.splice(begin..end, WORDS[random.random_range(0..WORDS.len())].bytes());
        }
    }
    bytes
}
