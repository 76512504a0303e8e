//! MicMac, its first version and MMVII.
//!
//! ```text
//! Ori-NAME/Orientation-IMAGE.xml, AutoCal*.xml       or  Ori-PerspCentral-*.xml, Calib-PerspCentral-*.xml
//! points with <OneAppuisDAF>, marks with <OneMesureAF1I>   or  MesGCP-*.xml, MesIm-*.xml
//! Homol*/PMul*.txt or .dat, or pairs in Homol*/Pastis*/
//! ```
//!
//! Image coordinates count from the centre of the top-left pixel. (Its documents do not say so; its code samples images
//! at whole coordinates.)

mod calibration;
mod orientation;
mod sources;
mod survey;
mod ties;
mod write;

use super::super::error::{Error, Place, shown};
use super::tracks::{Matches, Tracks};
use super::{ExportOptions, Exporter, Format, HALF_PIXEL, ImportOptions, Imported, Note};
use super::{flight_of, guessed_sigma, refuse, verification};
use crate::block::{Block, Image, ImageId, Measurement, PointId, SurveyedPoint};
use crate::camera::Camera;
use nalgebra::Vector3;
use sources::Sources;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// What MicMac holds its own verification points to, px.
const VERIFICATION_PX: f64 = 1e-3;

/// The format.
pub struct MicMac;

impl Format for MicMac {
    fn name(&self) -> &'static str {
        "micmac"
    }

    fn about(&self) -> &'static str {
        "MicMac and MMVII: folders Ori-* and Homol*, files of ground control and marks"
    }

    fn recognises(&self, path: &Path) -> bool {
        path.is_dir() && sources::recognises(path)
    }

    fn import(&self, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error> {
        let mut notes = Vec::new();
        let sources = Sources::read(paths, &mut notes)?;
        let block = block(sources, &paths[0], options, &mut notes)?;
        verification::check(&block, &paths[0], options.approximate, &mut notes)?;
        Ok(Imported::new(block, notes))
    }

    fn exporter(&self) -> Option<&dyn Exporter> {
        Some(self)
    }
}

impl Exporter for MicMac {
    fn export(&self, block: &Block, dir: &Path, _: &ExportOptions) -> Result<Vec<Note>, Error> {
        write::export(block, dir)
    }
}

fn block(sources: Sources, path: &Path, options: &ImportOptions, notes: &mut Vec<Note>) -> Result<Block, Error> {
    if sources.orientations.is_empty() {
        return Err(refuse(path, "has no orientation; expected Orientation-*.xml or Ori-PerspCentral-*.xml"));
    }
    let mut sigma = guessed_sigma(options, notes);
    let (cameras, number_of_camera) = cameras(&sources, options, notes)?;
    verify(&sources, notes)?;
    notes.push(Note::guess("pixels are taken to count from the centre of the top-left one: half a pixel is added"));
    let mut flights: Vec<String> = Vec::new();
    let mut images = Vec::with_capacity(sources.orientations.len());
    for (name, (_, orientation)) in &sources.orientations {
        let flight = flights.iter().position(|flight| flight == flight_of(name)).unwrap_or_else(|| {
            flights.push(flight_of(name).to_owned());
            flights.len() - 1
        });
        images.push(Image::new(
            name.clone(),
            number_of_camera[&orientation.calibration].into(),
            flight.into(),
            orientation.pose,
        ));
    }
    let image_of: HashMap<&str, ImageId> =
        images.iter().enumerate().map(|(k, image): (usize, &Image)| (image.name.as_str(), ImageId::from(k))).collect();
    let mut tracks = tracks(&sources, &image_of, notes)?;
    let (surveyed, marks) = survey(&sources, &image_of, &mut tracks, notes)?;
    let (tie_points, ties) = tracks.finish(notes);
    if marks.is_empty() {
        (sigma.mark_px, sigma.control_xy_m, sigma.control_z_m) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    }
    let name = path.file_name().map_or_else(|| "micmac".into(), |name| name.to_string_lossy().into_owned());
    Ok(Block {
        name,
        crs: "local".into(),
        survey_crs: String::new(),
        sigma,
        cameras,
        flights,
        images,
        tie_points,
        ties,
        surveyed,
        marks,
        origin: Vector3::zeros(),
        extra_image_columns: Vec::new(),
    })
}

type Cameras = (Vec<Camera>, BTreeMap<String, usize>);

/// Those that an image was taken with.
fn cameras(sources: &Sources, options: &ImportOptions, notes: &mut Vec<Note>) -> Result<Cameras, Error> {
    let (mut cameras, mut numbers) = (Vec::new(), BTreeMap::new());
    for (path, orientation) in sources.orientations.values() {
        let id = &orientation.calibration;
        if numbers.contains_key(id) {
            continue;
        }
        let calibration = sources::calibration_of(sources, path, orientation)?;
        let file = format!("{id}.xml");
        let fit = calibration.to_fraser().ok_or_else(|| {
            Error::content(&file, Place::File, "no Fraser camera comes near it over its whole sensor")
        })?;
        numbers.insert(id.clone(), cameras.len());
        cameras.push(Camera {
            id: id.clone(),
            width_px: calibration.size[0],
            height_px: calibration.size[1],
            pixel_um: calibration.pixel_um,
            interior: fit.judge(&file, id, options.approximate, notes)?,
        });
    }
    Ok((cameras, numbers))
}

