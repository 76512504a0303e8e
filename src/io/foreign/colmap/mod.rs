//! COLMAP: a model as a folder of binary or text files.
//!
//! ```text
//! cameras    model and parameters                                     points3D   coordinates and tracks
//! images     pose (cam_from_world), camera, image points              rigs, frames   of newer models; not needed for poses
//! ```
//!
//! Axes and pixels are ours. Ids are numbers in any order; images come in the order of their names, points in that of
//! their ids. Source: COLMAP, `doc/format.rst`, `src/colmap/scene/reconstruction_io_binary.cc`.

mod cameras;
#[cfg(feature = "database")]
mod database;
mod model;
mod read_binary;
mod read_text;
mod reported;
mod write;

use super::super::error::Error;
use super::{ExportOptions, Exporter, Format, ImportOptions, Imported, Note, refuse, verification};
use crate::block::Block;
use crate::camera::{F, K1, K2, K3, P1, P2, PPX, PPY};
use std::path::{Path, PathBuf};
use write::Form;

/// Models in binary files.
pub static BINARY: Colmap = Colmap { form: Form::Binary };
/// Models in text files.
pub static TEXT: Colmap = Colmap { form: Form::Text };

/// A form of COLMAP's models. Either reads both.
pub struct Colmap {
    form: Form,
}

/// Files without which there is no model.
const FILES: [&str; 3] = ["cameras", "images", "points3D"];

impl Format for Colmap {
    fn name(&self) -> &'static str {
        match self.form {
            Form::Binary => "colmap",
            Form::Text => "colmap-text",
        }
    }

    fn about(&self) -> &'static str {
        match self.form {
            Form::Binary if cfg!(feature = "database") => {
                "COLMAP model, a folder: either form is read, binary is written; database.db after it gives GNSS"
            }
            Form::Binary => {
                "COLMAP model, a folder: either form is read, binary is written (GNSS from a database.db: not in this \
                 build, which lacks the feature database)"
            }
            Form::Text => "the same, written as text",
        }
    }

    fn recognises(&self, path: &Path) -> bool {
        // One of the two answers for both.
        self.form == Form::Binary && form_of(path).is_some()
    }

    fn import(&self, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error> {
        let (folder, database) = match paths {
            [folder] => (folder, None),
            [folder, database] => (folder, Some(database)),
            _ => {
                return Err(refuse(
                    &paths[0],
                    "expected the folder of one model, and after it at most its database.db",
                ));
            }
        };
        let Some(form) = form_of(folder) else {
            let problem = "this is no COLMAP model: a folder with cameras, images and points3D, all .bin or all .txt \
                           (often sparse/0)";
            return Err(refuse(folder, problem));
        };
        let model = match form {
            Form::Binary => read_binary::read(folder)?,
            Form::Text => read_text::read(folder)?,
        };
        let mut imported = model.finish(folder, options)?;
        if let Some(database) = database {
            add_database(&mut imported, database)?;
        }
        verification::check(&imported.block, folder, options.approximate, &mut imported.notes)?;
        Ok(imported)
    }

    fn exporter(&self) -> Option<&dyn Exporter> {
        Some(self)
    }
}

impl Exporter for Colmap {
    fn export(&self, block: &Block, dir: &Path, options: &ExportOptions) -> Result<Vec<Note>, Error> {
        write::write(block, dir, self.form, options)
    }

    fn camera_numbers(&self) -> Option<&'static [usize]> {
        Some(&[F, PPX, PPY, K1, K2, K3, P1, P2])
    }
}

/// The form of the model in a folder; where both are, binary, as in COLMAP.
fn form_of(folder: &Path) -> Option<Form> {
    let has = |extension: &str| FILES.iter().all(|name| folder.join(name).with_extension(extension).is_file());
    [(Form::Binary, "bin"), (Form::Text, "txt")].into_iter().find(|(_, extension)| has(extension)).map(|(form, _)| form)
}

#[cfg(feature = "database")]
fn add_database(imported: &mut Imported, path: &Path) -> Result<(), Error> {
    database::add(&mut imported.block, path, &mut imported.notes)
}

#[cfg(not(feature = "database"))]
fn add_database(_: &mut Imported, path: &Path) -> Result<(), Error> {
    Err(refuse(path, "this build reads no databases: build it with Cargo's feature database"))
}
