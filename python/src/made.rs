//! A block from columns that Python hands over: numbers as bytes (f64, little-endian), positions as bytes (u32), texts
//! as lists. NaN in an optional column is a value that is not there.

use crate::checked::{Wrong, checked};
use crate::errors::input;
use misclosure::block::{
    Block, CameraId, FlightId, Gnss, Image, ImageId, Measurement, PointId, Pose, Role, Sigma, SurveyedPoint, TiePoint,
};
use misclosure::camera::{Camera, PARAMETERS};
use misclosure::io::block::Loaded;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

/// As the reader of a block's files: four components rounded to six decimals have a length of one within this.
const QUATERNION_TOLERANCE: f64 = 1e-6;
/// Up to here the length is one but for rounding, and the quaternion stays as it is.
const QUATERNION_ROUNDING: f64 = 1e-14;

/// The columns of one argument.
struct Columns<'py> {
    argument: &'static str,
    dict: Bound<'py, PyDict>,
}

impl Columns<'_> {
    fn numbers(&self, name: &str) -> PyResult<Option<Vec<f64>>> {
        let read = |bytes: &[u8]| bytes.as_chunks().0.iter().map(|cell| f64::from_le_bytes(*cell)).collect();
        Ok(self.bytes(name)?.map(|bytes| read(bytes.as_bytes())))
    }

    fn indices(&self, name: &str) -> PyResult<Vec<u32>> {
        let read = |bytes: &[u8]| bytes.as_chunks().0.iter().map(|cell| u32::from_le_bytes(*cell)).collect();
        Ok(self.bytes(name)?.map(|bytes| read(bytes.as_bytes())).unwrap_or_default())
    }

    fn bytes(&self, name: &str) -> PyResult<Option<Bound<'_, PyBytes>>> {
        let Some(value) = self.dict.get_item(name)? else { return Ok(None) };
        Ok(Some(value.cast_into::<PyBytes>()?))
    }

    fn texts(&self, name: &str) -> PyResult<Vec<String>> {
        self.dict.get_item(name)?.map_or_else(|| Ok(Vec::new()), |value| value.extract())
    }

    /// A column that has to be there; Python fills in what has a default.
    fn finite(&self, name: &str, rows: usize) -> PyResult<Vec<f64>> {
        let values = self.numbers(name)?.unwrap_or_default();
        match values.iter().position(|value| !value.is_finite()) {
            _ if values.len() != rows => Err(self.wrong(None, name, &format!("has {} rows of {rows}", values.len()))),
            Some(row) => Err(self.wrong(Some(row), name, &format!("expected a finite number, found {}", values[row]))),
            None => Ok(values),
        }
    }

    /// A column in which NaN is a value that is not there; `positive`: others have to be.
    fn optional(&self, name: &str, rows: usize, positive: bool) -> PyResult<Vec<Option<f64>>> {
        let Some(values) = self.numbers(name)? else { return Ok(vec![None; rows]) };
        if values.len() != rows {
            return Err(self.wrong(None, name, &format!("has {} rows of {rows}", values.len())));
        }
        let is_wrong = |value: &f64| value.is_infinite() || (positive && *value <= 0.0);
        if let Some(row) = values.iter().position(is_wrong) {
            let expected = if positive { "a number above zero" } else { "a finite number" };
            return Err(self.wrong(Some(row), name, &format!("expected {expected} or NaN, found {}", values[row])));
        }
        Ok(values.into_iter().map(|value| Some(value).filter(|value| !value.is_nan())).collect())
    }

    /// Three columns that are there together or not at all, row by row.
    fn optional_places(&self, names: [&str; 3], rows: usize) -> PyResult<Vec<Option<Vector3<f64>>>> {
        let [x, y, z] = names.map(|name| self.optional(name, rows, false));
        let (x, y, z) = (x?, y?, z?);
        let place = |row: usize| match (x[row], y[row], z[row]) {
            (Some(x), Some(y), Some(z)) => Ok(Some(Vector3::new(x, y, z))),
            (None, None, None) => Ok(None),
            _ => Err(self.wrong(Some(row), &names.join(", "), "expected three numbers or three NaN")),
        };
        (0..rows).map(place).collect()
    }

    fn places(&self, rows: usize) -> PyResult<Vec<Vector3<f64>>> {
        let (x, y, z) = (self.finite("x", rows)?, self.finite("y", rows)?, self.finite("z", rows)?);
        Ok((0..rows).map(|row| Vector3::new(x[row], y[row], z[row])).collect())
    }

    fn wrong(&self, row: Option<usize>, column: &str, problem: &str) -> PyErr {
        let wrong = Wrong { argument: self.argument, row, column: column.to_owned(), problem: problem.to_owned() };
        input(self.dict.py(), &wrong.to_string())
    }
}

