//! Ground control and its marks, added to a block: `gcp_list.txt`, `ground_control_points.json`, or tables of
//! comma-separated values.
//!
//! ```text
//! points   #CoordinateSystem: ... (Metashape; else the block's)   name,x,y,z[,horizontal,vertical accuracy]   a header or none
//! marks    image,name,column,row       pixels from the outer corner of the top-left one
//! ```

use super::super::error::{Error, Place, shown};
use super::fill::ImagesByName;
use super::gcp_cells::Cells;
use super::opensfm::{pixels, reconstruction};
use super::single_marks::single_marks;
use super::system::BlockSystem;
use super::text::Lines;
use super::{Addition, GUESSED, ImportOptions, Note, gcp_list, refuse};
use crate::block::{Block, Measurement, PointId, Role, SurveyedPoint};
use crate::geodesy::crs::Crs;
use crate::geodesy::geographic::{Geographic, stated_sigma};
use std::path::{Path, PathBuf};

/// What Metashape writes before the coordinate system of a table.
const SYSTEM: &str = "#CoordinateSystem:";
/// Coordinates (m) and marks (px) that differ by less are the same.
const SAME: f64 = 1e-6;

/// The addition.
pub struct Gcp;

/// What a file says, in the block's terms.
#[derive(Default)]
struct Found {
    points: Vec<SurveyedPoint>,
    /// Image, point, px.
    marks: Vec<(String, String, [f64; 2])>,
}

impl Addition for Gcp {
    fn name(&self) -> &'static str {
        "gcp"
    }

    fn about(&self) -> &'static str {
        "ground control and marks: gcp_list.txt, ground_control_points.json, CSV of points and of marks"
    }

    fn changes(&self) -> &'static [&'static str] {
        &["control.csv", "marks.csv", "block.toml"]
    }

    fn add(&self, block: &mut Block, paths: &[PathBuf], _: &ImportOptions) -> Result<Vec<Note>, Error> {
        let mut notes = Vec::new();
        let mut found = Found::default();
        for path in paths {
            let extension = path.extension().map(|extension| extension.to_ascii_lowercase()).unwrap_or_default();
            match extension.to_str() {
                Some("json") => json(path, block, &mut found, &mut notes)?,
                Some("csv") => table(path, block, &mut found, &mut notes)?,
                _ => list(path, block, &mut found, &mut notes)?,
            }
        }
        merge(block, found, &paths[0], &mut notes)?;
        notes.extend(single_marks(block));
        Ok(notes)
    }
}

fn system_of(
    path: &Path,
    block: &mut Block,
    places: &[Geographic],
    notes: &mut Vec<Note>,
) -> Result<BlockSystem, Error> {
    BlockSystem::of(block, places, notes).map_err(|problem| refuse(path, problem))
}

fn list(path: &Path, block: &mut Block, found: &mut Found, notes: &mut Vec<Note>) -> Result<(), Error> {
    let list = gcp_list::read(path)?;
    let places = list.places()?;
    if places.is_empty() {
        return Err(refuse(path, "has no point with a height"));
    }
    let system = system_of(path, block, &places, notes)?;
    let images = ImagesByName::of(block);
    let image_of = |name: &str| images.find(name);
    let (points, marks) = list.in_system(&|place| system.position(place), &image_of, notes)?;
    for mark in marks {
        let image = block.images[mark.image.index()].name.clone();
        found.marks.push((image, points[mark.point.index()].name.clone(), [mark.x, mark.y]));
    }
    found.points.extend(points);
    if block.survey_crs.is_empty() && block.crs != list.system {
        block.survey_crs = list.system;
    }
    Ok(())
}

