//! Pix4D: the folder `params` of a project.
//!
//! ```text
//! *_calibrated_camera_parameters.txt             of each image: name w h / K (3 lines) / k1 k2 k3 / t1 t2 / projection centre / R (3 lines)
//! *_calibrated_external_camera_parameters.txt    name X Y Z omega phi kappa (degrees): compared with the above
//! *_offset.xyz                                   what was taken off all coordinates
//! *_tp_pix4d.txt                                 image / point column row scale ... / -99: all automatic tie points
//! *_tp_bingo.txt                                 image H_widthmm_heightmm / point x y (mm from the middle, y up) / -99: a part of them, with control
//! ```
//!
//! R takes the world to the camera (y down). Of the distortion t1 and t2 are the Fraser camera's p2 and p1, in units of
//! the focal length. Source: Pix4D, "What does the output params folder contain?" (202977149).

use super::super::error::{Error, shown};
use super::text::Lines;
use super::tracks::Tracks;
use super::{Format, ImportOptions, Imported, Note, file_that_ends, flight_of, guessed_sigma, pose, refuse};
use crate::block::{Block, Image, ImageId, PointId, Pose};
use crate::camera::{Camera, Interior};
use nalgebra::{Matrix3, Vector3};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

const CAMERAS: &str = "_calibrated_camera_parameters.txt";
const EXTERNAL: &str = "_calibrated_external_camera_parameters.txt";
const OFFSET: &str = "_offset.xyz";
const TIES: &str = "_tp_pix4d.txt";
const BINGO: &str = "_tp_bingo.txt";
/// What ends the points of an image.
const END: &str = "-99";
/// The two files of poses are written with ten digits of an angle in degrees; rad. A national system turns by the
/// convergence of its meridians, not more.
const SAME_ROTATION: f64 = 0.1;

/// The format.
pub struct Pix4d;

impl Format for Pix4d {
    fn name(&self) -> &'static str {
        "pix4d"
    }

    fn about(&self) -> &'static str {
        "Pix4D: the folder params, with calibrated cameras and *_tp_pix4d.txt or *_tp_bingo.txt"
    }

    fn recognises(&self, path: &Path) -> bool {
        path.is_dir() && file_that_ends(path, CAMERAS).is_ok_and(|file| file.is_some())
    }

    fn import(&self, paths: &[PathBuf], options: &ImportOptions) -> Result<Imported, Error> {
        if let [_, more, ..] = paths {
            return Err(refuse(more, "expected one folder; its files are found there"));
        }
        let mut notes = Vec::new();
        let block = block(&paths[0], options, &mut notes)?;
        Ok(Imported::new(block, notes))
    }
}

