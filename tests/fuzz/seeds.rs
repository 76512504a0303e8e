//! Inputs to begin with: the repository's own files, and what the program writes.

use super::targets::{SEPARATOR, block, run_folder};
use misclosure::effects;
use misclosure::io::block::write_block;
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

const SMALL: &str = include_str!("../../fuzz/src/small.toml");
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