fn json(path: &Path, block: &mut Block, found: &mut Found, notes: &mut Vec<Note>) -> Result<(), Error> {
    let control: reconstruction::GroundControl = reconstruction::read(path)?;
    let place = |point: &reconstruction::GroundControlPoint| {
        let position = point.position?;
        let (latitude, longitude) = (position.latitude, position.longitude);
        Some(
            Geographic::checked(latitude, longitude, position.altitude?)
                .map_err(|problem| refuse(path, format!("point {}: {problem}", shown(point.id.as_bytes())))),
        )
    };
    let place = |point: &_| place(point).transpose().map(Option::flatten);
    let mut places: Vec<Geographic> = Vec::new();
    for point in &control.points {
        places.extend(place(point)?);
    }
    if places.is_empty() {
        return Err(refuse(path, "has no point with latitude, longitude and altitude"));
    }
    let system = system_of(path, block, &places, notes)?;
    let images = ImagesByName::of(block);
    let mut left_out = 0;
    for point in &control.points {
        let Some(place) = place(point)? else {
            left_out += 1;
            continue;
        };
        let position = system.position(&place).map_err(|problem| refuse(path, problem))?;
        let role =
            if point.role.as_deref() == Some("metrics_only") { Role::Check } else { gcp_list::role_of(&point.id) };
        found.points.push(SurveyedPoint { name: point.id.clone(), position, role, sigma_xy: None, sigma_z: None });
        for seen in &point.observations {
            let Some(image) = images.find(&seen.shot_id) else { continue };
            let camera = block.camera_of(image);
            let sides = [camera.width_px, camera.height_px].map(f64::from);
            let name = block.images[image.index()].name.clone();
            found.marks.push((name, point.id.clone(), pixels(seen.projection, sides)));
        }
    }
    if left_out > 0 {
        notes.push(Note::loss(format!("{left_out} points have no position with an altitude: left out")));
    }
    Ok(())
}

/// A table of points or of marks: of marks where the first cell names an image of the block.
fn table(path: &Path, block: &mut Block, found: &mut Found, notes: &mut Vec<Note>) -> Result<(), Error> {
    let mut lines = Lines::open(path)?;
    let images = ImagesByName::of(block);
    let (mut crs, mut written) = (None, None);
    let mut rows: Vec<(u64, String, Vec<f64>)> = Vec::new();
    while let Some(line) = lines.next_line()? {
        if let Some(wkt) = line.text().trim().strip_prefix(SYSTEM) {
            let wkt = wkt.trim().trim_matches('"').replace("\"\"", "\"");
            crs = Some(Crs::parse(&wkt).map_err(|problem| line.refuse(problem))?);
            continue;
        }
        if line.is_empty() || line.is_comment() {
            continue;
        }
        let is_first = written.is_none();
        let written = *written.get_or_insert(Cells::of(line.text()));
        let cells = written.split(line.text());
        if is_first && written.is_header(&cells).map_err(|problem| line.refuse(problem))? {
            continue;
        }
        let number = |cell: &str| written.number(cell).map_err(|problem| line.refuse(problem));
        if let (Some(image), [_, name, x, y]) = (cells.first().and_then(|cell| images.find(cell)), &cells[..]) {
            let image = block.images[image.index()].name.clone();
            found.marks.push((image, (*name).to_owned(), [number(x)?, number(y)?]));
            continue;
        }
        let [name, rest @ ..] = &cells[..] else { continue };
        if name.is_empty() || !(3..=6).contains(&rest.len()) {
            return Err(line.refuse(
                "expected name,x,y,z with accuracies or without, or image,name,column,row of an image of the block",
            ));
        }
        let filled = rest.iter().filter(|cell| !cell.is_empty());
        rows.push((line.place(), (*name).to_owned(), filled.map(|cell| number(cell)).collect::<Result<_, _>>()?));
    }
    let refuse_row =
        |line: u64, problem: String| Error::content(path.display().to_string(), Place::Line(line), problem);
    let mut places = Vec::new();
    for (line, name, values) in &rows {
        let [x, y, z, ..] = values[..] else {
            return Err(refuse_row(*line, format!("point {}: expected x, y and z", shown(name.as_bytes()))));
        };
        if let Some(crs) = &crs {
            places.push(crs.place([x, y, z]).map_err(|problem| refuse_row(*line, problem))?);
        }
    }
    let system = match places.is_empty() {
        true => None,
        false => Some(system_of(path, block, &places, notes)?),
    };
    if system.is_none() && !rows.is_empty() {
        let text = format!("{} names no coordinate system: its points are taken to be in the block's", path.display());
        notes.push(Note::guess(text));
    }
    for (k, (line, name, values)) in rows.into_iter().enumerate() {
        let position = match &system {
            Some(system) => system.position(&places[k]).map_err(|problem| refuse_row(line, problem))?,
            None => [values[0], values[1], values[2]].into(),
        };
        let sigmas: Vec<Option<f64>> = values[3..]
            .iter()
            .map(|sigma| stated_sigma(*sigma))
            .collect::<Result<_, _>>()
            .map_err(|p| refuse_row(line, p))?;
        let above_zero = |k: usize| sigmas.get(k - 3).copied().flatten();
        // One accuracy is of all three, two are horizontal and vertical, three of x, y, z.
        let (sigma_xy, sigma_z) = match values.len() {
            6 => (above_zero(3).zip(above_zero(4)).map(|(x, y)| ((x * x + y * y) / 2.0).sqrt()), above_zero(5)),
            5 => (above_zero(3), above_zero(4)),
            _ => (above_zero(3), above_zero(3)),
        };
        let role = gcp_list::role_of(&name);
        found.points.push(SurveyedPoint { name, position, role, sigma_xy, sigma_z });
    }
    Ok(())
}

