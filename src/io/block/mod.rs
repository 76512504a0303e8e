//! A block as a folder: `block.toml` and CSV tables, format 1.
//!
//! ```text
//! block.toml     name, coordinate system, a-priori precision, cameras
//! images.csv     camera, flight, approximate pose of every image, what platform and receiver recorded
//! ties.csv       image measurements of tie points
//! points.csv     optional: approximate coordinates of tie points
//! control.csv    optional: surveyed points, control or check
//! marks.csv      optional: image measurements of surveyed points
//! ```
//!
//! One file here per table. Tie points are numbered in the order of `points.csv`, those without a row there after them
//! in the order of their first measurement; writing a block that was read, and reading it again, gives the same block.

mod block_toml;
mod control;
mod fingerprint;
mod images;
mod measurements;
mod points;

pub use fingerprint::fingerprint;
pub(super) use measurements::OUTSIDE_MARGIN;

use super::csv_table::Table;
use super::error::{Error, Place};
use super::names::Names;
use crate::block::{Block, CameraId, Measurement, SurveyedPoint, TiePoint};
use nalgebra::Vector3;
use std::fmt;
use std::path::Path;

const BLOCK: &str = "block.toml";
const IMAGES: &str = "images.csv";
const TIES: &str = "ties.csv";
const POINTS: &str = "points.csv";
const CONTROL: &str = "control.csv";
const MARKS: &str = "marks.csv";

/// What every block has, for messages.
const EVERY_BLOCK: &str = "every block has block.toml, images.csv and ties.csv";

/// A block and what was left out of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// The block.
    pub block: Block,
    /// What was merely useless and is not in it.
    pub set_aside: SetAside,
}

/// Numbers of things that were in the files, are not wrong, but serve nothing, and are not in the block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SetAside {
    /// Tie points with one ray, left out together with their one measurement.
    pub one_ray_points: usize,
    /// Rows of `points.csv` whose point has no measurement.
    pub unmeasured_points: usize,
    /// Check points without a mark: nothing to compare with. (A control point without a mark is refused.)
    pub unmarked_checks: usize,
    /// Cameras that no image was taken with.
    pub unused_cameras: usize,
    /// Images with a standard deviation of a GNSS position that they do not have.
    pub positionless_gnss_sigmas: usize,
}

impl SetAside {
    /// Nothing was left out.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for SetAside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let items = [
            (self.one_ray_points, "tie point with one ray", "tie points with one ray"),
            (
                self.unmeasured_points,
                "row of points.csv without a measurement",
                "rows of points.csv without a measurement",
            ),
            (self.unmarked_checks, "check point without a mark", "check points without a mark"),
            (self.unused_cameras, "camera without an image", "cameras without an image"),
            (
                self.positionless_gnss_sigmas,
                "GNSS standard deviation without a position",
                "GNSS standard deviations without a position",
            ),
        ];
        let texts: Vec<String> = items
            .into_iter()
            .filter(|(count, ..)| *count > 0)
            .map(|(count, one, many)| format!("{count} {}", if count == 1 { one } else { many }))
            .collect();
        f.write_str(if texts.is_empty() { "nothing" } else { "" })?;
        f.write_str(&texts.join(", "))
    }
}

/// Reads the block in the folder `dir`.
///
/// # Errors
/// The first fault found, in the order `block.toml`, `images.csv`, `points.csv`, `ties.csv`, `control.csv`,
/// `marks.csv`.
pub fn read_block(dir: &Path) -> Result<Loaded, Error> {
    if !dir.is_dir() {
        let problem = format!("this is not a folder; {EVERY_BLOCK}");
        return Err(Error::content(dir.display().to_string(), Place::File, problem));
    }
    let mut set_aside = SetAside::default();
    let mut frame = block_toml::read(dir)?;
    let mut images = images::read(&mut required(dir, IMAGES)?, &frame, &mut set_aside)?;
    let (tie_points, ties) = read_ties(dir, &frame, &images, &mut set_aside)?;
    let (surveyed, marks) = read_surveyed(dir, &frame, &images, &mut set_aside)?;
    if ties.is_empty() && marks.is_empty() {
        let problem = "no tie point is measured in two images, and there are no marks; nothing can be adjusted";
        return Err(Error::content(TIES, Place::File, problem));
    }
    leave_out_unused_cameras(&mut frame, &mut images, &mut set_aside);
    let block = Block {
        name: frame.name,
        crs: frame.crs,
        survey_crs: frame.survey_crs,
        sigma: frame.sigma,
        cameras: frame.cameras,
        flights: images.flights,
        images: images.images,
        tie_points,
        ties,
        surveyed,
        marks,
        origin: Vector3::zeros(),
        extra_image_columns: images.extra_columns,
    };
    Ok(Loaded { block, set_aside })
}

/// Is the folder `dir` a block? It is where it has a `block.toml`.
pub fn is_block(dir: &Path) -> bool {
    dir.join(BLOCK).exists()
}

/// The file that says so, for whoever writes it last.
pub const BLOCK_FILE: &str = BLOCK;

