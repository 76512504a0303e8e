//! Noah Snavely's camera, of Bundler and of the problems "bundle adjustment in the large" (BAL).
//!
//! ```text
//! (X, Y, Z) = R P + t          p = -(X, Y) / Z          (x, y) = f (1 + k1 |p|^2 + k2 |p|^4) p
//! ```
//!
//! The camera looks along -z, y is up, and image coordinates count from the middle of the image, which is the principal
//! point: in our axes, half a turn about x apart, it is a Fraser camera with `k1 / f^2` and `k2 / f^4`. Neither format
//! has the size of the images; Bundler's names stand in a list beside (`list.txt`).
//!
//! Sources: Bundler, `README.md`; Agarwal and others, "Bundle adjustment in the large" (2010); Ceres,
//! `snavely_reprojection_error.h`.

mod bal;
mod bundler;
mod write;

pub use bal::Bal;
pub use bundler::Bundler;

use super::super::error::Error;
use super::text::Lines;
use super::tracks::Tracks;
use super::{ImportOptions, Imported, Note, guessed_sigma, pose, refuse, verification};
use crate::block::{Block, CameraId, FlightId, Image, ImageId, Measurement, Pose};
use crate::camera::{Camera, Interior};
use nalgebra::Vector3;
use std::path::Path;

/// Names of the images, one per line, beside either file.
const LIST: &str = "list.txt";

/// An image as either format has it.
#[derive(Debug, Clone, Copy)]
struct View {
    /// `f` (px), `k1`, `k2`.
    interior: [f64; 3],
    /// In our axes.
    pose: Pose,
}

/// What either file says.
#[derive(Default)]
struct Scene {
    /// By number in the file; `None` for images that were not oriented.
    views: Vec<Option<View>>,
    /// The image of a measurement is its number in the file; places count from the middle of the image, y up.
    tracks: Tracks,
}

impl Scene {
    fn block(mut self, file: &Path, options: &ImportOptions) -> Result<Imported, Error> {
        let mut notes = Vec::new();
        let names = names(file, self.views.len(), &mut notes)?;
        let size = size(self.tracks.measurements(), options, &mut notes);
        let half = size.map(|side| 0.5 * f64::from(side));
        let mut cameras: Vec<Camera> = Vec::new();
        let mut interiors: Vec<[f64; 3]> = Vec::new();
        let mut images = Vec::new();
        let mut numbers = vec![None; self.views.len()];
        for (k, view) in self.views.iter().enumerate() {
            let Some(view) = view else { continue };
            let camera = interiors.iter().position(|other| *other == view.interior).unwrap_or_else(|| {
                interiors.push(view.interior);
                let [width_px, height_px] = size;
                let id = interiors.len().to_string();
                cameras.push(Camera {
                    id,
                    width_px,
                    height_px,
                    pixel_um: None,
                    interior: interior(view.interior, half),
                });
                interiors.len() - 1
            });
            numbers[k] = Some(ImageId::from(images.len()));
            images.push(Image::new(&names[k], CameraId::from(camera), FlightId(0), view.pose));
        }
        if images.is_empty() {
            return Err(refuse(file, "no image is oriented"));
        }
        let idle = self.views.len() - images.len();
        if idle > 0 {
            notes.push(Note::loss(format!("{idle} images are left out: they are not oriented (f = 0)")));
        }
        if cameras.len() < images.len() {
            notes.push(Note::guess(format!(
                "images with the same f, k1 and k2 have one camera: {} cameras",
                cameras.len()
            )));
        }
        self.tracks.change_measurements(|tie| {
            let Some(image) = numbers[tie.image.index()] else { return false };
            (tie.image, tie.x, tie.y) = (image, half[0] + tie.x, half[1] - tie.y);
            true
        });
        let (tie_points, ties) = self.tracks.finish(&mut notes);
        notes.push(Note::fact("place, orientation and scale of the object coordinates are arbitrary"));
        let block = Block {
            name: file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned()),
            crs: "local".into(),
            survey_crs: String::new(),
            origin: Vector3::zeros(),
            sigma: guessed_sigma(options, &mut notes),
            cameras,
            flights: vec!["flight".into()],
            images,
            tie_points,
            ties,
            surveyed: Vec::new(),
            marks: Vec::new(),
            extra_image_columns: Vec::new(),
        };
        // Of another size of the images everything is shifted.
        if options.size_px.is_some() {
            verification::check(&block, folder_of(file), options.approximate, &mut notes)?;
        }
        Ok(Imported::new(block, notes))
    }
}

