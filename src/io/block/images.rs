//! `images.csv`: one row per image.

use super::super::csv_table::Table;
use super::super::error::{advice, shown};
use super::super::names::Names;
use super::super::table::TableWriter;
use super::block_toml::ReferenceFrame;
use super::{BLOCK, Error, IMAGES, Place, SetAside};
use crate::block::{Block, CameraId, FlightId, Gnss, Image, Pose};
use nalgebra::{Quaternion, UnitQuaternion};
use std::path::Path;

/// A quaternion's length may differ from one by this much: its four components rounded to six decimals change the
/// length by at most 2 x 0.5e-6. It is then normalised.
const QUATERNION_TOLERANCE: f64 = 1e-6;
/// Up to here a quaternion's length is one but for rounding, and the quaternion is taken as it stands, so that writing
/// and reading is exact. As a change of scale it moves an image point by less than 1e-9 px.
const QUATERNION_ROUNDING: f64 = 1e-14;

const CENTRE: [&str; 3] = ["x", "y", "z"];
const QUATERNION: [&str; 4] = ["qw", "qx", "qy", "qz"];
const GNSS: [&str; 3] = ["gnss_x", "gnss_y", "gnss_z"];
const VELOCITY: [&str; 3] = ["vx", "vy", "vz"];
const ANGULAR_VELOCITY: [&str; 3] = ["wx", "wy", "wz"];

/// What `images.csv` says.
pub(super) struct Images {
    pub images: Vec<Image>,
    pub names: Names,
    pub flights: Vec<String>,
    pub extra_columns: Vec<(String, Vec<String>)>,
}

/// Where the columns stand.
struct Columns {
    image: usize,
    camera: usize,
    flight: usize,
    time_s: Option<usize>,
    temperature_c: Option<usize>,
    centre: [usize; 3],
    quaternion: [usize; 4],
    gnss: Option<[usize; 3]>,
    gnss_sigma_xy: Option<usize>,
    gnss_sigma_z: Option<usize>,
    velocity: Option<[usize; 3]>,
    angular_velocity: Option<[usize; 3]>,
    exposure_s: Option<usize>,
    focus_m: Option<usize>,
}

impl Columns {
    fn find(table: &Table) -> Result<Self, Error> {
        Ok(Self {
            image: table.column("image")?,
            camera: table.column("camera")?,
            flight: table.column("flight")?,
            time_s: table.optional_column("time_s"),
            temperature_c: table.optional_column("temperature_c"),
            centre: table.columns(CENTRE)?,
            quaternion: table.columns(QUATERNION)?,
            gnss: table.optional_columns(GNSS)?,
            gnss_sigma_xy: table.optional_column("gnss_sigma_xy"),
            gnss_sigma_z: table.optional_column("gnss_sigma_z"),
            velocity: table.optional_columns(VELOCITY)?,
            angular_velocity: table.optional_columns(ANGULAR_VELOCITY)?,
            exposure_s: table.optional_column("exposure_s"),
            focus_m: table.optional_column("focus_m"),
        })
    }
}

pub(super) fn read(table: &mut Table, frame: &ReferenceFrame, set_aside: &mut SetAside) -> Result<Images, Error> {
    let columns = Columns::find(table)?;
    let extra: Vec<usize> = (0..table.header().len()).filter(|column| !is_known(&table.header()[*column])).collect();
    let mut extra_columns: Vec<(String, Vec<String>)> =
        extra.iter().map(|column| (table.header()[*column].clone(), Vec::new())).collect();
    let camera_ids: Vec<&str> = frame.cameras.iter().map(|camera| camera.id.as_str()).collect();
    let (mut images, mut names, mut flights) = (Vec::new(), Names::default(), Names::default());
    while table.next()? {
        let name = table.text(columns.image)?;
        let (number, is_new) = names.insert(table.name(columns.image)?);
        if !is_new {
            let problem =
                format!("image {} stands twice, first in line {}", shown(name.as_bytes()), table.line(number as usize));
            return Err(table.refuse(columns.image, problem));
        }
        let camera = table.text(columns.camera)?;
        let camera = camera_ids.iter().position(|id| *id == camera).ok_or_else(|| {
            let problem =
                format!("{} is not a camera of {BLOCK}; {}", shown(camera.as_bytes()), advice(camera, &camera_ids));
            table.refuse(columns.camera, problem)
        })?;
        table.text(columns.flight)?;
        let flight = flights.insert(table.name(columns.flight)?).0;
        let image = Image {
            name: name.to_owned(),
            camera: CameraId::from(camera),
            flight: FlightId(flight),
            time_s: table.optional_number(columns.time_s)?,
            temperature_c: table.optional_number(columns.temperature_c)?,
            pose: Pose { centre: table.vector(columns.centre)?, rotation: rotation(table, columns.quaternion)? },
            gnss: gnss(table, &columns, frame, set_aside)?,
            velocity: table.optional_vector(columns.velocity)?,
            angular_velocity: table.optional_vector(columns.angular_velocity)?,
            exposure_s: table.optional_positive(columns.exposure_s)?,
            focus_m: table.optional_positive(columns.focus_m)?,
        };
        for ((_, cells), column) in extra_columns.iter_mut().zip(&extra) {
            cells.push(table.text(*column)?.to_owned());
        }
        images.push(image);
    }
    if images.is_empty() {
        return Err(Error::content(IMAGES, Place::File, "there is no image; the table has a header and no row"));
    }
    let flights = (0..flights.len()).map(|flight| String::from_utf8_lossy(flights.get(flight)).into_owned()).collect();
    Ok(Images { images, names, flights, extra_columns })
}