/// Computes the verification points of the files by their own formula.
fn verify(sources: &Sources, notes: &mut Vec<Note>) -> Result<(), Error> {
    let (mut count, mut worst) = (0, 0.0);
    for (path, orientation) in sources.orientations.values() {
        let calibration = sources::calibration_of(sources, path, orientation)?;
        for (point, stated) in &orientation.verification {
            let seen = orientation.pose.cam_from_world(point);
            let Some([x, y]) = calibration.project([seen.x / seen.z, seen.y / seen.z]) else { continue };
            let miss = (x - HALF_PIXEL - stated[0]).hypot(y - HALF_PIXEL - stated[1]);
            if miss.is_nan() || miss > VERIFICATION_PX {
                let problem = format!(
                    "misses its own verification point by {miss:.2e} px, more than {VERIFICATION_PX} px: it belongs to \
                     another calibration, or is not understood"
                );
                return Err(refuse(path, problem));
            }
            (count, worst) = (count + 1, f64::max(worst, miss));
        }
    }
    if count > 0 {
        notes.push(Note::detail(format!("{count} verification points of the orientations are met to {worst:.1e} px")));
    }
    Ok(())
}

fn tracks(sources: &Sources, images: &HashMap<&str, ImageId>, notes: &mut Vec<Note>) -> Result<Tracks, Error> {
    let mut matches = Matches::default();
    let mut strange = HashSet::new();
    for folder in &sources.pairs {
        strange.extend(ties::pairs(folder, images, &mut matches)?);
    }
    let mut tracks = matches.into_tracks(notes);
    let mut number = 0;
    for path in &sources.multiple {
        strange.extend(ties::multiple(path, images, &mut tracks, &mut number)?);
    }
    if !sources.pairs.is_empty() && !sources.multiple.is_empty() {
        let problem = "tie points come as pairs and as multiple ones, which may be the same; name one folder of them";
        return Err(refuse(&sources.multiple[0], problem));
    }
    if !strange.is_empty() {
        notes.push(Note::loss(format!("{} images have tie points but no orientation: left out", strange.len())));
    }
    Ok(tracks)
}

type Survey = (Vec<SurveyedPoint>, Vec<Measurement>);

/// Image, place (px) and standard deviation of a mark.
type Seen = (ImageId, [f64; 2], Option<f64>);

/// Points that are measured; marks of points without coordinates are tie points.
fn survey(
    sources: &Sources,
    images: &HashMap<&str, ImageId>,
    tracks: &mut Tracks,
    notes: &mut Vec<Note>,
) -> Result<Survey, Error> {
    let (mut surveyed, mut marks) = (Vec::new(), Vec::new());
    let mut strange = 0;
    let mut of_point: BTreeMap<&str, Vec<Seen>> = BTreeMap::new();
    for mark in &sources.marks {
        match images.get(mark.image.as_str()) {
            Some(image) => of_point.entry(&mark.point).or_default().push((*image, mark.xy, mark.sigma)),
            None => strange += 1,
        }
    }
    for (name, seen) in &of_point {
        let mut own: Vec<ImageId> = seen.iter().map(|(image, ..)| *image).collect();
        own.sort_unstable();
        if let Some(pair) = own.windows(2).find(|pair| pair[0] == pair[1]) {
            let image = images.iter().find(|(_, image)| **image == pair[0]).map_or("", |(name, _)| name);
            let names = [name, &image].map(|name| shown(name.as_bytes()));
            let problem = format!("point {} is measured twice in image {}", names[0], names[1]);
            return Err(Error::content("marks", Place::File, problem));
        }
    }
    let mut unseen = 0;
    for point in &sources.points {
        let Some(seen) = of_point.remove(point.name.as_str()) else {
            unseen += 1;
            continue;
        };
        let number = PointId::from(surveyed.len());
        marks.extend(seen.into_iter().map(|(image, [x, y], sigma)| Measurement { image, point: number, x, y, sigma }));
        surveyed.push(point.clone());
    }
    let unsurveyed = of_point.len();
    for (name, seen) in of_point {
        let point = tracks.point(format!("mark {name}"), None);
        for (image, [x, y], sigma) in seen {
            tracks.push(Measurement { image, point, x, y, sigma });
        }
    }
    for (count, what) in [
        (strange, "marks are in images without an orientation: left out"),
        (unseen, "points have coordinates but no mark: left out"),
        (unsurveyed, "points have marks but no coordinates: taken for tie points"),
    ] {
        if count > 0 {
            notes.push(Note::loss(format!("{count} {what}")));
        }
    }
    if surveyed.iter().any(|point| point.sigma_xy == Some(1.0) && point.sigma_z == Some(1.0)) {
        notes.push(Note::guess(
            "some points have the uncertainty 1 1 1, which MicMac writes where it knows none: 1 m is taken",
        ));
    }
    Ok((surveyed, marks))
}
