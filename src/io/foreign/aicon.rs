//! AICON's flat files, which JAiCov reads too: one file for each kind of thing, beside each other in a folder.
//!
//! ```text
//! *.ior   of each camera: camera . c x0 y0 A1 A2 r0 / A3 / B1 B2 / C1 C2 / width height (mm) columns rows
//! *.eor   image camera X Y Z omega phi kappa (rad) order used state
//! *.obc   point X Y Z [sX sY sZ rays used new datum]
//! *.phc   image point x y sx sy vx vy method used .
//! ```
//!
//! Image coordinates are mm from the middle of the image with y up, object coordinates mm. With `d = R' (P - C)`,
//! `R = Rx(omega) Ry(phi) Rz(kappa)`, a negative `c` and `(xs, ys) = c (d1, d2) / d3`, the distortion takes the ideal
//! point to the measured one:
//!
//! ```text
//! radial = A1 (r^2 - r0^2) + A2 (r^4 - r0^4) + A3 (r^6 - r0^6)
//! x = x0 + xs + xs radial + B1 (r^2 + 2 xs^2) + 2 B2 xs ys + C1 xs + C2 ys
//! y = y0 + ys + ys radial + B2 (r^2 + 2 ys^2) + 2 B1 xs ys
//! ```
//!
//! The terms of `r0` stretch the image by `s = 1 - A1 r0^2 - A2 r0^4 - A3 r0^6`: of `s` times the ideal point it is the
//! Fraser camera. Sources: JAiCov (applied-geodesy.org), readers of the flat files and distortion models.

use super::super::error::{Error, shown};
use super::text::Lines;
use super::tracks::Tracks;
use super::{Format, GUESSED, ImportOptions, Imported, Note, file_that_ends, keep_seen, pose, refuse};
use crate::block::{Block, CameraId, FlightId, Image, ImageId, Measurement, PointId, Pose, Role, Sigma, SurveyedPoint};
use crate::camera::{Camera, Interior};
use nalgebra::Vector3;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

const INTERIOR: &str = ".ior";
const EXTERIOR: &str = ".eor";
const OBJECT: &str = ".obc";
const MEASURED: &str = ".phc";
const SCALES: &str = ".scale";
const M_PER_MM: f64 = 1e-3;
/// Sides of the sensor have three decimals: pixels whose sides differ by no more than that makes are square.
const ROUNDING_MM: f64 = 1e-3;
/// Of an image: its angles are omega, phi, kappa.
const OMEGA_PHI_KAPPA: u32 = 0;
/// Of an image: it is not oriented.
const NOT_ORIENTED: u32 = 1;

/// The format.
pub struct Aicon;

impl Format for Aicon {
    fn name(&self) -> &'static str {
        "aicon"
    }

    fn about(&self) -> &'static str {
        "AICON's flat files, as JAiCov reads them: the folder of *.ior, *.eor, *.obc and *.phc"
    }

    fn recognises(&self, path: &Path) -> bool {
        let has = |end| file_that_ends(path, end).is_ok_and(|file| file.is_some());
        path.is_dir() && [INTERIOR, EXTERIOR, OBJECT, MEASURED].into_iter().all(has)
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

/// What a number of a file stands for; `None` for what takes no part.
type Numbers<T> = HashMap<String, Option<T>>;

/// A point of the object.
#[derive(Clone, Copy)]
enum Point {
    Tie(PointId),
    Control(PointId),
}

fn block(folder: &Path, options: &ImportOptions, notes: &mut Vec<Note>) -> Result<Block, Error> {
    let file =
        |end| file_that_ends(folder, end)?.ok_or_else(|| refuse(folder, format!("has no file that ends with {end}")));
    let measured = file(MEASURED)?;
    let (cameras, camera_of) = cameras(&file(INTERIOR)?)?;
    let (images, image_of) = images(&file(EXTERIOR)?, &camera_of, notes)?;
    let mut tracks = Tracks::default();
    let (mut surveyed, mut point_of) = points(&file(OBJECT)?, &mut tracks, notes)?;
    let mut marks = measurements(&measured, (&cameras, &images, &image_of), &mut point_of, &mut tracks, notes)?;
    keep_seen(&mut surveyed, &mut marks, notes);
    if file_that_ends(folder, SCALES)?.is_some() {
        notes.push(Note::loss(format!(
            "scale bars (*{SCALES}) have no place in a block; the scale is that of the coordinates"
        )));
    }
    notes.push(Note::guess("object coordinates are taken for millimetres, in which AICON gives them"));
    notes.push(Note::fact(
        "standard deviations of the measurements are those of the files: of the finding of a target in its image alone",
    ));
    let (tie_points, ties) = tracks.finish(notes);
    Ok(Block {
        name: measured.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned()),
        crs: "local".into(),
        survey_crs: String::new(),
        sigma: Sigma { tie_px: options.tie_px.unwrap_or(GUESSED.tie_px), ..GUESSED },
        cameras: cameras.into_iter().map(|(camera, _)| camera).collect(),
        flights: vec!["flight".into()],
        images,
        tie_points,
        ties,
        surveyed,
        marks,
        origin: Vector3::zeros(),
        extra_image_columns: Vec::new(),
    })
}

