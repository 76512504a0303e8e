//! BlocksExchange XML: of ContextCapture (iTwin Capture), written by Metashape, Pix4D and RealityCapture too.
//!
//! Cameras, poses, tie points, control and check points with their marks in one file, in a stated coordinate system.
//! Rotations take world to camera, x right and y down; image coordinates count from the centre of the top-left pixel.
//! Source: the vendor's commented example, in StOriJimmy/libBATools.

mod assemble;
mod distortion;
mod read;
mod records;
mod write;

use super::super::error::Error;
use super::{ExportOptions, Exporter, Format, ImportOptions, Imported, Note, refuse, verification};
use crate::block::Block;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The root element.
const ROOT: &str = "BlocksExchange";
/// First bytes of a file among which its root element stands.
const HEAD_BYTES: u64 = 1024;

/// The format.
pub struct BlocksExchange;

impl Format for BlocksExchange {
    fn name(&self) -> &'static str {
        "blocks-exchange"
    }

    fn about(&self) -> &'static str {
        "BlocksExchange XML of ContextCapture, Metashape, Pix4D, RealityCapture: ties, control and check points"
    }

    fn recognises(&self, path: &Path) -> bool {
        let head = || {
            let mut head = Vec::new();
            crate::io::open(path).ok()?.take(HEAD_BYTES).read_to_end(&mut head).ok()?;
            Some(String::from_utf8_lossy(&head).contains(&format!("<{ROOT}")))
        };
        path.is_file() && head().unwrap_or(false)
    }

    fn import(&self, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error> {
        let [file] = paths else { return Err(refuse(&paths[0], "expected one file")) };
        let mut imported = assemble::assemble(read::read(file)?, file, options)?;
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        verification::check(&imported.block, folder, options.approximate, &mut imported.notes)?;
        Ok(imported)
    }

    fn exporter(&self) -> Option<&dyn Exporter> {
        Some(self)
    }
}

impl Exporter for BlocksExchange {
    fn export(&self, block: &Block, dir: &Path, options: &ExportOptions) -> Result<Vec<Note>, Error> {
        write::write(block, dir, options)
    }

    fn camera_numbers(&self) -> Option<&'static [usize]> {
        Some(&write::NUMBERS)
    }
}
