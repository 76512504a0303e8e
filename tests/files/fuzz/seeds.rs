//! Inputs to begin with: the repository's own files, and what the program writes.

use super::small::{additions, aicon, metashape, micmac, opensfm, photomodeler, pix4d};
use super::targets::{SEPARATOR, block, foreign, run_folder};
use misclosure::effects;
use misclosure::io::block::{read_block, write_block};
use misclosure::io::foreign::{ExportOptions, registry};
use misclosure::io::model::write_model;
use misclosure::model::{EffectRef, EffectTerm, Model, Prior};
use misclosure::scenario::{Scenario, add_noise, simulate};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

pub type Seeds = Vec<Vec<u8>>;

const SMALL: &str = include_str!("../../../fuzz/src/small.toml");
/// px.
const NOISE: f64 = 0.3;

/// The files of a folder as one input.
fn bundle(folder: &Path, names: &[&str]) -> Vec<u8> {
    let content = |name: &&str| fs::read(folder.join(name)).unwrap_or_default();
    names.iter().map(content).collect::<Vec<_>>().join(SEPARATOR)
}

/// Files of a folder of the repository whose name ends so.
fn files(folder: &str, ending: &str) -> Seeds {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut paths: Vec<_> =
        fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let wanted = paths.iter().filter(|path| path.to_string_lossy().ends_with(ending));
    wanted.map(|path| fs::read(path).expect("a file")).collect()
}

/// Writes a small block with noise.
fn write_small(folder: &Path, points: f64) {
    let few = BTreeMap::from([("points".to_string(), points)]);
    let scenario = Scenario::from_toml_with(SMALL, "small.toml", &few).expect("a scenario");
    let mut block = simulate(&scenario, 1).expect("a block").block;
    add_noise(&mut block, NOISE, 1).expect("noise");
    write_block(&block, folder).expect("written");
}

pub fn blocks() -> Seeds {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("block");
    write_small(&path, 8.0);
    vec![bundle(&path, &block::FILES)]
}

/// One of each case: small files of the tests, and a small block as it is exported.
pub fn foreign() -> Seeds {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_small(&folder.path().join("block"), 8.0);
    let small = read_block(&folder.path().join("block")).expect("a block").block;
    let seed = |(number, case): (usize, &foreign::Case)| {
        let files = folder.path().join(format!("{number}"));
        fs::create_dir(&files).expect("a folder");
        for name in case.files {
            if let Some(content) = small_file(case.name, name) {
                let path = files.join(name);
                fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
                fs::write(path, content).expect("a file");
            }
        }
        if fs::read_dir(&files).expect("a folder").next().is_none() {
            let exporter = registry().iter().find(|format| format.name() == case.name).and_then(|f| f.exporter());
            let options = ExportOptions { approximate: true };
            exporter.expect("what has no small file is exported").export(&small, &files, &options).expect("exported");
        }
        // A file that is not there at the end of an input is not written.
        let last = case.files.iter().rposition(|name| files.join(name).exists()).expect("a file");
        [&[number as u8], &bundle(&files, &case.files[..=last])[..]].concat()
    };
    foreign::CASES.iter().enumerate().map(seed).collect()
}

