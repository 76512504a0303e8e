//! Blocks from other programs, and back to them: one file or folder here per format, behind [`Format`], in one
//! [`registry`] from which lists, help and guessing follow.
//!
//! A format reads into our own block (`CONVENTIONS.md`), exactly where its formulas allow it; whatever is guessed on
//! the way, or lost, is a [`Note`]. What formats share stands beside them: text ([`text`]), poses ([`pose`]), tie
//! points ([`tracks`]), cameras that are no Fraser camera ([`fit`]), geographic coordinates ([`crate::geodesy`]), and
//! points that prove a transfer ([`verification`]).

mod aicon;
mod binary;
mod blocks_exchange;
mod colmap;
mod exif;
mod fill;
pub mod fit;
mod gcp;
mod gcp_cells;
mod gcp_list;
mod geo;
mod metashape;
mod micmac;
mod mrk;
mod note;
mod opensfm;
mod photomodeler;
mod pix4d;
pub mod pose;
mod positions;
mod sides;
mod single_marks;
mod snavely;
mod system;
pub mod text;
pub mod tracks;
pub mod verification;
mod xml;
mod xml_limits;

pub use note::{Kind, Note};
pub use sides::sides_exchanged;
pub use single_marks::single_marks;

use super::atomic::AtomicFile;
use super::error::{Error, Place};
use crate::block::{Block, FlightId, Image, Measurement, PointId, Sigma, SurveyedPoint};
use crate::camera::Interior;
use std::collections::{HashMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};

/// Between the outer corner of the top-left pixel, where our image coordinates begin, and its centre, where those of
/// some programs do, px.
pub const HALF_PIXEL: f64 = 0.5;

/// What the user asks of an import.
#[derive(Debug, Clone, Default)]
pub struct ImportOptions {
    /// Take a camera that no Fraser camera stands for, however large the difference.
    pub approximate: bool,
    /// A-priori standard deviation of a tie-point image coordinate, px; else [`GUESSED`].
    pub tie_px: Option<f64>,
    /// Width and height of the images, px, for files that do not have them.
    pub size_px: Option<[u32; 2]>,
}

/// What the user asks of an export.
#[derive(Debug, Clone, Copy, Default)]
pub struct ExportOptions {
    /// Write a camera that the other program's formula does not hold as the nearest one that it does.
    pub approximate: bool,
}

/// A block of another program.
#[derive(Debug, Clone)]
pub struct Imported {
    /// As we would have measured it.
    pub block: Block,
    /// Each guess and each loss.
    pub notes: Vec<Note>,
    /// What the files themselves say that their tie points are missed by (RMS, px), where they do.
    pub reported_px: Option<f64>,
}

impl Imported {
    /// From files that say nothing of their own residuals.
    fn new(block: Block, notes: Vec<Note>) -> Self {
        Self { block, notes, reported_px: None }
    }
}

/// A format of another program.
pub trait Format: Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;

    /// What it is, in one line.
    fn about(&self) -> &'static str;

    /// Is `path` surely of this format? By names and first bytes alone.
    fn recognises(&self, path: &Path) -> bool;

    /// Reads a block from the files or folders `paths`, of which there is at least one.
    ///
    /// # Errors
    /// What is wrong in a file and where.
    fn import(&self, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error>;

    /// Writes a block, or says why not; `None` where the format cannot be written at all.
    fn exporter(&self) -> Option<&dyn Exporter> {
        None
    }
}

/// The half of a format that writes.
pub trait Exporter: Sync {
    /// Writes the block into the folder `dir`, which is there and empty; gives each loss as a note.
    ///
    /// # Errors
    /// What the format cannot hold; what cannot be written.
    fn export(&self, block: &Block, dir: &Path, options: &ExportOptions) -> Result<Vec<Note>, Error>;

    /// Numbers of a Fraser camera that the format holds exactly when the others are zero and the centre of distortion
    /// is the principal point; `None` where it holds every Fraser camera.
    fn camera_numbers(&self) -> Option<&'static [usize]> {
        None
    }
}

