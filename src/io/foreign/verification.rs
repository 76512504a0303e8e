//! Points that prove a transfer: `verification.csv` beside exported files has ten points of the world and where images
//! see them. Whoever reads the files can compute the image points anew; our own importers do.

use super::super::csv_table::Table;
use super::super::error::Error;
use super::super::table::TableWriter;
use super::Note;
use crate::block::{Block, ImageId};
use crate::camera::fraser::project;
use crate::camera::undistort::viewing_ray;
use crate::math::statistics::median;
use nalgebra::Vector3;
use std::collections::HashMap;
use std::path::Path;

/// The file.
pub const FILE: &str = "verification.csv";
/// Points.
const COUNT: usize = 10;
/// A point that is missed by more (px) was not read as it was written.
const TOLERANCE_PX: f64 = 1e-3;
/// Depth of the points (m) in images without tie points.
const DEPTH_M: f64 = 10.0;
/// Places on the sensor, as parts of its sides, from the middle to the corners: where distortion is large, a mistake in
/// it is.
const PLACES: [[f64; 2]; 5] = [[0.5, 0.5], [0.05, 0.1], [0.95, 0.85], [0.1, 0.95], [0.9, 0.05]];

/// Writes points of `block` as the files beside hold it into `dir`.
///
/// # Errors
/// What cannot be written.
pub fn write(block: &Block, dir: &Path) -> Result<(), Error> {
    let mut table = TableWriter::create(&dir.join(FILE), &["world_x", "world_y", "world_z", "image", "x", "y"])?;
    for k in 0..COUNT.min(PLACES.len() * block.images.len()) {
        // Images from all of the block, first to last.
        let image = ImageId::from(k * block.images.len() / COUNT.min(PLACES.len() * block.images.len()));
        let Some((point, [x, y])) = sample(block, image, PLACES[k % PLACES.len()]) else { continue };
        table.number(point.x).number(point.y).number(point.z).text(&block.images[image.index()].name);
        table.number(x).number(y).end_row()?;
    }
    table.finish()
}

/// A point of the world that an image sees near a place of its sensor, and where.
fn sample(block: &Block, image: ImageId, [across, down]: [f64; 2]) -> Option<(Vector3<f64>, [f64; 2])> {
    let camera = block.camera_of(image);
    let pose = &block.images[image.index()].pose;
    let place = [f64::from(camera.width_px) * across, f64::from(camera.height_px) * down];
    let ray = viewing_ray(&camera.interior, place)?;
    let point = pose.centre + pose.rotation.inverse() * ray * depth(block, image);
    // Computed anew: of large coordinates the point has lost digits.
    Some((point, project(&camera.interior, pose.cam_from_world(&point).into())?))
}

/// Median distance of the tie points of an image, m.
fn depth(block: &Block, image: ImageId) -> f64 {
    let pose = &block.images[image.index()].pose;
    let of_image = block.ties.iter().filter(|tie| tie.image == image);
    let positions = of_image.filter_map(|tie| block.tie_points[tie.point.index()].position);
    let depths: Vec<f64> = positions.map(|point| pose.cam_from_world(&point).norm()).collect();
    if depths.is_empty() { DEPTH_M } else { median(&depths) }
}

/// Compares a block with the verification points in `dir`, where there are any; images that it does not have are passed
/// over.
///
/// # Errors
/// A point that is missed, with by how much, unless differences were asked for (`approximate`): then it is a note.
pub fn check(block: &Block, dir: &Path, approximate: bool, notes: &mut Vec<Note>) -> Result<(), Error> {
    let Some(mut table) = Table::open(dir, FILE)? else { return Ok(()) };
    let world = table.columns(["world_x", "world_y", "world_z"])?;
    let [image, x, y] = table.columns(["image", "x", "y"])?;
    let images: HashMap<&str, usize> = block.images.iter().enumerate().map(|(k, i)| (i.name.as_str(), k)).collect();
    let (mut compared, mut worst) = (0, 0.0);
    while table.next()? {
        let point = table.vector(world)?;
        let stated = [table.number(x)?, table.number(y)?];
        let Some(image_number) = images.get(table.text(image)?) else { continue };
        let seen = block.images[*image_number].pose.cam_from_world(&point);
        let found = project(&block.camera_of(ImageId::from(*image_number)).interior, seen.into());
        let miss = found.map_or(f64::INFINITY, |[x, y]| (x - stated[0]).hypot(y - stated[1]));
        if miss > TOLERANCE_PX && !approximate {
            let problem = format!(
                "image {} sees this point {miss:.3e} px from where it was written, more than {TOLERANCE_PX} px. The \
                 transfer is wrong, or the files were changed since (then remove {FILE})",
                block.images[*image_number].name
            );
            return Err(table.refuse_row(problem));
        }
        (compared, worst) = (compared + 1, f64::max(worst, miss));
    }
    let text = format!("{compared} points of {FILE} are met to {worst:.1e} px");
    notes.push(if worst > TOLERANCE_PX { Note::loss(text) } else { Note::detail(text) });
    Ok(())
}