/// The block of these columns, as a reader of its files would give it.
pub fn made(name: &str, crs: &str, sigma: Sigma, given: &Bound<'_, PyDict>) -> PyResult<Loaded> {
    let py = given.py();
    let columns = |argument: &'static str| -> PyResult<Columns<'_>> {
        let dict = match given.get_item(argument)? {
            Some(dict) => dict.cast_into::<PyDict>()?,
            None => PyDict::new(py),
        };
        Ok(Columns { argument, dict })
    };
    let (images, flights) = images(&columns("images")?)?;
    let block = Block {
        name: name.to_owned(),
        crs: crs.to_owned(),
        survey_crs: String::new(),
        origin: Vector3::zeros(),
        sigma,
        cameras: cameras(&columns("cameras")?)?,
        flights,
        images,
        tie_points: tie_points(&columns("points")?)?,
        ties: measurements(&columns("ties")?)?,
        surveyed: surveyed(&columns("control")?)?,
        marks: measurements(&columns("marks")?)?,
        extra_image_columns: Vec::new(),
    };
    py.detach(|| checked(block)).map_err(|wrong| input(py, &wrong.to_string()))
}

fn cameras(columns: &Columns<'_>) -> PyResult<Vec<Camera>> {
    let ids = columns.texts("camera")?;
    let rows = ids.len();
    let (width, height) = (columns.indices("width_px")?, columns.indices("height_px")?);
    if width.len() != rows || height.len() != rows {
        return Err(columns.wrong(None, "width_px, height_px", &format!("expected {rows} rows")));
    }
    let pixel_um = columns.optional("pixel_um", rows, true)?;
    let values = PARAMETERS.iter().map(|name| columns.finite(name, rows)).collect::<PyResult<Vec<_>>>()?;
    let camera = |(k, id)| {
        let mut interior = [0.0; PARAMETERS.len()];
        interior.iter_mut().zip(&values).for_each(|(own, column)| *own = column[k]);
        Camera { id, width_px: width[k], height_px: height[k], pixel_um: pixel_um[k], interior }
    };
    Ok(ids.into_iter().enumerate().map(camera).collect())
}

