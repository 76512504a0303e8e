//! Mistakes of people in a block, as commands ask for them.

use crate::adjust::Options;
use crate::block::Block;
use crate::diagnose::screening;
use crate::io::block::read_block;
use crate::mistakes::Mistake;
use crate::model::Model;
use std::path::Path;

/// Probability with which an adequate block is told that something is missing, or wrong.
pub const SIGNIFICANCE: f64 = 0.001;

/// Mistakes in a block that was read.
pub fn of_block(block: Block, threads: usize) -> Vec<Mistake> {
    let options = Options { threads, ..Options::default() };
    screening::mistakes(&block.about_its_centre(), &Model::default(), SIGNIFICANCE, &options)
}

/// Mistakes in the block of a folder.
///
/// # Errors
/// A block that cannot be read.
pub fn screened(folder: &Path, threads: usize) -> anyhow::Result<Vec<Mistake>> {
    Ok(of_block(read_block(folder)?.block, threads))
}