/// Cameras with their pixels per mm, and what their numbers stand for.
type Cameras = (Vec<(Camera, f64)>, Numbers<CameraId>);

fn cameras(path: &Path) -> Result<Cameras, Error> {
    let mut lines = Lines::open(path)?;
    let (mut cameras, mut numbers) = (Vec::new(), HashMap::new());
    while let Some(mut line) = lines.next_words()? {
        let id = line.word("the camera")?.to_owned();
        line.word("the camera's second number")?;
        let first = line.numbers::<6>("c, x0, y0, A1, A2, r0")?;
        if numbers.insert(id.clone(), Some(CameraId::from(cameras.len()))).is_some() {
            return Err(line.refuse(format!("camera {} stands twice", shown(id.as_bytes()))));
        }
        cameras.push(camera(id, first, &mut lines)?);
    }
    match cameras.is_empty() {
        true => Err(lines.refuse("expected a camera")),
        false => Ok((cameras, numbers)),
    }
}

/// The camera whose first line was read, and its pixels per mm.
fn camera(id: String, [c, x0, y0, a1, a2, r0]: [f64; 6], lines: &mut Lines) -> Result<(Camera, f64), Error> {
    let [a3] = lines.expect_words("A3")?.numbers("A3")?;
    let [b1, b2] = lines.expect_words("B1 and B2")?.numbers("B1 or B2")?;
    let [c1, c2] = lines.expect_words("C1 and C2")?.numbers("C1 or C2")?;
    let mut line = lines.expect_words("the size of the sensor")?;
    let [width, height] = line.numbers("a side of the sensor, mm")?;
    let [width_px, height_px]: [u32; 2] = [line.whole("columns")?, line.whole("rows")?];
    if !(width > 0.0 && height > 0.0 && width_px > 0 && height_px > 0) {
        return Err(line.refuse("expected a sensor with sides above zero"));
    }
    let [columns, rows] = [width_px, height_px].map(f64::from);
    let per_mm = columns / width;
    if (rows / per_mm - height).abs() > ROUNDING_MM {
        return Err(line.refuse("expected square pixels: width / columns is not height / rows"));
    }
    let r2 = r0 * r0;
    let s = 1.0 - r2 * (a1 + r2 * (a2 + r2 * a3));
    if !(c < 0.0 && s > 0.0) {
        return Err(line.refuse(format!(
            "camera {}: expected c below zero and A1, A2, A3 that mirror nothing",
            shown(id.as_bytes())
        )));
    }
    let scale = s * per_mm;
    let pp = [0.5 * columns + x0 * per_mm, 0.5 * rows - y0 * per_mm];
    // Each term is one of xs, ys: of degree three it takes s^-3 and px^-2, and so on.
    let [k1, k2, k3] = [a1 / (s * scale.powi(2)), a2 / (s * scale.powi(4)), a3 / (s * scale.powi(6))];
    let [p1, p2] = [b1 / (s * scale), -b2 / (s * scale)];
    let interior: Interior = [-c * scale, pp[0], pp[1], pp[0], pp[1], k1, k2, k3, p1, p2, c1 / s, -c2 / s];
    Ok((Camera { id, width_px, height_px, pixel_um: Some(1e3 / per_mm), interior }, per_mm))
}

type Images = (Vec<Image>, Numbers<ImageId>);

fn images(path: &Path, cameras: &Numbers<CameraId>, notes: &mut Vec<Note>) -> Result<Images, Error> {
    let mut lines = Lines::open(path)?;
    let (mut images, mut numbers): Images = Default::default();
    let mut idle = 0;
    while let Some(mut line) = lines.next_words()? {
        let name = line.word("the image")?.to_owned();
        let id = line.word("its camera")?;
        let centre = Vector3::from(line.numbers::<3>("its projection centre")?) * M_PER_MM;
        let rotation = pose::from_omega_phi_kappa(line.numbers("omega, phi, kappa")?);
        let [order, used, state]: [u32; 3] =
            [line.whole("the order of the angles")?, line.whole("use")?, line.whole("the state of the orientation")?];
        let camera = cameras.get(id).copied().flatten();
        let camera = camera.ok_or_else(|| line.refuse(format!("there is no camera {}", shown(id.as_bytes()))))?;
        let is_oriented = used != 0 && state != NOT_ORIENTED;
        if is_oriented && order != OMEGA_PHI_KAPPA {
            return Err(line.refuse(format!("order {order} of the angles: only omega, phi, kappa (0) is known")));
        }
        if numbers.insert(name.clone(), is_oriented.then(|| images.len().into())).is_some() {
            return Err(line.refuse(format!("image {} stands twice", shown(name.as_bytes()))));
        }
        match is_oriented {
            true => images.push(Image::new(name, camera, FlightId(0), Pose { rotation, centre })),
            false => idle += 1,
        }
    }
    if images.is_empty() {
        return Err(lines.refuse("no image is oriented"));
    }
    if idle > 0 {
        notes.push(Note::loss(format!("{idle} images are left out: they are not used or not oriented")));
    }
    Ok((images, numbers))
}

