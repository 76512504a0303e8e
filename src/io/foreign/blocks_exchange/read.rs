//! What the elements of a file say.

use super::super::super::error::{Error, shown};
use super::super::{HALF_PIXEL, Note, pose, refuse};
use super::distortion::FileCamera;
use super::records::{Record, Records};
use crate::block::{Pose, Role};
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// Elements that are records.
const RECORDS: [&str; 7] = ["SRS", "Photogroup", "Photo", "TiePoint", "ControlPoint", "Measurement", "Block"];
/// Names of the elements of a rotation matrix, row by row.
const MATRIX: [&str; 9] = [
    "Pose/Rotation/M_00",
    "Pose/Rotation/M_01",
    "Pose/Rotation/M_02",
    "Pose/Rotation/M_10",
    "Pose/Rotation/M_11",
    "Pose/Rotation/M_12",
    "Pose/Rotation/M_20",
    "Pose/Rotation/M_21",
    "Pose/Rotation/M_22",
];

/// An image.
pub(super) struct Photo {
    pub id: String,
    pub path: String,
    pub camera: usize,
    pub pose: Pose,
}

/// An image point of a photo, px from the outer corner of the top-left pixel.
pub(super) struct Sight {
    pub photo: String,
    pub xy: [f64; 2],
}

/// A surveyed point.
pub(super) struct Survey {
    pub name: String,
    pub position: Vector3<f64>,
    pub role: Role,
    pub sigma: [Option<f64>; 2],
    pub sights: Vec<Sight>,
}

/// The whole file.
#[derive(Default)]
pub(super) struct Contents {
    pub name: String,
    pub crs: String,
    pub cameras: Vec<FileCamera>,
    pub photos: Vec<Photo>,
    pub ties: Vec<(Option<Vector3<f64>>, Vec<Sight>)>,
    pub surveyed: Vec<Survey>,
    pub notes: Vec<Note>,
    /// Photos without a pose.
    pub unoriented: usize,
}

pub(super) fn read(file: &Path) -> Result<Contents, Error> {
    let mut records = Records::open(file, &RECORDS)?;
    let mut contents = Contents::default();
    let mut systems: Vec<(String, String)> = Vec::new();
    let (mut sights, mut photos, mut partial) = (Vec::new(), Vec::new(), 0);
    while let Some(record) = records.next()? {
        match record.name.as_str() {
            "SRS" => systems.push(system(&record)?),
            "Photo" => match photo(&record, contents.cameras.len())? {
                Some(photo) => photos.push(photo),
                None => contents.unoriented += 1,
            },
            "Photogroup" => {
                contents.cameras.push(camera(&record)?);
                contents.photos.append(&mut photos);
            }
            "Measurement" => sights.push(sight(&record)?),
            "TiePoint" => contents.ties.push((position(&record)?, std::mem::take(&mut sights))),
            "ControlPoint" => match survey(&record, std::mem::take(&mut sights))? {
                Some(point) => contents.surveyed.push(point),
                None => partial += 1,
            },
            _ => {
                contents.name = record.text("Name").unwrap_or_default().to_owned();
                contents.crs = crs(&record, &systems)?;
            }
        }
    }
    if contents.cameras.is_empty() {
        return Err(refuse(file, "there is no <Photogroup>"));
    }
    if partial > 0 {
        let text = format!("{partial} control points are left out: they have no coordinates, or not all three");
        contents.notes.push(Note::loss(text));
    }
    Ok(contents)
}

/// Id and name of a coordinate system; one that is not Cartesian is refused.
fn system(record: &Record) -> Result<(String, String), Error> {
    let definition = record.text("Definition").or(record.text("Name")).unwrap_or_default();
    let geographic = ["4326", "4979", "+proj=longlat", "GEOGCS[", "GEOGCRS[", "WGS84 geographic"];
    let is_geographic = geographic.iter().any(|sign| definition.contains(sign)) && !definition.contains("PROJC");
    if is_geographic {
        let found = shown(definition.as_bytes());
        return Err(
            record.refuse(format!("{found} is geographic; export in a projected, local or Earth-centred system"))
        );
    }
    Ok((record.required("Id")?.to_owned(), definition.to_owned()))
}

fn crs(record: &Record, systems: &[(String, String)]) -> Result<String, Error> {
    let Some(id) = record.text("SRSId") else { return Ok("local".into()) };
    let system = systems.iter().find(|(other, _)| other == id);
    let (_, definition) =
        system.ok_or_else(|| record.refuse(format!("there is no <SRS> of the id {}", shown(id.as_bytes()))))?;
    Ok(definition.clone())
}

