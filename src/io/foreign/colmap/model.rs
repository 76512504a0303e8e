//! A model as it is read, from either form, and the block that it makes.

use super::super::super::error::{Error, shown};
use super::super::tracks::Tracks;
use super::super::{ImportOptions, Imported, Note, flights, guessed_sigma, pose, refuse};
use super::cameras::{CameraModel, MODELS, ModelCamera};
use super::reported::Reported;
use crate::block::{Block, CameraId, FlightId, Image, ImageId, Measurement, PointId, TiePoint};
use crate::camera::Camera;
use nalgebra::Vector3;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// What the files of a model say. Problems are told in words; the reader knows the place.
#[derive(Default)]
pub(super) struct Model {
    cameras: Vec<(u32, ModelCamera, [u32; 2])>,
    camera_numbers: HashMap<u32, CameraId>,
    points: Vec<(u64, Vector3<f64>)>,
    point_numbers: HashMap<u64, PointId>,
    tracks: Tracks,
    images: Vec<Image>,
    names: HashSet<String>,
    /// Measurements of points that the model does not have.
    pointless: usize,
    reported: Reported,
    /// Rigs of more than one camera.
    pub rigs: usize,
}

/// The model of a camera by one of its two names.
pub(super) fn model(is: impl Fn(&CameraModel) -> bool, found: &str) -> Result<&'static CameraModel, String> {
    MODELS.iter().find(|model| is(model)).ok_or_else(|| {
        let names: Vec<&str> = MODELS.iter().map(|model| model.name).collect();
        format!("{} is no camera model that can be read: {}", shown(found.as_bytes()), names.join(", "))
    })
}

impl Model {
    pub(super) fn add_camera(&mut self, id: u32, camera: ModelCamera, size: [u64; 2]) -> Result<(), String> {
        let side = |side: u64| u32::try_from(side).ok().filter(|side| *side > 0);
        let (Some(width), Some(height)) = (side(size[0]), side(size[1])) else {
            return Err(format!("{} x {} px is no size of a camera", size[0], size[1]));
        };
        if !camera.is_plausible() {
            return Err("expected focal lengths above zero".into());
        }
        if self.camera_numbers.insert(id, CameraId::from(self.cameras.len())).is_some() {
            return Err(format!("camera {id} stands twice"));
        }
        self.cameras.push((id, camera, [width, height]));
        Ok(())
    }

    /// `error`: mean distance of its measurements in COLMAP, px, where it is known.
    pub(super) fn add_point(&mut self, id: u64, position: [f64; 3], error: Option<f64>, measurements: usize) {
        self.points.push((id, position.into()));
        error.into_iter().for_each(|error| self.reported.add(error, measurements));
    }

    /// All points are there: images may come.
    pub(super) fn end_of_points(&mut self) -> Result<(), String> {
        self.points.sort_by_key(|(id, _)| *id);
        for (id, position) in std::mem::take(&mut self.points) {
            let number = self.tracks.point(id.to_string(), Some(position));
            if self.point_numbers.insert(id, number).is_some() {
                return Err(format!("point {id} stands twice"));
            }
        }
        Ok(())
    }

    pub(super) fn add_image(&mut self, q: [f64; 4], t: [f64; 3], camera: u32, name: &str) -> Result<ImageId, String> {
        let rotation = pose::from_quaternion(q).ok_or("the quaternion of the image has the length zero")?;
        let camera =
            self.camera_numbers.get(&camera).ok_or_else(|| format!("camera {camera} is not among the cameras"))?;
        if name.is_empty() || !self.names.insert(name.to_owned()) {
            return Err(format!("expected a name that no other image has, found {}", shown(name.as_bytes())));
        }
        self.images.push(Image::new(name, *camera, FlightId(0), pose::from_translation(rotation, &t.into())));
        Ok(ImageId::from(self.images.len() - 1))
    }

    pub(super) fn add_measurement(&mut self, image: ImageId, point: u64, xy: [f64; 2]) {
        match self.point_numbers.get(&point) {
            Some(point) => self.tracks.measure(image, *point, xy),
            None => self.pointless += 1,
        }
    }

