//! Writes the block of a recipe as somebody would receive it, without its truth:
//! `cargo run --release --example hidden -- data/hidden/dike-rolling-shutter.toml BLOCK`

use anyhow::{Context, Result};
use misclosure::inject::recipe;
use misclosure::io::block::write_block;
use std::path::PathBuf;

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let usage = "two arguments: the recipe and the folder of the block";
    let (path, output) = (arguments.next().context(usage)?, arguments.next().context(usage)?);
    let made = recipe::read(&path)?.build()?;
    write_block(&made.block, &output)?;
    println!(
        "{}: {} images, {} tie measurements, {} outliers",
        output.display(),
        made.block.images.len(),
        made.block.ties.len(),
        made.report.outliers.len()
    );
    Ok(())
}