/// What a camera that a format does not hold can be made into.
const CAMERA_ADVICE: &str = "of a run --correct-measurements puts the difference into the measurements";

/// Something of another program that is added to a block.
pub trait Addition: Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;

    /// What it adds, in one line.
    fn about(&self) -> &'static str;

    /// Files of the block that it may change.
    fn changes(&self) -> &'static [&'static str];

    /// Adds what `paths`, of which there is at least one, say to the block.
    ///
    /// # Errors
    /// What is wrong in a file and where.
    fn add(&self, block: &mut Block, paths: &[PathBuf], options: &ImportOptions) -> Result<Vec<Note>, Error>;
}

/// Every format, in the order of the list.
pub fn registry() -> &'static [&'static dyn Format] {
    &FORMATS
}

static FORMATS: [&dyn Format; 11] = [
    &colmap::BINARY,
    &colmap::TEXT,
    &snavely::Bundler,
    &snavely::Bal,
    &blocks_exchange::BlocksExchange,
    &metashape::Metashape,
    &opensfm::OpenSfm,
    &micmac::MicMac,
    &pix4d::Pix4d,
    &aicon::Aicon,
    &photomodeler::PhotoModeler,
];

/// Everything that can be added to a block, in the order of the list.
pub fn additions() -> &'static [&'static dyn Addition] {
    &[&gcp::Gcp, &mrk::Mrk, &exif::ExifAddition, &geo::Geo]
}

/// Standard deviations for programs that keep none.
pub const GUESSED: Sigma =
    Sigma { tie_px: 0.5, mark_px: 0.5, control_xy_m: 0.02, control_z_m: 0.03, gnss_xy_m: 0.05, gnss_z_m: 0.1 };

/// The standard deviations of a block whose program keeps none: as asked for, else [`GUESSED`], which is said.
pub fn guessed_sigma(options: &ImportOptions, notes: &mut Vec<Note>) -> Sigma {
    if options.tie_px.is_none() {
        let text = format!(
            "the files have no standard deviations: {} px is taken for tie points (--tie-px gives another)",
            GUESSED.tie_px
        );
        notes.push(Note::guess(text));
    }
    Sigma { tie_px: options.tie_px.unwrap_or(GUESSED.tie_px), ..GUESSED }
}

/// The name of a flight that an image belongs to where nothing else is known: the folder in its own name, else
/// `flight`.
pub fn flight_of(image: &str) -> &str {
    image.rfind(['/', '\\']).map_or("flight", |end| &image[..end])
}

/// Flights by the folders in the names of the images, which are numbered with them.
fn flights(images: &mut [Image]) -> Vec<String> {
    let mut flights: Vec<String> = Vec::new();
    for image in images {
        let flight = flight_of(&image.name);
        let number = flights.iter().position(|other| other == flight).unwrap_or_else(|| {
            flights.push(flight.to_owned());
            flights.len() - 1
        });
        image.flight = FlightId::from(number);
    }
    flights
}

/// Writes an imported block into `dir`, its notes as comments at the top of `block.toml`.
///
/// # Errors
/// As [`super::block::write_block`].
pub fn write_imported(imported: &Imported, dir: &Path) -> Result<(), Error> {
    super::block::write_block(&imported.block, dir)?;
    let path = dir.join(super::block::BLOCK_FILE);
    let block = super::read_text(&path).map_err(|source| Error::Read { path: path.clone(), source })?;
    let line = |note: &Note| format!("# {}\n", note.to_string().replace(char::is_control, " "));
    let comments: String = imported.notes.iter().map(line).collect();
    super::write_atomically(&path, (comments + &block).as_bytes())
}

/// What a format without surveyed points, positions of the receiver and times does not hold of a block.
fn not_held(block: &Block) -> Vec<Note> {
    let gnss = block.images.iter().filter(|image| image.gnss.is_some()).count();
    let timed = block.images.iter().filter(|image| image.time_s.is_some()).count();
    let what = [
        (block.surveyed.len(), "surveyed points with their marks"),
        (gnss, "GNSS positions"),
        (timed, "exposure times"),
    ];
    let held = what.into_iter().filter(|(count, _)| *count > 0);
    held.map(|(count, name)| Note::loss(format!("{count} {name} have no place in this format"))).collect()
}

