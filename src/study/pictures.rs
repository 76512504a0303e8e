//! What the pictures of a case need, measured from its blocks.

use super::blocks::Blocks;
use super::outcome::Pictures;
use crate::block::{Block, Role};
use crate::camera::{Interior, undistort::undistort};
use crate::evaluate::Comparison;
use crate::evaluate::distortion_field::{FieldVector, Grid, Part, compare_at};
use anyhow::{Context, Result};
use std::collections::HashMap;

/// Cells over the sensor; one vector is shown in each.
const CELLS: Grid = Grid { columns: 24, rows: 18 };

/// Collects it.
///
/// # Errors
/// A camera that cannot be inverted over the sensor; an image without a usable measurement.
pub fn collect(
    blocks: &Blocks<'_>,
    erroneous: &Comparison,
    exact: &Comparison,
    before: &Interior,
    after: &Interior,
) -> Result<Pictures> {
    let injected = injected(blocks)?;
    let places: Vec<[f64; 2]> = injected.iter().map(|vector| vector.at).collect();
    Ok(Pictures {
        erroneous: residuals(erroneous),
        exact: residuals(exact),
        camera_change: compare_at(&places, before, after, Part::WholeCamera)?.vectors,
        injected,
        focal_by_image: focal_by_image(blocks, before)?,
    })
}

fn residuals(comparison: &Comparison) -> Vec<[f64; 5]> {
    let checks = comparison.rows.iter().filter(|row| row.role == Role::Check);
    checks.map(|row| [row.position.x, row.position.y, row.d.x, row.d.y, row.d.z]).collect()
}

/// Exact image points by image and point, ties and marks.
struct Exact<'a>(HashMap<(&'a str, &'a str), [f64; 2]>);

impl<'a> Exact<'a> {
    fn of(block: &'a Block) -> Self {
        let image = |m: &crate::block::Measurement| block.images[m.image.index()].name.as_str();
        let ties = block.ties.iter().map(|m| ((image(m), block.tie_points[m.point.index()].name.as_str()), [m.x, m.y]));
        Self(ties.collect())
    }
}

/// The error of the measurement nearest to the middle of each cell: erroneous minus exact.
fn injected(blocks: &Blocks<'_>) -> Result<Vec<FieldVector>> {
    let exact = Exact::of(blocks.exact);
    let block = blocks.erroneous;
    let camera = block.cameras.first().context("the block has no camera")?;
    let size = [f64::from(camera.width_px), f64::from(camera.height_px)];
    let middles: Vec<[f64; 2]> = CELLS.points(size).collect();
    let cells = [CELLS.columns as f64, CELLS.rows as f64];
    let mut nearest: Vec<Option<(f64, FieldVector)>> = vec![None; middles.len()];
    for tie in &block.ties {
        let key = (block.images[tie.image.index()].name.as_str(), block.tie_points[tie.point.index()].name.as_str());
        let Some(at) = exact.0.get(&key) else { continue };
        let cell = [0, 1].map(|k| (at[k] / size[k] * cells[k]).floor().clamp(0.0, cells[k] - 1.0) as usize);
        let index = cell[1] * CELLS.columns as usize + cell[0];
        let distance = (at[0] - middles[index][0]).hypot(at[1] - middles[index][1]);
        if nearest[index].is_none_or(|(best, _)| distance < best) {
            nearest[index] = Some((distance, FieldVector { at: *at, d: [tie.x - at[0], tie.y - at[1]] }));
        }
    }
    Ok(nearest.into_iter().flatten().map(|(_, vector)| vector).collect())
}

/// Per image the focal length that its measurements and the true orientation have: least squares over
/// `(u, v) - pp = f (X, Y) / Z` with the ideal image point `(u, v)`.
fn focal_by_image(blocks: &Blocks<'_>, camera: &Interior) -> Result<Vec<f64>> {
    let positions: HashMap<&str, _> =
        blocks.truth.tie_points.iter().filter_map(|point| Some((point.name.as_str(), point.position?))).collect();
    let poses: HashMap<&str, _> = blocks.truth.images.iter().map(|image| (image.name.as_str(), image.pose)).collect();
    let block = blocks.erroneous;
    let mut sums = vec![[0.0; 2]; block.images.len()];
    for tie in &block.ties {
        let image = tie.image.index();
        let pose = poses.get(block.images[image].name.as_str());
        let position = positions.get(block.tie_points[tie.point.index()].name.as_str());
        let (Some(pose), Some(position), Some([u, v])) = (pose, position, undistort(camera, [tie.x, tie.y])) else {
            continue;
        };
        let p = pose.cam_from_world(position);
        let (x, y) = (p.x / p.z, p.y / p.z);
        sums[image][0] += x * (u - camera[1]) + y * (v - camera[2]);
        sums[image][1] += x * x + y * y;
    }
    let focal = |(image, [product, square]): (usize, [f64; 2])| {
        (square > 0.0).then(|| product / square).with_context(|| format!("image {image} has no measurement"))
    };
    sums.into_iter().enumerate().map(focal).collect()
}
