//! A small block, and the way through a format.

use misclosure::block::Block;
use misclosure::camera::Interior;
use misclosure::camera::fraser::project;
use misclosure::io::Error;
use misclosure::io::foreign::{ExportOptions, Exporter, Format, ImportOptions, Imported, Note, registry};
use misclosure::scenario::{Scenario, simulate};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Coordinates may lose the last digits of a 64-bit number of metres on the way through `t = -R C`.
pub const ROUNDING_M: f64 = 1e-12;

/// A close-range block with tie points, control and check points, measured without error by a camera of these numbers.
pub fn block(interior: Interior) -> Block {
    let overrides = BTreeMap::from([("points".to_string(), 60.0)]);
    let scenario = Scenario::preset("closerange", &overrides).expect("a preset");
    let mut block = simulate(&scenario, 1).expect("it can be simulated").block;
    assert_eq!(block.cameras.len(), 1);
    block.cameras[0].interior = interior;
    let pose = |k: &misclosure::block::Measurement| block.images[k.image.index()].pose;
    let ideal = |pose: misclosure::block::Pose, point: &Vector3<f64>| {
        project(&interior, pose.cam_from_world(point).into()).expect("in front")
    };
    for tie in &mut block.ties {
        let point = block.tie_points[tie.point.index()].position.expect("coordinates");
        [tie.x, tie.y] = ideal(pose(tie), &point);
    }
    for mark in &mut block.marks {
        [mark.x, mark.y] = ideal(pose(mark), &block.surveyed[mark.point.index()].position);
    }
    block
}

/// The twelve numbers of the camera of the close-range block, with these coefficients `k1, k2, k3, p1, p2, b1, b2`.
pub fn camera(coefficients: [f64; 7]) -> Interior {
    let [k1, k2, k3, p1, p2, b1, b2] = coefficients;
    [5500.0, 2571.3, 1907.9, 2571.3, 1907.9, k1, k2, k3, p1, p2, b1, b2]
}

/// A format of the registry.
pub fn format(name: &str) -> &'static dyn Format {
    *registry().iter().find(|format| format.name() == name).expect("a format")
}

/// Writes a block into a folder.
pub fn export(name: &str, block: &Block, dir: &Path, approximate: bool) -> Result<Vec<Note>, Error> {
    let exporter: &dyn Exporter = format(name).exporter().expect("a format that is written");
    exporter.export(block, dir, &ExportOptions { approximate })
}

/// Reads a file or folder.
pub fn import(name: &str, path: &Path, options: &ImportOptions) -> Result<Imported, Error> {
    format(name).import(&[PathBuf::from(path)], options)
}

/// Name, place and coordinates of every measurement, sorted.
pub fn measurements(block: &Block) -> Vec<(String, String, [f64; 2])> {
    let row = |tie: &misclosure::block::Measurement| {
        let image = block.images[tie.image.index()].name.clone();
        (image, block.tie_points[tie.point.index()].name.clone(), [tie.x, tie.y])
    };
    let mut rows: Vec<_> = block.ties.iter().map(row).collect();
    rows.sort_by(|a, b| (&a.0, &a.1).cmp(&(&b.0, &b.1)));
    rows
}

/// The largest distance of two blocks' projection centres and tie points (m), and angle between their rotations (rad);
/// images by name.
pub fn apart(a: &Block, b: &Block) -> [f64; 2] {
    let (mut metres, mut radians) = (0.0, 0.0);
    for image in &a.images {
        let other = b.images.iter().find(|other| other.name == image.name).expect("the same images");
        metres = f64::max(metres, (image.pose.centre - other.pose.centre).norm());
        // Of small angles the sine of the half, which angle_to() loses.
        let turn = image.pose.rotation.inverse() * other.pose.rotation;
        radians = f64::max(radians, 2.0 * turn.vector().norm());
    }
    [metres, radians]
}