/// Control points, and what the names of points stand for.
type Points = (Vec<SurveyedPoint>, Numbers<Point>);

fn points(path: &Path, tracks: &mut Tracks, notes: &mut Vec<Note>) -> Result<Points, Error> {
    let mut lines = Lines::open(path)?;
    let (mut control, mut numbers) = (Vec::new(), HashMap::new());
    let mut idle = 0;
    while let Some(mut line) = lines.next_words()? {
        let name = line.word("the point")?.to_owned();
        let position = Vector3::from(line.numbers::<3>("its coordinates")?) * M_PER_MM;
        let point = match line.is_empty() {
            true => Some(Point::Tie(tracks.point(name.as_str(), Some(position)))),
            false => {
                let sigma = line.numbers::<3>("standard deviations of the coordinates")?.map(|mm| mm * M_PER_MM);
                let [_, used, new]: [u32; 3] =
                    [line.whole("the number of rays")?, line.whole("use")?, line.whole("new or not")?];
                match (used != 0, new != 0) {
                    (false, _) => None,
                    (true, true) => Some(Point::Tie(tracks.point(name.as_str(), Some(position)))),
                    (true, false) => {
                        control.push(surveyed(name.clone(), position, sigma));
                        Some(Point::Control((control.len() - 1).into()))
                    }
                }
            }
        };
        idle += usize::from(point.is_none());
        if numbers.insert(name.clone(), point).is_some() {
            return Err(line.refuse(format!("point {} stands twice", shown(name.as_bytes()))));
        }
    }
    if idle > 0 {
        notes.push(Note::loss(format!("{idle} points are left out: they are not used")));
    }
    if !control.is_empty() {
        notes.push(Note::guess("points that are not new are control points"));
    }
    Ok((control, numbers))
}

fn surveyed(name: String, position: Vector3<f64>, [sx, sy, sz]: [f64; 3]) -> SurveyedPoint {
    let above_zero = |sigma: f64| (sigma > 0.0).then_some(sigma);
    let sigma_xy = above_zero(((sx * sx + sy * sy) / 2.0).sqrt());
    SurveyedPoint { name, position, role: Role::Control, sigma_xy, sigma_z: above_zero(sz) }
}

/// Gives the marks of control points, and the others to the tracks.
fn measurements(
    path: &Path,
    (cameras, images, image_of): (&[(Camera, f64)], &[Image], &Numbers<ImageId>),
    point_of: &mut Numbers<Point>,
    tracks: &mut Tracks,
    notes: &mut Vec<Note>,
) -> Result<Vec<Measurement>, Error> {
    let mut lines = Lines::open(path)?;
    let mut marks = Vec::new();
    let mut marked = HashSet::new();
    let (mut idle, mut unplaced) = (0, 0);
    while let Some(mut line) = lines.next_words()? {
        let image = line.word("the image")?;
        let point = line.word("the point")?;
        let [x, y, sx, sy, _, _] = line.numbers("x, y, their standard deviations and residuals, mm")?;
        let [_, used]: [u32; 2] = [line.whole("the method")?, line.whole("use")?];
        let image = *image_of
            .get(image)
            .ok_or_else(|| line.refuse(format!("there is no image {}", shown(image.as_bytes()))))?;
        let of_point = *point_of.entry(point.to_owned()).or_insert_with(|| {
            unplaced += 1;
            Some(Point::Tie(tracks.point(point, None)))
        });
        let (Some(image), Some(of_point), true) = (image, of_point, used != 0) else {
            idle += 1;
            continue;
        };
        let (camera, per_mm) = &cameras[images[image.index()].camera.index()];
        let [columns, rows] = [camera.width_px, camera.height_px].map(f64::from);
        let sigma = Some(((sx * sx + sy * sy) / 2.0).sqrt() * per_mm).filter(|sigma| *sigma > 0.0);
        let (x, y) = (0.5 * columns + x * per_mm, 0.5 * rows - y * per_mm);
        match of_point {
            Point::Tie(number) => tracks.push(Measurement { image, point: number, x, y, sigma }),
            Point::Control(number) if marked.insert((number, image)) => {
                marks.push(Measurement { image, point: number, x, y, sigma });
            }
            Point::Control(_) => {
                let problem = format!("point {} is measured twice in the image", shown(point.as_bytes()));
                return Err(line.refuse(problem));
            }
        }
    }
    if idle > 0 {
        notes.push(Note::loss(format!(
            "{idle} measurements are left out: they, their images or their points are not used"
        )));
    }
    if unplaced > 0 {
        notes.push(Note::fact(format!("{unplaced} measured points have no coordinates")));
    }
    Ok(marks)
}