fn block(folder: &Path, options: &ImportOptions, notes: &mut Vec<Note>) -> Result<Block, Error> {
    let path = file_that_ends(folder, CAMERAS)?
        .ok_or_else(|| refuse(folder, format!("has no file that ends with {CAMERAS}")))?;
    let sigma = guessed_sigma(options, notes);
    let offset = match file_that_ends(folder, OFFSET)? {
        Some(path) => Lines::open(&path)?.expect_words("three coordinates")?.numbers::<3>("a coordinate")?.into(),
        None => Vector3::zeros(),
    };
    let mut cameras: Vec<Camera> = Vec::new();
    let mut flights: Vec<String> = Vec::new();
    let mut images: Vec<Image> = Vec::new();
    let mut lines = Lines::open(&path)?;
    // A head of text goes to the first empty line.
    while lines.next_line()?.is_some_and(|line| !line.is_empty()) {}
    while let Some((name, camera, pose)) = image(&mut lines)? {
        let same = |other: &Camera| Camera { id: String::new(), ..other.clone() } == camera;
        let number = cameras.iter().position(same).unwrap_or_else(|| {
            cameras.push(Camera { id: format!("camera {}", cameras.len() + 1), ..camera.clone() });
            cameras.len() - 1
        });
        let flight = flights.iter().position(|flight| flight == flight_of(&name)).unwrap_or_else(|| {
            flights.push(flight_of(&name).to_owned());
            flights.len() - 1
        });
        if images.iter().any(|image| image.name == name) {
            return Err(lines.refuse(format!("image {} stands twice", shown(name.as_bytes()))));
        }
        images.push(Image::new(name, number.into(), flight.into(), Pose { centre: pose.centre + offset, ..pose }));
    }
    if let Some(path) = file_that_ends(folder, EXTERNAL)? {
        compare(&path, &images)?;
    }
    if offset != Vector3::zeros() {
        notes.push(Note::fact(format!(
            "the offset {}, {}, {} is added to all coordinates",
            offset.x, offset.y, offset.z
        )));
    }
    let tracks = match (file_that_ends(folder, TIES)?, file_that_ends(folder, BINGO)?) {
        (Some(path), _) => tie_points(&path, &images, &cameras, false, notes)?,
        (None, Some(path)) => {
            let text = "*_tp_bingo.txt has a part of the tie points, chosen by a grid, and control points among them \
                        as tie points";
            notes.push(Note::loss(text));
            tie_points(&path, &images, &cameras, true, notes)?
        }
        (None, None) => return Err(refuse(folder, format!("has no tie points: no file ends with {TIES} or {BINGO}"))),
    };
    notes.push(Note::guess("pixels are taken to count from the outer corner of the top-left one"));
    notes.push(Note::fact("tie points are those that Pix4D kept: large residuals are gone already"));
    let (tie_points, ties) = tracks.finish(notes);
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().replace(CAMERAS, ""));
    Ok(Block {
        name: if name.is_empty() { "pix4d".into() } else { name },
        crs: "local".into(),
        survey_crs: String::new(),
        sigma,
        cameras,
        flights,
        images,
        tie_points,
        ties,
        surveyed: Vec::new(),
        marks: Vec::new(),
        origin: Vector3::zeros(),
        extra_image_columns: Vec::new(),
    })
}

/// The next image; its camera has no name yet.
fn image(lines: &mut Lines) -> Result<Option<(String, Camera, Pose)>, Error> {
    let Some(mut line) = lines.next_words()? else { return Ok(None) };
    let name = line.word("the image")?.to_owned();
    let [width_px, height_px]: [u32; 2] = [line.whole("its width")?, line.whole("its height")?];
    let row = |lines: &mut Lines| lines.expect_words("a row of K")?.numbers::<3>("a row of K");
    let k = [row(lines)?, row(lines)?, row(lines)?];
    let [[fx, skew, ppx], [zero, f, ppy], last] = k;
    if !(f > 0.0 && fx > 0.0)
        || skew != 0.0
        || zero != 0.0
        || last != [0.0, 0.0, 1.0]
        || width_px == 0
        || height_px == 0
    {
        return Err(lines.refuse(format!("image {}: expected K = [f 0 x; 0 f y; 0 0 1]", shown(name.as_bytes()))));
    }
    let [k1, k2, k3] = lines.expect_words("radial distortion")?.numbers::<3>("radial distortion")?;
    let [t1, t2] = lines.expect_words("tangential distortion")?.numbers::<2>("tangential distortion")?;
    if fx != f && [k1, k2, k3, t1, t2] != [0.0; 5] {
        return Err(lines.refuse("two focal lengths with a distortion are no Fraser camera; export one focal length"));
    }
    let f2 = f * f;
    let interior: Interior =
        [f, ppx, ppy, ppx, ppy, k1 / f2, k2 / (f2 * f2), k3 / (f2 * f2 * f2), t2 / f, t1 / f, fx / f - 1.0, 0.0];
    let centre = lines.expect_words("the camera position")?.numbers::<3>("the camera position")?.into();
    let row = |lines: &mut Lines| lines.expect_words("a row of R")?.numbers::<3>("a row of R");
    let rows = [row(lines)?, row(lines)?, row(lines)?];
    let rotation = pose::from_matrix(&Matrix3::from_row_slice(rows.as_flattened()))
        .ok_or_else(|| lines.refuse("the three rows before are no rotation"))?;
    let camera = Camera { id: String::new(), width_px, height_px, pixel_um: None, interior };
    Ok(Some((name, camera, Pose { rotation, centre })))
}

