//! The block of a file, with the reading of its distortion that its measurements support.

use super::super::super::error::Error;
use super::super::tracks::Tracks;
use super::super::{ImportOptions, Imported, Note, flights, guessed_sigma, refuse};
use super::distortion::{READINGS, Reading};
use super::read::{Contents, Photo, Sight};
use crate::block::{Block, CameraId, FlightId, Image, ImageId, Measurement, PointId, SurveyedPoint};
use crate::camera::fraser::project;
use crate::camera::{Camera, Interior};
use nalgebra::Vector3;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Below this difference of two readings' residuals (px) the measurements do not tell them apart.
const TOLD_APART_PX: f64 = 1e-6;

pub(super) fn assemble(contents: Contents, file: &Path, options: &ImportOptions) -> Result<Imported, Error> {
    let Contents { name, crs, cameras: of_file, photos, ties, surveyed, mut notes, unoriented } = contents;
    if photos.is_empty() {
        return Err(refuse(file, "no photo has a pose"));
    }
    if unoriented > 0 {
        notes.push(Note::loss(format!("{unoriented} photos are left out: they have no pose")));
    }
    let names = names(&photos);
    let mut distinct = HashSet::new();
    if let Some(twice) = names.iter().find(|name| !distinct.insert(**name)) {
        return Err(refuse(file, format!("two photos are called {twice:?}; expected different names")));
    }
    let numbers: HashMap<&str, ImageId> =
        photos.iter().enumerate().map(|(k, photo)| (photo.id.as_str(), ImageId::from(k))).collect();
    let mut seen = Seen { numbers: &numbers, elsewhere: 0 };
    let mut tracks = Tracks::default();
    for (k, (position, sights)) in ties.into_iter().enumerate() {
        let point = tracks.point((k + 1).to_string(), position);
        seen.by(&sights).into_iter().for_each(|(image, xy)| tracks.measure(image, point, xy));
    }
    let (tie_points, ties) = tracks.finish(&mut notes);
    let (mut points, mut marks) = (Vec::new(), Vec::new());
    for point in surveyed {
        let images = seen.by(&point.sights);
        if images.is_empty() {
            notes.push(Note::loss(format!(
                "surveyed point {} is left out: no photo with a pose measures it",
                point.name
            )));
            continue;
        }
        let number = PointId::from(points.len());
        marks.extend(images.into_iter().map(|(image, [x, y])| Measurement { image, point: number, x, y, sigma: None }));
        let [sigma_xy, sigma_z] = point.sigma;
        points.push(SurveyedPoint { name: point.name, position: point.position, role: point.role, sigma_xy, sigma_z });
    }
    if seen.elsewhere > 0 {
        notes.push(Note::loss(format!("{} measurements are left out: their photos have no pose", seen.elsewhere)));
    }
    let images = photos
        .iter()
        .zip(&names)
        .map(|(photo, name)| Image::new((*name).to_owned(), CameraId::from(photo.camera), FlightId(0), photo.pose));
    let mut images: Vec<Image> = images.collect();
    let cameras = of_file.iter().enumerate().map(|(k, camera)| {
        // Names of photogroups may be missing, and may repeat.
        let is_first = !camera.name.is_empty() && of_file[..k].iter().all(|other| other.name != camera.name);
        let id = if is_first { camera.name.clone() } else { format!("{}{}", camera.name, k + 1) };
        let [width_px, height_px] = camera.size;
        Camera { id, width_px, height_px, pixel_um: None, interior: [0.0; 12] }
    });
    let cameras: Vec<Camera> = cameras.collect();
    let mut block = Block {
        name: if name.is_empty() { "blocks-exchange".into() } else { name },
        crs,
        survey_crs: String::new(),
        origin: Vector3::zeros(),
        sigma: guessed_sigma(options, &mut notes),
        cameras,
        flights: flights(&mut images),
        images,
        tie_points,
        ties,
        surveyed: points,
        marks,
        extra_image_columns: Vec::new(),
    };
    for k in 0..of_file.len() {
        let reading = if of_file[k].distorts() { told(&mut block, k, &of_file[k], &mut notes) } else { READINGS[0] };
        let fit = of_file[k].fraser(reading).ok_or_else(|| {
            refuse(file, format!("camera {}: no Fraser camera comes near it over the whole image", block.cameras[k].id))
        })?;
        let id = block.cameras[k].id.clone();
        block.cameras[k].interior = match reading.forward {
            true => fit.parameters,
            false => fit.judge(&file.display().to_string(), &id, options.approximate, &mut notes)?,
        };
    }
    Ok(Imported::new(block, notes))
}

