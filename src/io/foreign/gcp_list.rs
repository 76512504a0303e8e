//! `gcp_list.txt` of ODM and OpenSfM: surveyed points and where they were seen.
//!
//! ```text
//! WGS84 UTM 32N                    the coordinate system
//! X Y Z column row image [name]    blanks between; pixels count from the CENTRE of the top-left one
//! ```
//!
//! Source: OpenSfM, `doc/source/gcp`, and ODM, "Ground control points". Rows of one point have one name, or the same
//! coordinates.

use super::super::error::{Error, Place, shown};
use super::text::{Line, Lines};
use super::{HALF_PIXEL, Note};
use crate::block::{ImageId, Measurement, PointId, Role, SurveyedPoint};
use crate::geodesy::crs::Crs;
use crate::geodesy::geographic::Geographic;
use nalgebra::Vector3;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// What WebODM begins the names of check points with.
const CHECK_PREFIX: &str = "CHK-";

/// The list as it stands in the file.
pub(super) struct GcpList {
    file: String,
    crs: Crs,
    /// Its name, as the file has it.
    pub system: String,
    rows: Vec<Row>,
}

struct Row {
    line: u64,
    name: String,
    /// The height is `None` where it is not known.
    position: ([f64; 2], Option<f64>),
    image: String,
    /// From the outer corner of the top-left pixel, px.
    xy: [f64; 2],
}

/// Check points have names of their own; everything else is control.
pub(super) fn role_of(name: &str) -> Role {
    if name.starts_with(CHECK_PREFIX) { Role::Check } else { Role::Control }
}

/// Reads a list.
///
/// # Errors
/// What is wrong in it and where.
pub(super) fn read(path: &Path) -> Result<GcpList, Error> {
    let file = path.display().to_string();
    let mut lines = Lines::open(path)?;
    let (crs, system) = {
        let line = lines.expect_words("the coordinate system")?;
        let crs = Crs::parse(line.text()).map_err(|problem| line.refuse(problem))?;
        (crs, line.text().trim().to_owned())
    };
    let mut rows: Vec<Row> = Vec::new();
    let mut name_at: HashMap<[u64; 3], String> = HashMap::new();
    while let Some(line) = lines.next_words()? {
        rows.push(row(line, &mut name_at)?);
    }
    // All heights zero means that nobody knew them.
    if rows.iter().all(|row| row.position.1 == Some(0.0)) {
        rows.iter_mut().for_each(|row| row.position.1 = None);
    }
    Ok(GcpList { file, crs, system, rows })
}

fn row(mut line: Line<'_>, name_at: &mut HashMap<[u64; 3], String>) -> Result<Row, Error> {
    let [x, y] = line.numbers("X and Y")?;
    let z = line.word("Z")?;
    let height = match z.parse::<f64>() {
        Ok(height) if height.is_finite() => Some(height),
        Ok(height) if height.is_nan() => None,
        _ => return Err(line.refuse(format!("Z: expected a number or NaN, found {}", shown(z.as_bytes())))),
    };
    let [column, row] = line.numbers("pixel coordinates")?;
    let image = line.word("the image")?.to_owned();
    let name = match line.rest() {
        "" => {
            let next = name_at.len() + 1;
            let key = [x, y, height.unwrap_or(f64::INFINITY)].map(f64::to_bits);
            name_at.entry(key).or_insert_with(|| format!("gcp {next}")).clone()
        }
        name => name.to_owned(),
    };
    Ok(Row { line: line.place(), name, position: ([x, y], height), image, xy: [column + HALF_PIXEL, row + HALF_PIXEL] })
}

impl GcpList {
    /// Places of the points whose height is known.
    ///
    /// # Errors
    /// Places that the coordinate system does not have.
    pub(super) fn places(&self) -> Result<Vec<Geographic>, Error> {
        let known = self.rows.iter().filter_map(|row| Some((row, row.position.0, row.position.1?)));
        known
            .map(|(row, [x, y], height)| {
                let place = self.crs.place([x, y, height]);
                place.map_err(|problem| Error::content(&self.file, Place::Line(row.line), problem))
            })
            .collect()
    }

    /// Points and marks; `position` takes places to the block. What cannot be used is said.
    ///
    /// # Errors
    /// Rows that contradict each other, places that the system does not have.
    pub(super) fn in_system(
        &self,
        position: &dyn Fn(&Geographic) -> Result<Vector3<f64>, String>,
        image_of: &dyn Fn(&str) -> Option<ImageId>,
        notes: &mut Vec<Note>,
    ) -> Result<(Vec<SurveyedPoint>, Vec<Measurement>), Error> {
        let refuse = |row: &Row, problem: String| Error::content(&self.file, Place::Line(row.line), problem);
        let (mut points, mut marks) = (Vec::new(), Vec::new());
        let mut first_of: HashMap<&str, (&Row, PointId)> = HashMap::new();
        let mut seen = HashSet::new();
        let (mut strange, mut heightless) = (0, 0);
        for row in &self.rows {
            let ([x, y], Some(height)) = row.position else {
                heightless += 1;
                continue;
            };
            let Some(image) = image_of(&row.image) else {
                strange += 1;
                continue;
            };
            let next = PointId::from(points.len());
            let (first, point) = *first_of.entry(&row.name).or_insert((row, next));
            if first.position != row.position {
                let name = shown(row.name.as_bytes());
                let problem = format!("point {name} has other coordinates than in line {}", first.line);
                return Err(refuse(row, problem));
            }
            if !seen.insert((point, image)) {
                let names = [&row.name, &row.image].map(|name| shown(name.as_bytes()));
                return Err(refuse(row, format!("point {} is measured twice in image {}", names[0], names[1])));
            }
            if point == next {
                let placed = self.crs.place([x, y, height]).and_then(|place| position(&place));
                let position = placed.map_err(|problem| refuse(row, problem))?;
                let (name, role) = (row.name.clone(), role_of(&row.name));
                points.push(SurveyedPoint { name, position, role, sigma_xy: None, sigma_z: None });
            }
            marks.push(Measurement { image, point, x: row.xy[0], y: row.xy[1], sigma: None });
        }
        for (count, what) in [
            (strange, "are in images that the block does not have: left out"),
            (heightless, "are of points without a known height: left out"),
        ] {
            if count > 0 {
                notes.push(Note::loss(format!("{count} marks of {} {what}", self.file)));
            }
        }
        if !marks.is_empty() {
            let text =
                "pixels of the list are taken to count from the centre of the top-left pixel: half a pixel is added";
            notes.push(Note::guess(text));
        }
        Ok((points, marks))
    }
}