/// The small file of a format, or of an addition, that has this name.
fn small_file(format: &str, name: &str) -> Option<Vec<u8>> {
    let project = metashape::project();
    let [of_a, of_b] = project.projections;
    let aicon = || aicon::files().into_iter().find(|(other, _)| *other == name).map(|(_, text)| text);
    let pix4d = || pix4d::FILES.into_iter().find(|(other, _)| *other == name).map(|(_, text)| text);
    Some(match (format, name.rsplit('!').next()?) {
        ("metashape", "cameras.xml") => metashape::document(metashape::RELATIVE, metashape::MARKERS).into(),
        ("metashape", "p.psx") => metashape::POINTER.into(),
        ("metashape", "doc.xml") => match name {
            "p.psz!doc.xml" => metashape::whole().into(),
            "p.files/project.zip!doc.xml" => project.project,
            "p.files/0/chunk.zip!doc.xml" => project.chunk,
            "p.files/0/0/frame.zip!doc.xml" => project.frame,
            _ => project.cloud,
        },
        ("metashape", "points0.ply") => project.points,
        ("metashape", "p3.ply") => of_a,
        ("metashape", "p4.ply") => of_b,
        ("opensfm", "reconstruction.json") => opensfm::RECONSTRUCTION.into(),
        ("opensfm", "tracks.csv") => opensfm::ROWS[2].into(),
        ("opensfm", "ground_control_points.json") => opensfm::CONTROL.into(),
        ("opensfm", "gcp_list.txt") => opensfm::LIST.into(),
        ("micmac", "Ori-A/AutoCal.xml") => micmac::CALIBRATION.into(),
        ("micmac", "Ori-A/Orientation-a.jpg.xml") => micmac::orientation("1 2 3").into(),
        ("micmac", "Ori-A/Orientation-b.jpg.xml") => micmac::orientation("4 5 6").into(),
        ("micmac", "Homol/PMul.txt") => micmac::PMUL.into(),
        ("micmac", "Homol/PMul.dat") => micmac::binary_pmul(),
        ("micmac", "Homol/Pastisa.jpg/b.jpg.txt") => micmac::PAIRS.into(),
        ("micmac", "Homol/Pastisb.jpg/a.jpg.txt") => micmac::PAIRS_BACK.into(),
        ("micmac", "Homol/Pastisa.jpg/b.jpg.dat") => micmac::binary_pairs(),
        ("micmac", "Ground.xml") => micmac::GROUND.into(),
        ("micmac", "Marks.xml") => micmac::MARKS.into(),
        ("micmac", "Calib-A.xml") => micmac::SECOND_CALIBRATION.into(),
        ("micmac", "Ori-a.xml") => micmac::second_orientation("a.jpg", "1 2 3").into(),
        ("micmac", "Ori-b.xml") => micmac::second_orientation("b.jpg", "4 5 6").into(),
        ("micmac", "MesGCP.xml") => micmac::SECOND_GROUND.into(),
        ("micmac", "MesIm-a.xml") => micmac::SECOND_MARKS.into(),
        ("pix4d", "p_tp_bingo.txt") => pix4d::BINGO.into(),
        ("pix4d", _) => pix4d()?.into(),
        ("photomodeler", "x.txt") => photomodeler::file().into(),
        ("aicon", _) => aicon()?.into(),
        ("gcp", "gcp_list.txt") => additions::LIST.into(),
        ("gcp", "ground_control_points.json") => additions::CONTROL.into(),
        ("gcp", "table.csv") => additions::TABLE.into(),
        ("mrk", _) => additions::MRK.into(),
        ("exif", "a.jpg") => additions::image("2001:09:09 03:46:40", "5", false, additions::XMP),
        ("geo", "geo.txt") => additions::GEO.into(),
        _ => return None,
    })
}

pub fn models() -> Seeds {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.toml");
    let written = |model: &Model| {
        write_model(model, &path).expect("written");
        fs::read(&path).expect("a file")
    };
    let term = |effect: &&'static dyn effects::Effect| {
        let parameters = effect.descriptor().parameters.iter();
        let values = parameters.map(|parameter| (parameter.name.to_string(), parameter.nominal)).collect();
        EffectTerm { effect: EffectRef::Builtin(*effect), values, held: Vec::new() }
    };
    let prior = Prior { camera: "cam".into(), parameter: "f".into(), value: 5000.0, sigma: 1.0 };
    let full = Model {
        effects: effects::catalogue().iter().map(term).collect(),
        priors: vec![prior],
        camera_values: BTreeMap::from([("cam".into(), BTreeMap::from([("k1".into(), 1e-9)]))]),
        ..Model::default()
    };
    vec![written(&Model::default()), written(&full)]
}

pub fn recipes() -> Seeds {
    files("data/hidden", ".toml")
}

pub fn scenarios() -> Seeds {
    let mut seeds = files("data/scenarios", ".toml");
    seeds.extend(files("data/hidden/scenarios", ".toml"));
    seeds.push(SMALL.into());
    seeds
}

/// Of an adjustment and of a diagnosis.
pub fn run_folders() -> Seeds {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let block = folder.path().join("block");
    write_small(&block, 40.0);
    let seed = |command: &str| {
        let run = folder.path().join(command);
        let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
            .args(["--quiet", command])
            .arg(&block)
            .arg("-o")
            .arg(&run)
            .args(["--solver", "native", "--fix", "dc,affinity"])
            .output()
            .expect("the program runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        bundle(&run, &run_folder::files())
    };
    vec![seed("adjust"), seed("improve")]
}

/// For targets that draw a case from bytes.
pub fn chance(seed: u64, length: usize) -> Seeds {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..20).map(|_| (0..length).map(|_| random.random()).collect()).collect()
}