/// Writes a file as `fill` writes it, whole or not at all.
fn write_file(path: &Path, fill: impl FnOnce(&mut dyn io::Write) -> io::Result<()>) -> Result<(), Error> {
    let mut file = AtomicFile::create(path)?;
    fill(&mut file).map_err(|source| Error::Write { path: path.to_owned(), source })?;
    file.commit()
}

/// The one file of a folder whose name ends so.
fn file_that_ends(folder: &Path, end: &str) -> Result<Option<PathBuf>, Error> {
    let failed = |source| Error::Read { path: folder.to_owned(), source };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(end)) {
            found.push(path);
        }
    }
    match found.len() {
        0 | 1 => Ok(found.pop()),
        count => Err(refuse(folder, format!("{count} files end with {end}; expected one"))),
    }
}

/// Control points that no image measures serve nothing.
fn keep_seen(surveyed: &mut Vec<SurveyedPoint>, marks: &mut [Measurement], notes: &mut Vec<Note>) {
    let seen: HashSet<PointId> = marks.iter().map(|mark| mark.point).collect();
    let mut kept = 0;
    let mut renumbered = HashMap::new();
    let mut old = (0..).map(PointId);
    let before = surveyed.len();
    surveyed.retain(|_| {
        let Some(point) = old.next().filter(|point| seen.contains(point)) else { return false };
        renumbered.insert(point, PointId(kept));
        kept += 1;
        true
    });
    marks.iter_mut().for_each(|mark| mark.point = renumbered[&mark.point]);
    if surveyed.len() < before {
        let count = before - surveyed.len();
        notes.push(Note::loss(format!("{count} control points are measured in no image: left out")));
    }
}

/// The block as cameras of a format would have seen it: its cameras the nearest that the format holds, and every image
/// point moved by what the cameras differ there. Gives the most that one was moved by, px.
///
/// # Errors
/// A camera that nothing of the format comes near.
pub fn with_cameras_of(exporter: &dyn Exporter, block: &mut Block) -> Result<f64, Error> {
    let Some(numbers) = exporter.camera_numbers() else { return Ok(0.0) };
    let before: Vec<Interior> = block.cameras.iter().map(|camera| camera.interior).collect();
    for camera in &mut block.cameras {
        let nearest = fit::nearest_with(camera, numbers);
        let problem = format!("camera {}: no camera of the format comes near it over the whole sensor", camera.id);
        camera.interior = nearest.ok_or_else(|| Error::content("block", Place::File, problem))?.parameters;
    }
    let ties: Vec<_> = block.tie_points.iter().map(|point| point.position).collect();
    let surveyed: Vec<_> = block.surveyed.iter().map(|point| Some(point.position)).collect();
    let (images, cameras) = (&block.images, &block.cameras);
    let mut most = 0.0;
    for (measurements, points) in [(&mut block.ties, &ties), (&mut block.marks, &surveyed)] {
        for seen in measurements {
            let image = &images[seen.image.index()];
            let Some(point) = points[seen.point.index()] else { continue };
            let ray = image.pose.cam_from_world(&point).into();
            let project = |interior| crate::camera::fraser::project(interior, ray);
            let camera = image.camera.index();
            let Some(([x, y], [a, b])) = project(&cameras[camera].interior).zip(project(&before[camera])) else {
                continue;
            };
            (seen.x, seen.y) = (seen.x + x - a, seen.y + y - b);
            most = f64::max(most, (x - a).hypot(y - b));
        }
    }
    Ok(most)
}

/// Refuses a file as a whole.
pub fn refuse(path: &Path, problem: impl Into<String>) -> Error {
    Error::content(path.display().to_string(), Place::File, problem)
}