/// Names of the photos: their paths, of absolute ones without the folder that holds them all.
fn names(photos: &[Photo]) -> Vec<&str> {
    let is_absolute = |path: &str| path.starts_with(['/', '\\']) || path.get(1..2) == Some(":");
    let folder = |path: &str| path.rfind(['/', '\\']).map_or(0, |end| end + 1);
    let Some(first) = photos.first().map(|photo| photo.path.as_str()).filter(|path| is_absolute(path)) else {
        return photos.iter().map(|photo| photo.path.as_str()).collect();
    };
    let common = |shared: usize, path: &str| {
        let same = first.bytes().zip(path.bytes()).take(shared).take_while(|(a, b)| a == b).count();
        // Of bytes that are the same the last separator ends a whole folder.
        first.as_bytes()[..same].iter().rposition(|byte| matches!(byte, b'/' | b'\\')).map_or(0, |end| end + 1)
    };
    let shared = photos.iter().fold(folder(first), |shared, photo| common(shared, &photo.path));
    photos.iter().map(|photo| photo.path.get(shared..).unwrap_or(&photo.path)).collect()
}

/// Photos by their ids.
struct Seen<'a> {
    numbers: &'a HashMap<&'a str, ImageId>,
    /// Measurements in photos that are not there.
    elsewhere: usize,
}

impl Seen<'_> {
    fn by(&mut self, sights: &[Sight]) -> Vec<(ImageId, [f64; 2])> {
        let known: Vec<_> =
            sights.iter().filter_map(|sight| Some((*self.numbers.get(sight.photo.as_str())?, sight.xy))).collect();
        self.elsewhere += sights.len() - known.len();
        known
    }
}

/// The reading of a camera's distortion with the least residuals.
fn told(block: &mut Block, camera: usize, of_file: &super::distortion::FileCamera, notes: &mut Vec<Note>) -> Reading {
    let mut tried: Vec<(f64, Reading)> = Vec::new();
    for reading in READINGS {
        if let Some(rms) = of_file.fraser(reading).and_then(|fit| rms_px(block, camera, &fit.parameters)) {
            tried.push((rms, reading));
        }
    }
    // Stable: of equals the first, which is what this program writes.
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let id = &block.cameras[camera].id;
    let Some((least, best)) = tried.first().copied() else {
        let text = format!("camera {id}: no measured point has coordinates; taken as {}", READINGS[0].describe());
        notes.push(Note::guess(text));
        return READINGS[0];
    };
    if let Some((rms, _)) = tried.iter().find(|(rms, _)| rms - least > TOLD_APART_PX) {
        let (found, other) = (format!("{least:.3}"), format!("{rms:.3}"));
        notes.push(Note::guess(format!(
            "camera {id}: {}, whose residuals are {found} px RMS; the next reading of its coefficients has {other} px",
            best.describe()
        )));
    }
    best
}

/// Root mean square of the residuals (px per coordinate) of a camera's measurements of points with coordinates; `None`
/// of none.
fn rms_px(block: &Block, camera: usize, interior: &Interior) -> Option<f64> {
    let tie = |tie: &Measurement| block.tie_points[tie.point.index()].position.map(|point| (*tie, point));
    let mark = |mark: &Measurement| (*mark, block.surveyed[mark.point.index()].position);
    let measured = block.ties.iter().filter_map(tie).chain(block.marks.iter().map(mark));
    let (mut sum, mut count) = (0.0, 0usize);
    for (measurement, point) in measured {
        let image = &block.images[measurement.image.index()];
        if image.camera.index() != camera {
            continue;
        }
        if let Some([x, y]) = project(interior, image.pose.cam_from_world(&point).into()) {
            sum += (measurement.x - x).powi(2) + (measurement.y - y).powi(2);
            count += 2;
        }
    }
    (count > 0).then(|| (sum / count as f64).sqrt())
}
