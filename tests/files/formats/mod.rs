//! Files of other programs: what they say is what the block says, and bad ones are refused with a place.

use crate::beside;
use crate::common;
use crate::small;
mod additions;
mod adjusted;
mod aicon;
mod metashape;
mod micmac;
mod opensfm;
mod photomodeler;
mod pix4d;
mod positions;

use misclosure::block::{Block, ImageId};
use misclosure::camera::fraser::project;
use misclosure::io::Error;
use misclosure::io::block::{read_block, write_block};
use misclosure::io::foreign::{Format, ImportOptions, Imported, Kind, Note, registry};
use nalgebra::Vector3;
use std::path::{Path, PathBuf};

fn format(name: &str) -> &'static dyn Format {
    *registry().iter().find(|format| format.name() == name).unwrap_or_else(|| panic!("no format {name}"))
}

fn try_import(name: &str, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error> {
    format(name).import(paths, options)
}

/// Imports, writes, reads: the block as an adjustment gets it.
fn import(name: &str, paths: &[PathBuf]) -> (Block, Vec<Note>) {
    let imported = try_import(name, paths, &ImportOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let folder = tempfile::tempdir().unwrap();
    write_block(&imported.block, folder.path()).unwrap();
    let loaded = read_block(folder.path()).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!(loaded.set_aside.is_empty(), "an importer leaves nothing to set aside: {}", loaded.set_aside);
    (loaded.block, imported.notes)
}

/// Files of the real samples; `None`, loudly, where they are not at hand.
fn sample(name: &str) -> Option<PathBuf> {
    Some(beside::shared("data/interop")?.join(name))
}

fn has(notes: &[Note], kind: Kind, words: &str) -> bool {
    notes.iter().any(|note| note.kind == kind && note.text.contains(words))
}

fn seen(block: &Block, image: usize, point: &Vector3<f64>) -> [f64; 2] {
    let camera_point = block.images[image].pose.cam_from_world(point);
    project(&block.camera_of(ImageId::from(image)).interior, camera_point.into()).expect("in front of the camera")
}

/// Lengths of the differences between measured and predicted tie points at the coordinates that the files give, px.
fn reprojection_errors(block: &Block) -> Vec<f64> {
    let miss = |tie: &misclosure::block::Measurement| {
        let [x, y] = seen(block, tie.image.index(), &block.tie_points[tie.point.index()].position?);
        Some((x - tie.x).hypot(y - tie.y))
    };
    block.ties.iter().filter_map(miss).collect()
}

/// Root mean square per coordinate, px.
fn rms(lengths: &[f64]) -> f64 {
    (lengths.iter().map(|length| length * length).sum::<f64>() / (2 * lengths.len()) as f64).sqrt()
}

fn write(folder: &Path, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}
