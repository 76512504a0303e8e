//! PhotoModeler's text export.
//!
//! ```text
//! title / tolerance iterations width height / nine standard deviations / f x0 y0 W H K1 K2 K3 P1 P2 / their standard deviations
//! of each photo: id name / id X Y Z kappa phi omega / id their standard deviations / covariances or nothing / id f x0 ... / id ...
//! control points, object points: id X Y Z sX sY sZ     marks: photo point x y sx sy     (an empty line between the lists)
//! ```
//!
//! Lengths of the camera are mm on a sensor of W x H mm; x0, y0 count from its top left corner. The distortion takes
//! the *measured* point to the ideal one, with y up: `x (1 + K1 r^2 + K2 r^4 + K3 r^6) + P1 (r^2 + 2 x^2) + 2 P2 x y`,
//! y alike. Marks are pixels from the outer corner of the top-left one. Source: DBAT, `loadpm.m`, and its published
//! reports.

use super::super::error::{Error, shown};
use super::fit::{Formula, fit_fraser};
use super::text::{Line, Lines};
use super::tracks::Tracks;
use super::{Format, GUESSED, ImportOptions, Imported, Note, keep_seen, pose, refuse};
use crate::block::{Block, Image, ImageId, Measurement, PointId, Pose, Role, Sigma, SurveyedPoint};
use crate::camera::Camera;
use nalgebra::Vector3;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// The cameras of single photos are written with three decimals: one that differs from the first line's by no more is
/// that one.
const ROUNDING_MM: f64 = 5.1e-4;
/// Words in the line of a photo's camera.
const CAMERA_WORDS: usize = 11;

/// The format.
pub struct PhotoModeler;

impl Format for PhotoModeler {
    fn name(&self) -> &'static str {
        "photomodeler"
    }

    fn about(&self) -> &'static str {
        "PhotoModeler's text export"
    }

    fn recognises(&self, path: &Path) -> bool {
        let Ok(mut lines) = Lines::open(path) else { return false };
        let first = lines.next_line().is_ok_and(|line| line.is_some_and(|line| line.text().contains("PhotoModeler")));
        let second = lines.next_line().is_ok_and(|line| line.is_some_and(|mut line| line.numbers::<4>("").is_ok()));
        first && second
    }

    fn import(&self, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error> {
        if let [_, more, ..] = paths {
            return Err(refuse(more, "expected one file"));
        }
        let mut notes = Vec::new();
        let block = block(&paths[0], options, &mut notes)?;
        Ok(Imported::new(block, notes))
    }
}

/// The numbers of the formula, mm.
#[derive(Clone, Copy, PartialEq)]
struct Backward([f64; 10]);

impl Backward {
    /// The ray of an image point in an image of `size` px.
    fn ray(&self, [x, y]: [f64; 2], size: [f64; 2]) -> [f64; 2] {
        let [f, x0, y0, width, height, k1, k2, k3, p1, p2] = self.0;
        let (x, y) = (x * width / size[0] - x0, y0 - y * height / size[1]);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let ideal_x = x * radial + p1 * (r2 + 2.0 * x * x) + 2.0 * p2 * x * y;
        let ideal_y = y * radial + p2 * (r2 + 2.0 * y * y) + 2.0 * p1 * x * y;
        [ideal_x / f, -ideal_y / f]
    }