/// The angles of the second file are those of the first: else one of the two conventions was not understood.
fn compare(path: &Path, images: &[Image]) -> Result<(), Error> {
    let mut lines = Lines::open(path)?;
    lines.next_line()?;
    while let Some(mut line) = lines.next_words()? {
        let name = line.word("the image")?;
        line.numbers::<3>("its position")?;
        let angles = line.numbers::<3>("omega, phi, kappa")?.map(f64::to_radians);
        let Some(image) = images.iter().find(|image| image.name == name) else { continue };
        let angle = pose::from_omega_phi_kappa(angles).angle_to(&image.pose.rotation);
        if angle > SAME_ROTATION {
            let name = shown(name.as_bytes());
            let problem =
                format!("image {name}: the angles are {:.1} degrees from R of the other file", angle.to_degrees());
            return Err(line.refuse(problem));
        }
    }
    Ok(())
}

fn tie_points(
    path: &Path,
    images: &[Image],
    cameras: &[Camera],
    in_mm: bool,
    notes: &mut Vec<Note>,
) -> Result<Tracks, Error> {
    let mut by_name: HashMap<&str, ImageId> = HashMap::new();
    for (k, image) in images.iter().enumerate() {
        by_name.insert(&image.name, k.into());
        // The files of tie points leave the extension off.
        if let Some((stem, _)) = image.name.rsplit_once('.') {
            by_name.entry(stem).or_insert(k.into());
        }
    }
    let mut tracks = Tracks::default();
    let mut points: HashMap<String, PointId> = HashMap::new();
    let mut strange = HashSet::new();
    let mut lines = Lines::open(path)?;
    // The image of the points that follow, and its sensor in mm.
    let mut current: Option<(Option<ImageId>, [f64; 2])> = None;
    while let Some(mut line) = lines.next_words()? {
        let word = line.word("a point, an image or the end of its points")?.to_owned();
        let Some((image, sensor)) = current else {
            let image = by_name.get(word.as_str()).copied();
            if image.is_none() {
                strange.insert(word.clone());
            }
            current = Some((image, if in_mm { sensor_mm(&mut line)? } else { [1.0; 2] }));
            continue;
        };
        if word == END {
            current = None;
            continue;
        }
        let [x, y] = line.numbers("the point's coordinates")?;
        let Some(image) = image else { continue };
        let camera = &cameras[images[image.index()].camera.index()];
        let size = [camera.width_px, camera.height_px].map(f64::from);
        let xy = match in_mm {
            true => [(0.5 + x / sensor[0]) * size[0], (0.5 - y / sensor[1]) * size[1]],
            false => [x, y],
        };
        let point = *points.entry(word.clone()).or_insert_with(|| tracks.point(word.as_str(), None));
        tracks.measure(image, point, xy);
    }
    if !strange.is_empty() {
        notes.push(Note::loss(format!("{} images have tie points but no pose: left out", strange.len())));
    }
    Ok(tracks)
}

/// Sides of the sensor in a name like `H_8.07_6.0525`.
fn sensor_mm(line: &mut super::text::Line<'_>) -> Result<[f64; 2], Error> {
    let camera = line.word("the camera, as H_8.07_6.0525")?;
    let side = |side: &str| side.parse().ok().filter(|side: &f64| *side > 0.0 && side.is_finite());
    let mut sides = camera.rsplitn(3, '_').map(side);
    let (height, width) = (sides.next().flatten(), sides.next().flatten());
    let sides = width
        .zip(height)
        .ok_or_else(|| line.refuse(format!("expected a camera like H_8.07_6.0525, found {camera:?}")))?;
    Ok([sides.0, sides.1])
}
