//! A block that another program adjusted, judged by surveyed points that it has not seen: `cargo run --release
//! --example evaluate`.

use misclosure::evaluate::{Alignment, Method, PlainModel, compare};
use misclosure::io::foreign::{ExportOptions, ImportOptions, registry};
use misclosure::scenario::{Scenario, simulate};
use misclosure::{block::Block, inject};

/// What another program hands on: a COLMAP model. Here it is written first, from a block whose focal length is 20 px
/// off.
fn of_another_program(block: &Block, folder: &std::path::Path) -> Result<Block, Box<dyn std::error::Error>> {
    let colmap = registry().iter().find(|format| format.name() == "colmap-text").ok_or("no such format")?;
    let mut handed = inject::apply(block, block, &[inject::parse("calibration:f=20")?], 1)?.block;
    // COLMAP knows neither an affinity nor a centre of distortion of its own.
    handed.cameras.iter_mut().for_each(|camera| camera.interior[3..].fill(0.0));
    let exporter = colmap.exporter().ok_or("it cannot be written")?;
    exporter.export(&handed, folder, &ExportOptions::default())?;
    Ok(colmap.import(&[folder.to_owned()], &ImportOptions::default())?.block)
}

/// Reads, compares, prints.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut measured = simulate(&Scenario::preset("mapping", &[("points".to_string(), 500.0)].into())?, 1)?.block;
    measured.surveyed.truncate(60);
    measured.marks.retain(|mark| mark.point.index() < 60);
    let folder = tempfile::tempdir()?;
    let adjusted = of_another_program(&measured, folder.path())?;
    // Its cameras and poses, with our marks and surveyed points; a similarity from the control points takes it to the
    // survey.
    let mut judged = measured.clone();
    for image in &mut judged.images {
        let theirs = adjusted.images.iter().find(|other| other.name == image.name).ok_or("an image is missing")?;
        image.pose = theirs.pose;
    }
    judged.cameras[0].interior = adjusted.cameras[0].interior;
    let comparison = compare(&PlainModel::of_block(&judged), &judged, Alignment::FromControl, Method::Image)?;
    let check = comparison.check.ok_or("no check points")?;
    let [space, height] = [check.rms_m.xyz, check.rms_m.z].map(|metres| 1e3 * metres);
    println!("{} check points: {space:.1} mm RMS in space, {height:.1} mm in height", check.n);
    assert!(check.rms_m.xyz > 1e-3, "a focal length that is 20 px off does not go unseen");
    Ok(())
}