fn images(columns: &Columns<'_>) -> PyResult<(Vec<Image>, Vec<String>)> {
    let names = columns.texts("image")?;
    let rows = names.len();
    let (camera, of_flight) = (columns.indices("camera")?, columns.texts("flight")?);
    if camera.len() != rows || of_flight.len() != rows {
        return Err(columns.wrong(None, "camera, flight", &format!("expected {rows} rows")));
    }
    let centres = columns.places(rows)?;
    let quaternion = ["qw", "qx", "qy", "qz"].iter().map(|name| columns.finite(name, rows));
    let quaternion = quaternion.collect::<PyResult<Vec<_>>>()?;
    let number = |name: &str, positive: bool| columns.optional(name, rows, positive);
    let (time, temperature) = (number("time_s", false)?, number("temperature_c", false)?);
    let (exposure, focus) = (number("exposure_s", true)?, number("focus_m", true)?);
    let (sigma_xy, sigma_z) = (number("gnss_sigma_xy", true)?, number("gnss_sigma_z", true)?);
    let gnss = columns.optional_places(["gnss_x", "gnss_y", "gnss_z"], rows)?;
    let velocity = columns.optional_places(["vx", "vy", "vz"], rows)?;
    let angular = columns.optional_places(["wx", "wy", "wz"], rows)?;
    let (mut images, mut flights): (Vec<Image>, Vec<String>) = (Vec::new(), Vec::new());
    let mut numbers = std::collections::HashMap::new();
    for (row, (name, flight)) in names.into_iter().zip(of_flight).enumerate() {
        let number = *numbers.entry(flight).or_insert_with_key(|flight| {
            flights.push(flight.clone());
            FlightId::from(flights.len() - 1)
        });
        let [w, x, y, z] = [0, 1, 2, 3].map(|k| quaternion[k][row]);
        let rotation = Quaternion::new(w, x, y, z);
        let off = (rotation.norm() - 1.0).abs();
        if off > QUATERNION_TOLERANCE {
            let problem = format!("expected a quaternion of length 1, found {}", rotation.norm());
            return Err(columns.wrong(Some(row), "qw, qx, qy, qz", &problem));
        }
        let rotation = match off <= QUATERNION_ROUNDING {
            true => UnitQuaternion::new_unchecked(rotation),
            false => UnitQuaternion::new_normalize(rotation),
        };
        let pose = Pose { rotation, centre: centres[row] };
        images.push(Image {
            time_s: time[row],
            temperature_c: temperature[row],
            gnss: gnss[row].map(|position| Gnss { position, sigma_xy: sigma_xy[row], sigma_z: sigma_z[row] }),
            velocity: velocity[row],
            angular_velocity: angular[row],
            exposure_s: exposure[row],
            focus_m: focus[row],
            ..Image::new(name, CameraId(camera[row]), number, pose)
        });
    }
    Ok((images, flights))
}

fn tie_points(columns: &Columns<'_>) -> PyResult<Vec<TiePoint>> {
    let names = columns.texts("point")?;
    let places = columns.optional_places(["x", "y", "z"], names.len())?;
    Ok(names.into_iter().zip(places).map(|(name, position)| TiePoint { name, position }).collect())
}

fn measurements(columns: &Columns<'_>) -> PyResult<Vec<Measurement>> {
    let (image, point) = (columns.indices("image")?, columns.indices("point")?);
    let rows = image.len();
    if point.len() != rows {
        return Err(columns.wrong(None, "point", &format!("has {} rows of {rows}", point.len())));
    }
    let (x, y) = (columns.finite("x", rows)?, columns.finite("y", rows)?);
    let sigma = columns.optional("sigma", rows, true)?;
    let row = |k: usize| Measurement {
        image: ImageId(image[k]),
        point: PointId(point[k]),
        x: x[k],
        y: y[k],
        sigma: sigma[k],
    };
    Ok((0..rows).map(row).collect())
}

fn surveyed(columns: &Columns<'_>) -> PyResult<Vec<SurveyedPoint>> {
    let (names, roles) = (columns.texts("point")?, columns.texts("role")?);
    let rows = names.len();
    if roles.len() != rows {
        return Err(columns.wrong(None, "role", &format!("has {} rows of {rows}", roles.len())));
    }
    let places = columns.places(rows)?;
    let (xy, z) = (columns.optional("sigma_xy", rows, true)?, columns.optional("sigma_z", rows, true)?);
    let point = |(k, (name, role)): (usize, (String, String))| {
        let role = match role.as_str() {
            "control" => Role::Control,
            "check" => Role::Check,
            _ => {
                let problem = format!("expected \"control\" or \"check\", found {role:?}");
                return Err(columns.wrong(Some(k), "role", &problem));
            }
        };
        Ok(SurveyedPoint { name, position: places[k], role, sigma_xy: xy[k], sigma_z: z[k] })
    };
    names.into_iter().zip(roles).enumerate().map(point).collect()
}
