//! OpenSfM, and ODM, which stands on it.
//!
//! ```text
//! reconstruction.json           cameras, poses, points; the world is east, north, up at reference_lla
//! tracks.csv                    image track feature x y [scale] r g b [segmentation instance], separated by tabs
//! ground_control_points.json    surveyed points and where they were seen
//! gcp_list.txt                  the same as ODM takes them, and the older OpenSfM
//! ```
//!
//! Image coordinates are `(column - w/2) / S` and `(row - h/2) / S`, `S` the longer side: of a point whose coordinates
//! begin at the outer corner of the top-left pixel, as ours. Source: OpenSfM, `features.py` and `doc/source/geometry`.

mod camera;
pub(super) mod reconstruction;
mod survey;
mod tracks;

use super::super::error::{Error, Place, shown};
use super::fit::{Fit, Formula, fit_fraser};
use super::{Format, ImportOptions, Imported, Note, flight_of, guessed_sigma, pose, refuse};
use crate::block::{Block, Gnss, Image, ImageId};
use crate::camera::Camera;
use crate::geodesy::geographic::{Geographic, LocalSystem};
use nalgebra::{UnitQuaternion, Vector3};
use reconstruction::{Reconstruction, Reference, Shot};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

const RECONSTRUCTION: &str = "reconstruction.json";
/// Where OpenSfM does not use the altitudes of its images, it puts one for all of them: heights that differ by no more
/// (m) were not measured.
const EQUAL_HEIGHTS_M: f64 = 0.01;

/// The format.
pub struct OpenSfm;

impl Format for OpenSfm {
    fn name(&self) -> &'static str {
        "opensfm"
    }

    fn about(&self) -> &'static str {
        "OpenSfM and ODM: the folder of reconstruction.json and tracks.csv, with ground control"
    }

    fn recognises(&self, path: &Path) -> bool {
        path.file_name().is_some_and(|name| name == RECONSTRUCTION) || folder(path).join(RECONSTRUCTION).is_file()
    }

    fn import(&self, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error> {
        if let [_, more, ..] = paths {
            return Err(refuse(more, "expected one folder; its files are found there"));
        }
        let folder = folder(&paths[0]);
        let mut notes = Vec::new();
        let block = block(&folder, options, &mut notes)?;
        Ok(Imported::new(block, notes))
    }
}

/// The folder of the reconstruction: itself, its file, or a project of ODM.
fn folder(path: &Path) -> PathBuf {
    if !path.is_dir() {
        return path.parent().unwrap_or(Path::new("")).to_owned();
    }
    let inner = path.join("opensfm");
    if inner.join(RECONSTRUCTION).is_file() { inner } else { path.to_owned() }
}

fn block(folder: &Path, options: &ImportOptions, notes: &mut Vec<Note>) -> Result<Block, Error> {
    let path = folder.join(RECONSTRUCTION);
    let file = path.display().to_string();
    let reconstruction = largest(&path, notes)?;
    let sigma = guessed_sigma(options, notes);
    let cameras = cameras(&file, &reconstruction, options, notes)?;
    let number_of_camera: HashMap<&str, usize> =
        cameras.iter().enumerate().map(|(k, camera)| (camera.id.as_str(), k)).collect();
    let measured = Measured::of(reconstruction.shots.values(), notes);
    let mut flights: Vec<String> = Vec::new();
    let mut images = Vec::with_capacity(reconstruction.shots.len());
    for (name, shot) in &reconstruction.shots {
        let camera = number_of_camera.get(shot.camera.as_str()).ok_or_else(|| {
            let names = [name, &shot.camera].map(|name| shown(name.as_bytes()));
            let problem = format!("shot {} was taken with camera {}, which is not there", names[0], names[1]);
            Error::content(&file, Place::File, problem)
        })?;
        let flight = flights.iter().position(|flight| flight == flight_of(name)).unwrap_or_else(|| {
            flights.push(flight_of(name).to_owned());
            flights.len() - 1
        });
        images.push(image(name, shot, *camera, flight, &measured));
    }
    let image_of_shot: HashMap<&str, ImageId> =
        images.iter().enumerate().map(|(k, image)| (image.name.as_str(), ImageId::from(k))).collect();
    let sides: Vec<[f64; 2]> = images
        .iter()
        .map(|image| {
            let camera = &cameras[image.camera.index()];
            [f64::from(camera.width_px), f64::from(camera.height_px)]
        })
        .collect();
    let pixel = |image: ImageId, xy: [f64; 2]| pixels(xy, sides[image.index()]);
    let mut tracks = tracks::read(&folder.join("tracks.csv"), &reconstruction.points, &image_of_shot, &pixel, notes)?;
    let system = reconstruction.reference_lla.map(|reference| local_system(&file, reference)).transpose()?;
    let survey = survey::read(folder, system, &image_of_shot, &pixel, &mut tracks, notes)?;
    let (tie_points, ties) = tracks.finish(notes);
    if system.is_none() {
        notes.push(Note::guess("there is no reference_lla: coordinates may have neither scale nor vertical"));
    }
    Ok(Block {
        name: folder.file_name().map_or_else(|| "opensfm".into(), |name| name.to_string_lossy().into_owned()),
        crs: system.map_or_else(|| "local".into(), |system| system.crs()),
        survey_crs: survey.system,
        sigma,
        cameras,
        flights,
        images,
        tie_points,
        ties,
        surveyed: survey.points,
        marks: survey.marks,
        origin: Vector3::zeros(),
        extra_image_columns: Vec::new(),
    })
}

