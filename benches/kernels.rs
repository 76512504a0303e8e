//! The inner kernels of the native solver one by one, in every width of the vector registers that the processor has,
//! and reading and writing: part of `make bench`, or `cargo bench --bench kernels`. A text behind `--` runs those that
//! have it in their name.
//!
//! Where an iteration has become slower (`cargo bench --bench solvers`), this says in which of its passes.

// Some of it only the bench of the solvers asks for.
#[allow(dead_code)]
#[path = "solvers/blocks.rs"]
mod blocks;

use divan::counter::{BytesCount, ItemsCount};
use divan::{Bencher, black_box};
use misclosure::adjust::native::kernels::Kernels;
use misclosure::block::Block;
use misclosure::io::block::{read_block, write_block};
use misclosure::math::vectors::{Vectors, use_vectors};
use misclosure::problem::Problem;
use misclosure::scenario::{Scenario, simulate};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

/// Its name in the bench of the solvers.
const BLOCK: &str = "small";
const THREADS: usize = 1;
const WIDTHS: [Vectors; 3] = [Vectors::Plain, Vectors::Avx2, Vectors::Avx512];
/// Tie points of a dike that is read and written.
const POINTS: f64 = 26_300.0;
/// Runs of each: enough for a median that repeats to some per cent.
const RUNS: u32 = 20;

static PLAIN: LazyLock<Problem> = LazyLock::new(|| problem("plain"));
static EACH_STAGE: LazyLock<Problem> = LazyLock::new(|| problem("each stage"));

fn main() {
    divan::main();
}

fn problem(model: &str) -> Problem {
    blocks::block(BLOCK).and_then(|block| blocks::problem(block, model)).expect("a problem")
}

/// Runs `kernel` in one width, unless the processor lacks it; a row without figures says so.
fn run<T>(bencher: Bencher, problem: &'static Problem, width: Vectors, kernel: impl Fn(&Kernels<'_>) -> T + Sync) {
    if !use_vectors(Some(width)) {
        return;
    }
    let kernels = Kernels::new(problem, THREADS).expect("passes");
    bencher.counter(ItemsCount::new(problem.observations.len())).bench(|| kernel(black_box(&kernels)));
    use_vectors(None);
}

/// Derivatives of every measurement, its point eliminated at once.
#[divan::bench(args = WIDTHS, sample_count = RUNS, sample_size = 1)]
fn linearise_plain_camera(bencher: Bencher, width: Vectors) {
    run(bencher, &PLAIN, width, |kernels| kernels.linearise().expect("a pass"));
}

/// The same, with an effect of each stage.
#[divan::bench(args = WIDTHS, sample_count = RUNS, sample_size = 1)]
fn linearise_each_stage(bencher: Bencher, width: Vectors) {
    run(bencher, &EACH_STAGE, width, |kernels| kernels.linearise().expect("a pass"));
}

/// Every point moved by a step, and its measurements projected there.
#[divan::bench(args = WIDTHS, sample_count = RUNS, sample_size = 1)]
fn attempt_plain_camera(bencher: Bencher, width: Vectors) {
    run(bencher, &PLAIN, width, |kernels| kernels.attempt().expect("a step"));
}

/// The same, with an effect of each stage.
#[divan::bench(args = WIDTHS, sample_count = RUNS, sample_size = 1)]
fn attempt_each_stage(bencher: Bencher, width: Vectors) {
    run(bencher, &EACH_STAGE, width, |kernels| kernels.attempt().expect("a step"));
}

/// The reduced system, factorised and solved.
#[divan::bench(sample_count = RUNS, sample_size = 1)]
fn solve_reduced_system(bencher: Bencher) {
    let kernels = Kernels::new(&PLAIN, THREADS).expect("passes");
    bencher.bench(|| black_box(&kernels).solve().expect("positive definite"));
}

fn bytes_in(folder: &Path) -> u64 {
    let files = std::fs::read_dir(folder).expect("a folder");
    files.map(|file| file.and_then(|file| file.metadata()).expect("a file").len()).sum()
}

/// A dike from its folder.
#[divan::bench(sample_count = RUNS, sample_size = 1)]
fn read_tables(bencher: Bencher) {
    let folder = tempfile::tempdir().expect("a folder");
    let block = folder.path().join("block");
    write_block(&simulated(), &block).expect("a block");
    bencher.counter(BytesCount::new(bytes_in(&block))).bench(|| read_block(&block).expect("a block"));
}

/// The same into a folder.
#[divan::bench(sample_count = RUNS, sample_size = 1)]
fn write_tables(bencher: Bencher) {
    let folder = tempfile::tempdir().expect("a folder");
    let (block, path) = (simulated(), folder.path().join("block"));
    write_block(&block, &path).expect("a block");
    bencher.counter(BytesCount::new(bytes_in(&path))).bench(|| write_block(&block, &path).expect("a block"));
}

fn simulated() -> Block {
    let scenario = Scenario::preset("dike", &BTreeMap::from([("points".into(), POINTS)])).expect("a preset");
    simulate(&scenario, 1).expect("a block").block
}
