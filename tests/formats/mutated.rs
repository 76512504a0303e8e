//! Bytes of good files are changed at random: every parser gives a block or an error, never a panic, and needs no time without bound.

use super::{format, write};
use misclosure::io::foreign::{ImportOptions, additions, registry};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Changed copies of each file; together they take some seconds.
const ROUNDS: usize = 100;
/// What is put in place of bytes: what numbers, counts and structure are made of.
const PIECES: [&[u8]; 14] =
    [b"-1", b"0", b"1e308", b"nan", b"4294967295", b"", b"\n", b"\"", b"<", b"</x>", b"\xff", b"\0\0\0\0", b"\t", b","];

fn mutated(bytes: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..random.random_range(1..4usize) {
        let at = random.random_range(0..bytes.len().max(1));
        let end = (at + random.random_range(0..6usize)).min(bytes.len());
        let piece = PIECES[random.random_range(0..PIECES.len())];
        match random.random_range(0..4u32) {
            0 => bytes.truncate(at),
            1 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            _ => drop(bytes.splice(at..end, piece.iter().copied())),
        }
    }
    bytes
}

/// Changes each of the files, one at a time, and imports `source` of the folder.
fn each_mutated(name: &str, files: &[(&str, &[u8])], source: &str) {
    let folder = tempfile::tempdir().unwrap();
    let put = |file: &str, content: &[u8]| {
        let path = folder.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    };
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut refused = 0;
    for (file, content) in files {
        files.iter().for_each(|(file, content)| put(file, content));
        for _ in 0..ROUNDS {
            let changed = mutated(content, &mut random);
            put(file, &changed);
            let paths = [folder.path().join(source)];
            let import =
                || format(name).import(&paths, &ImportOptions { approximate: true, ..ImportOptions::default() });
            let outcome = catch_unwind(AssertUnwindSafe(import));
            let shown = String::from_utf8_lossy(&changed);
            let outcome = outcome.unwrap_or_else(|_| panic!("{name} panics with {file}:\n{shown}"));
            refused += usize::from(outcome.is_err());
        }
    }
    assert!(refused > 0, "{name}: no change was noticed");
}

#[test]
fn no_parser_panics() {
    each_mutated("metashape", &[("cameras.xml", super::metashape::small().as_bytes())], "cameras.xml");
    let [reconstruction, tracks, list] = super::opensfm::small_files();
    each_mutated(
        "opensfm",
        &[("reconstruction.json", reconstruction), ("tracks.csv", tracks), ("gcp_list.txt", list)]
            .map(|(n, t)| (n, t.as_bytes())),
        "",
    );
    let (orientation, binary) = (super::micmac::orientation("1 2 3"), super::micmac::binary_pmul());
    let calibration = super::micmac::CALIBRATION.as_bytes();
    let project = [("Ori-A/AutoCal.xml", calibration), ("Ori-A/Orientation-a.jpg.xml", orientation.as_bytes())];
    each_mutated("micmac", &[&project[..], &[("Homol/PMul.dat", &binary[..])]].concat(), "");
    each_mutated("micmac", &[&project[..], &[("Homol/PMul.txt", super::micmac::PMUL.as_bytes())]].concat(), "");
    each_mutated("pix4d", &super::pix4d::FILES.map(|(name, text)| (name, text.as_bytes())), "");
    each_mutated("photomodeler", &[("x.txt", super::photomodeler::small().as_bytes())], "x.txt");
}

#[test]
fn no_addition_panics() {
    assert!(registry().len() > additions().len());
    let folder = tempfile::tempdir().unwrap();
    let block = super::additions::block(["100_0001_0001.JPG", "a.jpg"], super::additions::LOCAL);
    let image = super::additions::image(
        folder.path(),
        "a.jpg",
        "2001:09:09 03:46:40",
        "5",
        false,
        "drone-dji:GpsLatitude=\"+48.0\"",
    );
    let exif = std::fs::read(image).unwrap();
    let list = b"EPSG:4326\n2.001 48.0 5 99.5 199.5 a.jpg G1\n2.0 48.0 6 1 2 a.jpg CHK-1\n";
    let geo = b"EPSG:4326\na.jpg 2.0 48.0 120 0 0 0 0.5 1.5\n";
    let table = b"#CoordinateSystem: GEOGCS[\"WGS 84\",AUTHORITY[\"EPSG\",\"4326\"]]\nG1,2.001,48.0,5,0.01,0.02\na.jpg,G1,100,200\n";
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let cases: [(&str, &str, &[u8]); 5] = [
        ("mrk", "100_0001_Timestamp.MRK", super::additions::MRK.as_bytes()),
        ("exif", "a.jpg", &exif),
        ("gcp", "gcp_list.txt", list),
        ("gcp", "table.csv", table),
        ("geo", "geo.txt", geo),
    ];
    for (name, file, content) in cases {
        let addition = additions().iter().find(|addition| addition.name() == name).unwrap();
        for _ in 0..ROUNDS {
            let changed = mutated(content, &mut random);
            let path = write(folder.path(), file, &changed);
            let add = || addition.add(&mut block.clone(), &[path], &ImportOptions::default()).map(drop);
            let outcome = catch_unwind(AssertUnwindSafe(add));
            assert!(outcome.is_ok(), "{name} panics with {file}:\n{}", String::from_utf8_lossy(&changed));
        }
    }
}
