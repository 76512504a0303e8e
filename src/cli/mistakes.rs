//! Mistakes of people in a block, as commands ask for them.

use crate::adjust::Options;
use crate::block::Block;
use crate::diagnose::settings::Settings;
use crate::diagnose::two_cameras::under_one_name;
use crate::io::block::read_block;
use crate::mistakes::Mistake;
use crate::model::Model;
use crate::run::default_diagnosis_datum;
use crate::screening;
use std::path::Path;

/// Significance level: the probability that a block without any misfit or mistake gets a finding.
pub const SIGNIFICANCE: f64 = 0.001;

/// Mistakes in a block that was read.
pub fn of_block(block: Block, threads: usize) -> Vec<Mistake> {
    let options = Options { threads, ..Options::default() };
    screening::mistakes(&block.about_its_centre(), &Model::default(), SIGNIFICANCE, &options)
}

/// Mistakes that only an adjustment of the block shows: two cameras under one name.
///
/// # Errors
/// An adjustment that fails.
pub fn of_adjusted(folder: &Path, threads: usize) -> anyhow::Result<Vec<Mistake>> {
    let block = read_block(folder)?.block.about_its_centre();
    let model = Model { datum: default_diagnosis_datum(&block), ..Model::default() };
    let options = Options { threads, ..Options::default() };
    let settings = Settings { plugins: &[], options, significance: SIGNIFICANCE, snoop: true, tell: &|_| {} };
    Ok(under_one_name(&block, &model, &settings)?)
}

/// Mistakes in a block that comes from another program. `reported_px`: what that program says that its tie points are
/// missed by.
pub fn of_imported(block: Block, reported_px: Option<f64>, threads: usize) -> Vec<Mistake> {
    let own_points = screening::of_own_points(&block, reported_px);
    let mut found = of_block(block, threads);
    // Where measurements, poses or cameras are recorded wrongly, tie points are missed for that reason.
    let explained =
        |own: &Mistake| ["ties", "images", "camera"].contains(&own.subject.as_str()) && !own.mend.is_empty();
    if !found.iter().any(explained) {
        // `mend` looks at a block as `check` does, where residuals of another program are not known any more.
        found.extend(own_points.into_iter().map(|own| own.undone_by(Vec::new())));
    }
    found
}

/// Mistakes in the block of a folder.
///
/// # Errors
/// A block that cannot be read.
pub fn screened(folder: &Path, threads: usize) -> anyhow::Result<Vec<Mistake>> {
    Ok(of_block(read_block(folder)?.block, threads))
}