/// Writes a block into the folder `dir`, which is made when it is not there. Tables of an older block in it are
/// replaced; optional ones that this block does not need are removed, so that none of them is read with it.
///
/// # Errors
/// [`Error::Write`]; [`Error::Content`] for NaN or infinity.
///
/// # Panics
/// When an id of the block points at nothing, or an extra column is shorter than the images.
pub fn write_block(block: &Block, dir: &Path) -> Result<(), Error> {
    if block.origin != Vector3::zeros() {
        return write_block(&block.clone().about(Vector3::zeros()), dir);
    }
    std::fs::create_dir_all(dir).map_err(|source| Error::Write { path: dir.to_owned(), source })?;
    block_toml::write(block, &dir.join(BLOCK))?;
    images::write(block, &dir.join(IMAGES))?;
    let image_name = |image: usize| block.images[image].name.as_str();
    measurements::write(&block.ties, image_name, |point| &block.tie_points[point].name, &dir.join(TIES))?;
    if block.tie_points.iter().any(|point| point.position.is_some()) {
        points::write(&block.tie_points, &dir.join(POINTS))?;
    } else {
        remove(&dir.join(POINTS))?;
    }
    if block.surveyed.is_empty() {
        remove(&dir.join(CONTROL))?;
        remove(&dir.join(MARKS))
    } else {
        control::write(&block.surveyed, &dir.join(CONTROL))?;
        measurements::write(&block.marks, image_name, |point| &block.surveyed[point].name, &dir.join(MARKS))
    }
}

/// Writes the images of a block, with all their columns, as the file `path`.
///
/// # Errors
/// As [`write_block`].
///
/// # Panics
/// As [`write_block`].
pub fn write_images(block: &Block, path: &Path) -> Result<(), Error> {
    images::write(block, path)
}

fn required(dir: &Path, file: &'static str) -> Result<Table, Error> {
    let missing = || Error::content(file, Place::File, format!("the file is missing; {EVERY_BLOCK}"));
    Table::open(dir, file)?.ok_or_else(missing)
}

fn remove(path: &Path) -> Result<(), Error> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::Write { path: path.to_owned(), source })
        }
        _ => Ok(()),
    }
}

type Ties = (Vec<TiePoint>, Vec<Measurement>);

fn read_ties(
    dir: &Path,
    frame: &block_toml::ReferenceFrame,
    images: &images::Images,
    set_aside: &mut SetAside,
) -> Result<Ties, Error> {
    let mut names = Names::default();
    let positions = match Table::open(dir, POINTS)? {
        Some(mut table) => points::read(&mut table, &mut names)?,
        None => Vec::new(),
    };
    let mut table = required(dir, TIES)?;
    let sigma = measurements::BlockSigma { value: frame.sigma.tie_px, key: "tie_px" };
    let mut ties = measurements::read(&mut table, frame, images, sigma, |table, column| {
        let name = table.name(column)?;
        match names.find(name) {
            Some(point) => Ok(point),
            None => {
                table.text(column)?;
                Ok(names.insert(name).0)
            }
        }
    })?;
    let rays = measurements::rays_per_point(&table, &ties, names.len(), |point| names.get(point), images)?;
    let tie_points = points::keep_intersecting(&mut ties, &rays, &names, &positions, set_aside);
    Ok((tie_points, ties))
}

type Surveyed = (Vec<SurveyedPoint>, Vec<Measurement>);

fn read_surveyed(
    dir: &Path,
    frame: &block_toml::ReferenceFrame,
    images: &images::Images,
    set_aside: &mut SetAside,
) -> Result<Surveyed, Error> {
    let missing = |file: &str, problem: &str| Err::<Surveyed, Error>(Error::content(file, Place::File, problem));
    let (control, marks) = (Table::open(dir, CONTROL)?, Table::open(dir, MARKS)?);
    let Some(mut control) = control else {
        let measured = match marks {
            Some(mut marks) => marks.next()?,
            None => false,
        };
        let problem = "the file is missing, but marks.csv measures its points";
        return if measured { missing(CONTROL, problem) } else { Ok((Vec::new(), Vec::new())) };
    };
    let (mut surveyed, names) = control::read(&mut control, frame)?;
    let Some(mut table) = marks else {
        if surveyed.is_empty() {
            return Ok((surveyed, Vec::new()));
        }
        return missing(MARKS, "the file is missing, but control.csv has points; they need image measurements");
    };
    let sigma = measurements::BlockSigma { value: frame.sigma.mark_px, key: "mark_px" };
    let mut marks = measurements::read(&mut table, frame, images, sigma, |table, column| {
        let name = table.name(column)?;
        names.find(name).ok_or_else(|| {
            let problem = format!("unknown point {}; marks measure the points of control.csv", table.found(column));
            table.refuse(column, problem)
        })
    })?;
    let rays = measurements::rays_per_point(&table, &marks, names.len(), |point| names.get(point), images)?;
    control::keep_marked(&mut surveyed, &mut marks, &rays, &control, set_aside)?;
    Ok((surveyed, marks))
}

/// A camera that took no image has nothing that could determine it.
fn leave_out_unused_cameras(
    frame: &mut block_toml::ReferenceFrame,
    images: &mut images::Images,
    set_aside: &mut SetAside,
) {
    let mut used = vec![false; frame.cameras.len()];
    for image in &images.images {
        used[image.camera.index()] = true;
    }
    let mut renumbered = Vec::with_capacity(used.len());
    let mut kept = 0;
    for used in &used {
        renumbered.push(CameraId::from(kept));
        kept += usize::from(*used);
    }
    set_aside.unused_cameras = used.len() - kept;
    for image in &mut images.images {
        image.camera = renumbered[image.camera.index()];
    }
    let mut keep = used.iter();
    frame.cameras.retain(|_| keep.next().copied().unwrap_or(true));
}