fn rotation(table: &Table, columns: [usize; 4]) -> Result<UnitQuaternion<f64>, Error> {
    let [w, x, y, z] = columns;
    let quaternion = Quaternion::new(table.number(w)?, table.number(x)?, table.number(y)?, table.number(z)?);
    let length = quaternion.norm();
    let error = (length - 1.0).abs();
    if error <= QUATERNION_ROUNDING {
        Ok(UnitQuaternion::new_unchecked(quaternion))
    } else if error <= QUATERNION_TOLERANCE {
        Ok(UnitQuaternion::new_normalize(quaternion))
    } else {
        let problem = format!("the quaternion has length {length}, expected 1 within {QUATERNION_TOLERANCE:e}");
        Err(table.refuse(w, problem))
    }
}

fn gnss(
    table: &Table,
    columns: &Columns,
    frame: &ReferenceFrame,
    set_aside: &mut SetAside,
) -> Result<Option<Gnss>, Error> {
    let sigma_xy = table.optional_positive(columns.gnss_sigma_xy)?;
    let sigma_z = table.optional_positive(columns.gnss_sigma_z)?;
    let Some(position) = table.optional_vector(columns.gnss)? else {
        set_aside.positionless_gnss_sigmas += usize::from(sigma_xy.is_some() || sigma_z.is_some());
        return Ok(None);
    };
    let defaults = [
        (sigma_xy, frame.sigma.gnss_xy_m, "gnss_sigma_xy", "gnss_xy_m"),
        (sigma_z, frame.sigma.gnss_z_m, "gnss_sigma_z", "gnss_z_m"),
    ];
    for (sigma, default, column, key) in defaults {
        if sigma.is_none() && default.is_infinite() {
            let problem =
                format!("a GNSS position without standard deviation; give {column} here or {key} in {BLOCK}, [sigma]");
            return Err(table.refuse_row(problem));
        }
    }
    Ok(Some(Gnss { position, sigma_xy, sigma_z }))
}

/// A number of an image, where known.
type Value = fn(&Image) -> Option<f64>;

/// The columns of numbers, in the order in which they are written, those that no image has left out.
const NUMBERS: [(&str, Value); 22] = [
    ("time_s", |image| image.time_s),
    ("temperature_c", |image| image.temperature_c),
    ("x", |image| Some(image.pose.centre.x)),
    ("y", |image| Some(image.pose.centre.y)),
    ("z", |image| Some(image.pose.centre.z)),
    ("qw", |image| Some(image.pose.rotation.w)),
    ("qx", |image| Some(image.pose.rotation.i)),
    ("qy", |image| Some(image.pose.rotation.j)),
    ("qz", |image| Some(image.pose.rotation.k)),
    ("gnss_x", |image| Some(image.gnss?.position.x)),
    ("gnss_y", |image| Some(image.gnss?.position.y)),
    ("gnss_z", |image| Some(image.gnss?.position.z)),
    ("gnss_sigma_xy", |image| image.gnss?.sigma_xy),
    ("gnss_sigma_z", |image| image.gnss?.sigma_z),
    ("vx", |image| Some(image.velocity?.x)),
    ("vy", |image| Some(image.velocity?.y)),
    ("vz", |image| Some(image.velocity?.z)),
    ("wx", |image| Some(image.angular_velocity?.x)),
    ("wy", |image| Some(image.angular_velocity?.y)),
    ("wz", |image| Some(image.angular_velocity?.z)),
    ("exposure_s", |image| image.exposure_s),
    ("focus_m", |image| image.focus_m),
];

/// Whether a column is one of the format.
fn is_known(name: &str) -> bool {
    ["image", "camera", "flight"].contains(&name) || NUMBERS.iter().any(|(known, _)| *known == name)
}

pub(super) fn write(block: &Block, path: &Path) -> Result<(), Error> {
    let has_value = |(_, value): &&(&str, Value)| block.images.iter().any(|image| value(image).is_some());
    let numbers: Vec<_> = NUMBERS.iter().filter(has_value).collect();
    let mut header = vec!["image", "camera", "flight"];
    header.extend(numbers.iter().map(|(name, _)| name));
    header.extend(block.extra_image_columns.iter().map(|(name, _)| name.as_str()));
    let mut table = TableWriter::create(path, &header)?;
    for (row, image) in block.images.iter().enumerate() {
        table.text(&image.name).text(&block.cameras[image.camera.index()].id);
        table.text(&block.flights[image.flight.index()]);
        for (_, value) in &numbers {
            table.optional(value(image));
        }
        for (_, cells) in &block.extra_image_columns {
            table.text(&cells[row]);
        }
        table.end_row()?;
    }
    table.finish()
}