    fn camera(
        &self,
        id: String,
        size: [u32; 2],
        file: &str,
        approximate: bool,
        notes: &mut Vec<Note>,
    ) -> Result<Camera, Error> {
        let [f, x0, y0, width, height, k1, ..] = self.0;
        let sides = size.map(f64::from);
        let per_mm = sides[1] / height;
        let pp = [x0 * sides[0] / width, y0 * per_mm];
        let start = [f * per_mm, pp[0], pp[1], pp[0], pp[1], -k1 / per_mm.powi(2), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let backward = |xy: [f64; 2]| Some(self.ray(xy, sides));
        let fit = fit_fraser(&Formula::Backward(&backward), size, &start, true)
            .ok_or_else(|| refuse(Path::new(file), "no Fraser camera comes near the camera of this file"))?;
        let pixel_um = Some(1000.0 * height / sides[1]);
        let interior = fit.judge(file, &id, approximate, notes)?;
        Ok(Camera { id, width_px: size[0], height_px: size[1], pixel_um, interior })
    }
}

fn backward(line: &mut Line<'_>) -> Result<Backward, Error> {
    let numbers = line.numbers::<10>("f, x0, y0, W, H, K1, K2, K3, P1, P2 of the camera")?;
    match numbers[0] > 0.0 && numbers[3] > 0.0 && numbers[4] > 0.0 {
        true => Ok(Backward(numbers)),
        false => Err(line.refuse("expected a focal length and a sensor above zero")),
    }
}

struct Photo {
    path: String,
    pose: Pose,
    camera: Backward,
}

fn block(path: &Path, options: &ImportOptions, notes: &mut Vec<Note>) -> Result<Block, Error> {
    let file = path.display().to_string();
    let mut lines = Lines::open(path)?;
    let title = lines.next_line()?.map(|line| line.rest().to_owned()).unwrap_or_default();
    let size = {
        let mut line = lines.expect_words("tolerance, iterations and the size of the images")?;
        line.numbers::<2>("tolerance and iterations")?;
        let given =
            (!line.is_empty()).then(|| Ok::<_, Error>([line.whole("width")?, line.whole("height")?])).transpose()?;
        let size = given.or(options.size_px).filter(|size: &[u32; 2]| size[0] > 0 && size[1] > 0);
        size.ok_or_else(|| line.refuse("has no size of the images; give --size WIDTHxHEIGHT"))?
    };
    lines.expect_words("nine standard deviations")?.numbers::<9>("a standard deviation")?;
    let shared = backward(&mut lines.expect_words("the camera")?)?;
    lines.expect_words("the camera's standard deviations")?.numbers::<10>("a standard deviation")?;
    let mut photo_of_id: HashMap<u64, ImageId> = HashMap::new();
    let mut photos: Vec<Photo> = Vec::new();
    while let Some((id, photo)) = photo(&mut lines, &shared)? {
        if photo_of_id.insert(id, photos.len().into()).is_some() {
            return Err(lines.refuse(format!("photo {id} stands twice")));
        }
        photos.push(photo);
    }
    let control = points(&mut lines)?;
    let objects = points(&mut lines)?;
    let mut tracks = Tracks::default();
    let mut surveyed: Vec<SurveyedPoint> = Vec::new();
    let mut numbers: HashMap<String, (bool, PointId)> = HashMap::new();
    for (name, position, sigma) in control {
        let point = (true, PointId::from(surveyed.len()));
        if numbers.insert(name.clone(), point).is_some() {
            return Err(refuse(path, format!("control point {} stands twice", shown(name.as_bytes()))));
        }
        let above_zero = |sigma: f64| (sigma > 0.0).then_some(sigma);
        let sigma_xy = above_zero(((sigma[0] * sigma[0] + sigma[1] * sigma[1]) / 2.0).sqrt());
        surveyed.push(SurveyedPoint { name, position, role: Role::Control, sigma_xy, sigma_z: above_zero(sigma[2]) });
    }
    for (name, position, _) in objects {
        let point = |name: &String| (false, tracks.point(name.as_str(), Some(position)));
        numbers.entry(name).or_insert_with_key(point);
    }
    let mut marks = read_marks(&mut lines, &photo_of_id, &mut numbers, &mut tracks)?;
    let (tie_points, ties) = tracks.finish(notes);
    keep_seen(&mut surveyed, &mut marks, notes);
    let (cameras, camera_of) = cameras(&photos, size, &file, options.approximate, notes)?;
    notes.push(Note::fact(
        "object points are tie points; control points are those of the list of control points, which may be empty",
    ));
    let repeated = repeated_names(&photos);
    let image = |(k, photo): (usize, &Photo)| {
        Image::new(
            if repeated { photo.path.clone() } else { file_name(&photo.path).to_owned() },
            camera_of[k].into(),
            0.into(),
            photo.pose,
        )
    };
    Ok(Block {
        name: if title.is_empty() { "photomodeler".into() } else { title },
        crs: "local".into(),
        survey_crs: String::new(),
        sigma: Sigma { tie_px: options.tie_px.unwrap_or(GUESSED.tie_px), ..GUESSED },
        cameras,
        flights: vec!["flight".into()],
        images: photos.iter().enumerate().map(image).collect(),
        tie_points,
        ties,
        surveyed,
        marks,
        origin: Vector3::zeros(),
        extra_image_columns: Vec::new(),
    })
}

/// The next photo; `None` at the empty line after the last.
fn photo(lines: &mut Lines, shared: &Backward) -> Result<Option<(u64, Photo)>, Error> {
    let Some(mut line) = lines.next_line()?.filter(|line| !line.is_empty()) else { return Ok(None) };
    let id: u64 = line.whole("the photo's number")?;
    let path = line.rest().to_owned();
    if path.is_empty() {
        return Err(line.refuse("expected the photo's number and its file"));
    }
    let mut line = lines.expect_words("the photo's position and angles")?;
    line.whole::<u64>("the photo's number")?;
    let centre = Vector3::from(line.numbers::<3>("the photo's position")?);
    let [kappa, phi, omega] = line.numbers::<3>("kappa, phi, omega")?.map(f64::to_radians);
    let rotation = pose::from_omega_phi_kappa([omega, phi, kappa]);
    lines.expect_words("standard deviations of the photo")?;
    // Covariances may stand between.
    let mut camera = loop {
        let line = lines.expect_words("the photo's camera")?;
        if line.text().split_whitespace().count() >= CAMERA_WORDS {
            let mut line = line;
            line.whole::<u64>("the photo's number")?;
            break backward(&mut line)?;
        }
    };
    lines.expect_words("standard deviations of the photo's camera")?;
    if camera.0.iter().zip(shared.0).all(|(own, shared)| (own - shared).abs() <= ROUNDING_MM) {
        camera = *shared;
    }
    Ok(Some((id, Photo { path, pose: Pose { rotation, centre }, camera })))
}

type Point = (String, Vector3<f64>, [f64; 3]);

/// A list of points, up to the next empty line.
fn points(lines: &mut Lines) -> Result<Vec<Point>, Error> {
    let mut points = Vec::new();
    while let Some(mut line) = lines.next_line()?.filter(|line| !line.is_empty()) {
        let name = line.word("the point")?.to_owned();
        let position = line.numbers::<3>("its coordinates")?.into();
        let sigma = if line.is_empty() { [0.0; 3] } else { line.numbers("their standard deviations")? };
        points.push((name, position, sigma));
    }
    Ok(points)
}

fn read_marks(
    lines: &mut Lines,
    photos: &HashMap<u64, ImageId>,
    numbers: &mut HashMap<String, (bool, PointId)>,
    tracks: &mut Tracks,
) -> Result<Vec<Measurement>, Error> {
    let mut marks = Vec::new();
    let mut seen = HashSet::new();
    while let Some(mut line) = lines.next_line()?.filter(|line| !line.is_empty()) {
        let photo: u64 = line.whole("the photo's number")?;
        let image = *photos.get(&photo).ok_or_else(|| line.refuse(format!("there is no photo {photo}")))?;
        let name = line.word("the point")?.to_owned();
        let [x, y, sx, sy] = line.numbers("x, y and their standard deviations")?;
        let sigma = Some(((sx * sx + sy * sy) / 2.0).sqrt()).filter(|sigma| *sigma > 0.0);
        let next = || (false, tracks.point(name.as_str(), None));
        let (is_control, point) = *numbers.entry(name.clone()).or_insert_with(next);
        let measurement = Measurement { image, point, x, y, sigma };
        if !seen.insert((is_control, point, image)) {
            return Err(line.refuse(format!("point {} is measured twice in photo {photo}", shown(name.as_bytes()))));
        }
        match is_control {
            true => marks.push(measurement),
            false => tracks.push(measurement),
        }
    }
    Ok(marks)
}

type Cameras = (Vec<Camera>, Vec<usize>);

fn cameras(
    photos: &[Photo],
    size: [u32; 2],
    file: &str,
    approximate: bool,
    notes: &mut Vec<Note>,
) -> Result<Cameras, Error> {
    let mut different: Vec<Backward> = Vec::new();
    let camera_of = photos.iter().map(|photo| {
        different.iter().position(|other| *other == photo.camera).unwrap_or_else(|| {
            different.push(photo.camera);
            different.len() - 1
        })
    });
    let camera_of = camera_of.collect();
    let camera = |(k, camera): (usize, &Backward)| {
        let id = if different.len() == 1 { "cam".into() } else { format!("cam{}", k + 1) };
        camera.camera(id, size, file, approximate, notes)
    };
    Ok((different.iter().enumerate().map(camera).collect::<Result<_, _>>()?, camera_of))
}

fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

fn repeated_names(photos: &[Photo]) -> bool {
    let mut names = HashSet::new();
    photos.iter().any(|photo| !names.insert(file_name(&photo.path)))
}