/// Our camera of `f, k1, k2` and the middle of the image.
fn interior([f, k1, k2]: [f64; 3], [ppx, ppy]: [f64; 2]) -> Interior {
    [f, ppx, ppy, ppx, ppy, k1 / f.powi(2), k2 / f.powi(4), 0.0, 0.0, 0.0, 0.0, 0.0]
}

/// The pose of their `R` and `t`.
fn pose_of(rotation: &nalgebra::UnitQuaternion<f64>, t: [f64; 3]) -> Pose {
    let pose = pose::from_translation(*rotation, &t.into());
    Pose { rotation: pose::half_turn_about_x(&pose.rotation), centre: pose.centre }
}

fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Names from the list beside the file, where it has as many as the file has images; else numbers.
fn names(file: &Path, count: usize, notes: &mut Vec<Note>) -> Result<Vec<String>, Error> {
    let list = folder_of(file).join(LIST);
    let mut names = Vec::new();
    if list.is_file() {
        let mut lines = Lines::open(&list)?;
        while let Some(mut line) = lines.next_words()? {
            let name = line.word("the name of an image")?.to_owned();
            if names.contains(&name) {
                return Err(line.refuse(format!("image {name:?} stands twice")));
            }
            names.push(name);
        }
    }
    if names.len() == count {
        return Ok(names);
    }
    if !names.is_empty() {
        let text = format!("{}: {} names for {count} images; images are numbered", list.display(), names.len());
        notes.push(Note::loss(text));
    }
    Ok((0..count).map(|k| format!("{k:05}")).collect())
}

/// The size of the images: as given, else the smallest about the principal point that holds every measurement.
fn size(seen: &[Measurement], options: &ImportOptions, notes: &mut Vec<Note>) -> [u32; 2] {
    if let Some(size) = options.size_px {
        return size;
    }
    let most = |side: fn(&Measurement) -> f64| seen.iter().map(|tie| side(tie).abs()).fold(0.0, f64::max);
    let side = |side: fn(&Measurement) -> f64| 2 * (most(side).ceil().clamp(1.0, f64::from(u32::MAX / 4)) as u32);
    let size = [side(|tie| tie.x), side(|tie| tie.y)];
    notes.push(Note::guess(format!(
        "the images are {} x {} px, the least that holds every measurement (--size says how large they are)",
        size[0], size[1]
    )));
    size
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::fraser::project;
    use nalgebra::UnitQuaternion;

    /// Their formula, as it stands in the module's text, and ours.
    #[test]
    fn their_camera_is_ours_in_other_axes() {
        let rotation = UnitQuaternion::from_euler_angles(0.2, -0.3, 1.0);
        let (t, [f, k1, k2]) = ([0.5, -0.2, -9.0], [800.0, -0.12, 0.03]);
        let (point, half) = (Vector3::new(1.5, -2.0, 1.0), [500.0, 400.0]);
        let theirs = rotation * point + Vector3::from(t);
        let p = [-theirs.x / theirs.z, -theirs.y / theirs.z];
        let r2 = p[0] * p[0] + p[1] * p[1];
        let scale = f * (1.0 + k1 * r2 + k2 * r2 * r2);
        let expected = [half[0] + scale * p[0], half[1] - scale * p[1]];
        let seen = pose_of(&rotation, t).cam_from_world(&point);
        let found = project(&interior([f, k1, k2], half), seen.into()).unwrap();
        assert!((found[0] - expected[0]).hypot(found[1] - expected[1]) < 1e-10, "{found:?} {expected:?}");
    }
}