fn camera(record: &Record) -> Result<FileCamera, Error> {
    let expected = |way: &str, allowed: &str| match record.text(way) {
        Some(text) if !text.eq_ignore_ascii_case(allowed) => {
            Err(record.refuse(format!("{way} is {}; only {allowed} can be read", shown(text.as_bytes()))))
        }
        _ => Ok(()),
    };
    expected("CameraModelType", "Perspective")?;
    expected("CameraOrientation", "XRightYDown")?;
    for (way, plain) in [("AspectRatio", 1.0), ("Skew", 0.0)] {
        if record.number(way)?.is_some_and(|number| number != plain) {
            return Err(record.refuse(format!("{way} is not {plain}: its definition is not known here")));
        }
    }
    let sides = record.numbers(["ImageDimensions/Width", "ImageDimensions/Height"])?;
    let side = |side: f64| (side >= 1.0 && side <= f64::from(u32::MAX) && side.fract() == 0.0).then_some(side as u32);
    let size = [side(sides[0]), side(sides[1])];
    let [Some(width), Some(height)] = size else {
        return Err(record.refuse(format!("{} x {} px is no size of an image", sides[0], sides[1])));
    };
    let longest = f64::from(width.max(height));
    let f = match (record.number("FocalLengthPixels")?, record.number("FocalLength")?, record.number("SensorSize")?) {
        (Some(f), ..) => f,
        (None, Some(mm), Some(sensor_mm)) => mm * longest / sensor_mm,
        _ => return Err(record.refuse("expected FocalLengthPixels, or FocalLength and SensorSize in mm")),
    };
    if !(f > 0.0 && f.is_finite()) {
        return Err(record.refuse(format!("expected a focal length above zero, found {f} px")));
    }
    let pp = match record.has("PrincipalPoint/x") {
        true => record.numbers(["PrincipalPoint/x", "PrincipalPoint/y"])?.map(|coordinate| coordinate + HALF_PIXEL),
        false if record.has("PrincipalPoint") => {
            return Err(record.refuse("the principal point is not in px (x, y)"));
        }
        false => [0.5 * f64::from(width), 0.5 * f64::from(height)],
    };
    let mut distortion = [0.0; 5];
    for (coefficient, name) in distortion.iter_mut().zip(["K1", "K2", "K3", "P1", "P2"]) {
        *coefficient = record.number(&format!("Distortion/{name}"))?.unwrap_or(0.0);
    }
    let name = record.text("Name").unwrap_or_default().to_owned();
    Ok(FileCamera { name, size: [width, height], f, pp, distortion })
}

/// `None` without a pose.
fn photo(record: &Record, camera: usize) -> Result<Option<Photo>, Error> {
    if !record.has("Pose/Center") || !record.has("Pose/Rotation") {
        return Ok(None);
    }
    if !record.has(MATRIX[0]) {
        return Err(record.refuse("the rotation is no matrix (M_00 to M_22); export rotations as matrices"));
    }
    let matrix = Matrix3::from_row_slice(&record.numbers(MATRIX)?);
    let rotation = pose::from_matrix(&matrix).ok_or_else(|| record.refuse("M_00 to M_22 are no rotation"))?;
    let centre = record.numbers(["Pose/Center/x", "Pose/Center/y", "Pose/Center/z"])?.into();
    let path = record.required("ImagePath")?.to_owned();
    Ok(Some(Photo { id: record.required("Id")?.to_owned(), path, camera, pose: Pose { rotation, centre } }))
}

fn sight(record: &Record) -> Result<Sight, Error> {
    let xy = record.numbers(["x", "y"])?.map(|coordinate| coordinate + HALF_PIXEL);
    Ok(Sight { photo: record.required("PhotoId")?.to_owned(), xy })
}

fn position(record: &Record) -> Result<Option<Vector3<f64>>, Error> {
    if !record.has("Position/") {
        return Ok(None);
    }
    record.numbers(["Position/x", "Position/y", "Position/z"]).map(|xyz| Some(xyz.into()))
}

/// `None` for one whose coordinates are not all known.
fn survey(record: &Record, sights: Vec<Sight>) -> Result<Option<Survey>, Error> {
    let category = record.text("Category").unwrap_or("Full");
    let complete = ["x", "y", "z"].iter().all(|axis| record.has(&format!("Position/{axis}")));
    if !complete || !["Full", "Check"].iter().any(|whole| category.eq_ignore_ascii_case(whole)) {
        return Ok(None);
    }
    let is_check = record.text("CheckPoint").is_some_and(|text| ["true", "1"].contains(&text));
    let role = if is_check || category.eq_ignore_ascii_case("Check") { Role::Check } else { Role::Control };
    let accuracy = |way: &str| Ok::<_, Error>(record.number(way)?.filter(|sigma| *sigma > 0.0));
    Ok(Some(Survey {
        name: record.required("Name")?.to_owned(),
        position: record.numbers(["Position/x", "Position/y", "Position/z"])?.into(),
        role,
        sigma: [accuracy("HorizontalAccuracy")?, accuracy("VerticalAccuracy")?],
        sights,
    }))
}