/// What is there stays: a point or a mark of the same name that is another is refused.
fn merge(block: &mut Block, found: Found, path: &Path, notes: &mut Vec<Note>) -> Result<(), Error> {
    let mut unmarked = 0;
    for point in found.points {
        let name = shown(point.name.as_bytes());
        match block.surveyed.iter().find(|other| other.name == point.name) {
            Some(other) if (other.position - point.position).norm() <= SAME => {}
            Some(_) => {
                return Err(refuse(path, format!("point {name} is in control.csv with other coordinates; rename one")));
            }
            None if !found.marks.iter().any(|(_, of, _)| *of == point.name) => unmarked += 1,
            None => block.surveyed.push(point),
        }
    }
    let images = ImagesByName::of(block);
    let mut unknown = 0;
    for (image, name, [x, y]) in found.marks {
        let Some(image) = images.find(&image) else { continue };
        let Some(point) = block.surveyed.iter().position(|point| point.name == name) else {
            unknown += 1;
            continue;
        };
        let point = PointId::from(point);
        match block.marks.iter().find(|mark| (mark.image, mark.point) == (image, point)) {
            Some(mark) if (mark.x - x).hypot(mark.y - y) <= SAME => {}
            Some(_) => {
                let names = [&name, &block.images[image.index()].name].map(|name| shown(name.as_bytes()));
                let problem =
                    format!("point {} is marked elsewhere in image {}; take one mark out", names[0], names[1]);
                return Err(refuse(path, problem));
            }
            None => block.marks.push(Measurement { image, point, x, y, sigma: None }),
        }
    }
    for (count, what) in [
        (unmarked, "points are marked in no image of the block: left out"),
        (unknown, "marks are of points without coordinates: left out"),
    ] {
        if count > 0 {
            notes.push(Note::loss(format!("{count} {what}")));
        }
    }
    let sigma = &mut block.sigma;
    let guesses = [
        (&mut sigma.mark_px, GUESSED.mark_px, "px for marks"),
        (&mut sigma.control_xy_m, GUESSED.control_xy_m, "m for horizontal coordinates"),
        (&mut sigma.control_z_m, GUESSED.control_z_m, "m for heights"),
    ];
    for (sigma, guess, what) in guesses {
        if sigma.is_infinite() {
            *sigma = guess;
            notes.push(Note::guess(format!("the block has no standard deviation of them: {guess} {what} are taken")));
        }
    }
    Ok(())
}
