//! The fuzz targets for some seconds: over the repository's own data, and over what seeded chance makes of it. `make
//! fuzz` lets libFuzzer search for as long as one likes.

use crate::small;
mod mutation;
mod seeds;
#[path = "../../../fuzz/src/lib.rs"]
mod targets;

use mutation::mutate;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use seeds::Seeds;
use std::fs;
use std::path::Path;

/// Where the seeds are to be written for libFuzzer, a folder per target.
const CORPUS: &str = "MISCLOSURE_FUZZ_CORPUS";

/// Runs a target over its seeds and over mutations of them.
fn run(name: &str, seeds: Seeds, mutations: usize, target: fn(&[u8])) {
    assert!(!seeds.is_empty(), "{name} has no seeds");
    if let Some(corpus) = std::env::var_os(CORPUS) {
        let folder = Path::new(&corpus).join(name);
        fs::create_dir_all(&folder).expect("a folder");
        for (k, seed) in seeds.iter().enumerate() {
            fs::write(folder.join(format!("seed-{k}")), seed).expect("a file");
        }
    }
    seeds.iter().for_each(|seed| target(seed));
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for k in 0..mutations {
        let bytes = mutate(&seeds[k % seeds.len()], &mut random);
        // The input that panics can be run alone by its number, and is one for `cargo fuzz run`.
        let outcome = std::panic::catch_unwind(|| target(&bytes));
        assert!(outcome.is_ok(), "{name}: mutation {k}: {:?}", String::from_utf8_lossy(&bytes));
    }
}

#[test]
fn blocks() {
    run("block", seeds::blocks(), 600, targets::block::run);
}

#[test]
fn foreign_files() {
    let seeds = seeds::foreign();
    for (seed, case) in seeds.iter().zip(&targets::foreign::CASES) {
        targets::foreign::take(seed).unwrap_or_else(|error| panic!("{} {:?}: {error}", case.name, case.files));
    }
    run("foreign", seeds, 2600, targets::foreign::run);
}

#[test]
fn models() {
    run("model", seeds::models(), 2000, targets::model::run);
}

#[test]
fn recipes() {
    run("recipe", seeds::recipes(), 2000, targets::recipe::run);
}

#[test]
fn scenarios() {
    run("scenario", seeds::scenarios(), 600, targets::scenario::run);
}

#[test]
fn run_folders() {
    run("run_folder", seeds::run_folders(), 200, targets::run_folder::run);
}

#[test]
fn descriptors() {
    run("descriptor", seeds::chance(2, 512), 20_000, targets::descriptor::run);
}

#[test]
fn adjustments() {
    run("adjust", seeds::chance(3, 256), 40, targets::adjust::run);
}