fn largest(path: &Path, notes: &mut Vec<Note>) -> Result<Reconstruction, Error> {
    let mut parts: Vec<Reconstruction> = reconstruction::read(path)?;
    let count = parts.len();
    parts.sort_by_key(|part| part.shots.len());
    let largest = parts.pop().filter(|part| !part.shots.is_empty());
    let largest = largest.ok_or_else(|| refuse(path, "has no reconstruction with a shot"))?;
    if count > 1 {
        let others: usize = parts.iter().map(|part| part.shots.len()).sum();
        notes.push(Note::loss(format!(
            "{count} reconstructions do not hang together: the largest is taken, {others} images of the others are \
             left out"
        )));
    }
    Ok(largest)
}

/// Pixels of normalised coordinates in an image of these sides, px.
pub(super) fn pixels([x, y]: [f64; 2], [width, height]: [f64; 2]) -> [f64; 2] {
    let size = width.max(height);
    [x * size + 0.5 * width, y * size + 0.5 * height]
}

fn cameras(
    file: &str,
    reconstruction: &Reconstruction,
    options: &ImportOptions,
    notes: &mut Vec<Note>,
) -> Result<Vec<Camera>, Error> {
    let mut cameras = Vec::new();
    for (id, camera) in &reconstruction.cameras {
        let refuse =
            |problem: String| Error::content(file, Place::File, format!("camera {}: {problem}", shown(id.as_bytes())));
        let model = camera::Model::new(camera).map_err(refuse)?;
        let size = [camera.width, camera.height];
        let fit = match model.exact() {
            Some(parameters) => Some(Fit { parameters, rms_px: 0.0, max_px: 0.0 }),
            None => fit_fraser(&Formula::Forward(&|ray| Some(model.project(ray))), size, &model.start(), true),
        };
        let fit = fit.ok_or_else(|| refuse("no Fraser camera comes near it".into()))?;
        cameras.push(Camera {
            // OpenSfM names a camera by itself; an empty name is no name of ours.
            id: if id.is_empty() { "camera".into() } else { id.clone() },
            width_px: camera.width,
            height_px: camera.height,
            pixel_um: None,
            interior: fit.judge(file, id, options.approximate, notes)?,
        });
    }
    Ok(cameras)
}

/// Which of the things that every shot has were measured.
struct Measured {
    times: bool,
    gnss: bool,
}

impl Measured {
    fn of<'a>(shots: impl Iterator<Item = &'a Shot> + Clone, notes: &mut Vec<Note>) -> Self {
        let varies = |values: &mut dyn Iterator<Item = f64>, by: f64| {
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            high - low > by
        };
        let times = varies(&mut shots.clone().filter_map(|shot| shot.capture_time), 0.0);
        let gnss = varies(&mut shots.clone().filter_map(|shot| shot.gps_position).map(|p| p[2]), EQUAL_HEIGHTS_M);
        if !times && shots.clone().any(|shot| shot.capture_time.is_some()) {
            notes.push(Note::loss("capture_time is the same for all images: no times"));
        }
        if !gnss && shots.clone().any(|shot| shot.gps_position.is_some()) {
            let text = "the GNSS positions of all images have one height, which OpenSfM puts where it does not use \
                        altitudes: left out";
            notes.push(Note::guess(text));
        }
        Self { times, gnss }
    }
}

fn image(name: &str, shot: &Shot, camera: usize, flight: usize, measured: &Measured) -> Image {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(shot.rotation));
    let sigma = shot.gps_dop.filter(|dop| *dop > 0.0);
    let gnss = shot.gps_position.filter(|_| measured.gnss);
    let pose = pose::from_translation(rotation, &Vector3::from(shot.translation));
    Image {
        time_s: shot.capture_time.filter(|_| measured.times),
        gnss: gnss.map(|position| Gnss { position: position.into(), sigma_xy: sigma, sigma_z: sigma }),
        ..Image::new(name, camera.into(), flight.into(), pose)
    }
}

fn local_system(file: &str, reference: Reference) -> Result<LocalSystem, Error> {
    let Reference { latitude, longitude, altitude } = reference;
    // A reconstruction without positions has its zero at 0, 0.
    let stated = Geographic::checked(latitude, longitude, altitude);
    let stated = stated.map_err(|problem| Error::content(file, Place::File, format!("reference_lla: {problem}")))?;
    Ok(LocalSystem { origin: stated.unwrap_or(Geographic { latitude, longitude, height: altitude }) })
}
