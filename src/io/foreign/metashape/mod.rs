//! Agisoft Metashape: projects (`.psz`, `.psx`), and the cameras and markers that it exports as XML.
//!
//! ```text
//! .psz                 zip of doc.xml and the PLY files that it names
//! .psx                 a pointer to NAME.files/project.zip: doc.xml, then 0/chunk.zip, 0/0/frame.zip, 0/0/point_cloud/point_cloud.zip
//! cameras.xml          the chunk without its frames; markers.xml: the markers, and where they were seen
//! ```
//!
//! Image coordinates begin at the outer corner of the top-left pixel, as ours. A pose takes the camera (x right, y
//! down, z forward) to the chunk, a similarity takes the chunk to the world; where the chunk has a coordinate system
//! other than a local one, that world is Earth-centred.

mod archive;
mod assemble;
mod calibration;
mod document;
mod offset;
mod ply;
mod project;
mod rig;
mod world;
mod write;

use super::super::error::Error;
use super::{Exporter, Format, ImportOptions, Imported, verification};
use std::path::{Path, PathBuf};

/// The format.
pub struct Metashape;

impl Format for Metashape {
    fn name(&self) -> &'static str {
        "metashape"
    }

    fn about(&self) -> &'static str {
        "Agisoft Metashape: .psz, .psx, or cameras.xml with markers.xml; out: cameras.xml"
    }

    fn recognises(&self, path: &Path) -> bool {
        let has = |extension: &str| path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension));
        has("psz") || has("psx") || (has("xml") && project::is_document(path))
    }

    fn import(&self, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error> {
        let mut notes = Vec::new();
        let project = project::read(paths, &mut notes)?;
        let block = assemble::block(project, options, &mut notes)?;
        let folder = paths[0].parent().unwrap_or(Path::new(""));
        verification::check(&block, folder, options.approximate, &mut notes)?;
        Ok(Imported::new(block, notes))
    }

    fn exporter(&self) -> Option<&dyn Exporter> {
        Some(self)
    }
}