    /// The block of the model that stands in `folder`.
    pub(super) fn finish(self, folder: &Path, options: &ImportOptions) -> Result<Imported, Error> {
        let mut notes = Vec::new();
        let reported_px = self.reported.rms_px();
        if self.images.is_empty() {
            return Err(refuse(folder, "the model has no image"));
        }
        let cameras = cameras(&self.cameras, folder, options, &mut notes)?;
        let (tie_points, ties) = self.tracks.finish(&mut notes);
        let (mut images, ties) = by_name(self.images, ties);
        let flights = flights(&mut images);
        if self.pointless > 0 {
            let text = format!("{} measurements are left out: points3D has not their points", self.pointless);
            notes.push(Note::loss(text));
        }
        if self.rigs > 0 {
            let text = format!("{} rigs of several cameras are not kept: every image has its own pose", self.rigs);
            notes.push(Note::loss(text));
        }
        notes.extend(known_of_colmap(flights.len()));
        let name = folder.canonicalize().ok().and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
        let block = Block {
            name: name.filter(|name| !name.is_empty()).unwrap_or_else(|| "colmap".into()),
            crs: "local".into(),
            survey_crs: String::new(),
            origin: Vector3::zeros(),
            sigma: guessed_sigma(options, &mut notes),
            cameras,
            flights,
            images,
            tie_points: tie_points as Vec<TiePoint>,
            ties,
            surveyed: Vec::new(),
            marks: Vec::new(),
            extra_image_columns: Vec::new(),
        };
        Ok(Imported { reported_px, ..Imported::new(block, notes) })
    }
}

fn cameras(
    cameras: &[(u32, ModelCamera, [u32; 2])],
    folder: &Path,
    options: &ImportOptions,
    notes: &mut Vec<Note>,
) -> Result<Vec<Camera>, Error> {
    let convert = |(id, camera, size): &(u32, ModelCamera, [u32; 2])| {
        let interior = match camera.exact() {
            Some(interior) => interior,
            None => {
                let name = camera.model.name;
                let nearest = camera.nearest(*size).ok_or_else(|| {
                    refuse(folder, format!("camera {id} ({name}): no Fraser camera comes near it over the whole image"))
                })?;
                nearest.judge(&folder.display().to_string(), &format!("{id} ({name})"), options.approximate, notes)?
            }
        };
        Ok(Camera { id: id.to_string(), width_px: size[0], height_px: size[1], pixel_um: None, interior })
    };
    cameras.iter().map(convert).collect()
}

/// Images in the order of their names, which is that of time where a camera numbers them, and the measurements by
/// image.
fn by_name(images: Vec<Image>, mut ties: Vec<Measurement>) -> (Vec<Image>, Vec<Measurement>) {
    let mut order: Vec<usize> = (0..images.len()).collect();
    order.sort_by(|a, b| images[*a].name.cmp(&images[*b].name));
    let mut numbers = vec![ImageId(0); images.len()];
    order.iter().enumerate().for_each(|(new, old)| numbers[*old] = ImageId::from(new));
    ties.iter_mut().for_each(|tie| tie.image = numbers[tie.image.index()]);
    ties.sort_by_key(|tie| tie.image);
    let mut images: Vec<Image> = images;
    images.sort_by(|a, b| a.name.cmp(&b.name));
    (images, ties)
}

/// What every model leaves open, or has done to the measurements.
fn known_of_colmap(flights: usize) -> [Note; 3] {
    [
        Note::fact(
            "COLMAP has left out measurements with residuals above its limit (4 px if not set otherwise): residuals \
             end there, and its outliers are gone",
        ),
        Note::fact(
            "place, orientation and scale of the object coordinates are COLMAP's; metres only if it was georeferenced",
        ),
        Note::guess(format!(
            "images stand in the order of their names (the model has no times); flights, by the folders in the names: \
             {flights}"
        )),
    ]
}
