//! A block in a folder, from its files to a verdict: `cargo run --release --example folder -- BLOCK` (without one the
//! block of IGN in `data/`).

use misclosure::adjust::Options;
use misclosure::diagnose::{run::diagnose, settings::Settings};
use misclosure::io::block::read_block;
use misclosure::model::{Datum, Model};
use std::path::Path;

/// Reads, diagnoses, prints. Gives the kinds of the mistakes and the effects that are missing.
///
/// # Errors
/// Files that cannot be read, with file, line and column; a block that cannot be adjusted.
pub fn verdict(folder: &Path) -> Result<[Vec<String>; 2], Box<dyn std::error::Error>> {
    let read = read_block(folder)?;
    // A row that serves nothing is left out and counted; one that is wrong would have been an error.
    if !read.set_aside.is_empty() {
        println!("Set aside: {}", read.set_aside);
    }
    // Coordinates of a map have seven digits before the point: the adjustment works about their centre.
    let block = read.block.about_its_centre();
    println!("{}: {} images, {} tie measurements", block.name, block.images.len(), block.ties.len());
    // All twelve camera parameters, GNSS and control; `Model::default` adjusts freely, without a survey.
    let model = Model { datum: Datum::All, ..Model::default() };
    let settings =
        Settings { plugins: &[], options: Options::default(), significance: 1e-3, snoop: true, tell: &|_| {} };
    let diagnosis = diagnose(&block, &model, &settings)?.diagnosis;
    for mistake in &diagnosis.mistakes {
        println!("{}\n  {}", mistake.sentence, mistake.remedy);
    }
    for line in &diagnosis.left {
        println!("Unexplained: {line}");
    }
    // A field over the sensor names no cause: it is described, and not recommended.
    println!("{:?}; missing: {:?}", diagnosis.verdict, diagnosis.recommended);
    Ok([diagnosis.mistakes.into_iter().map(|own| own.kind).collect(), diagnosis.recommended])
}

/// The folder of the command line.
#[allow(dead_code, reason = "a test calls `verdict`")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let given = std::env::args().nth(1).unwrap_or_else(|| "data/ign-borea".into());
    verdict(given.as_ref()).map(drop)
}
