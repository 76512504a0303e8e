//! What the XML documents of a project say, as they say it.

use super::super::super::error::{Error, shown};
use super::super::xml::Element;
use super::offset::offset;
use crate::geodesy::geographic::stated_sigma;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// A camera of Metashape's, which it calls a sensor.
pub(super) struct Sensor {
    pub id: String,
    pub label: String,
    pub width_px: u32,
    pub height_px: u32,
    pub pixel_um: Option<f64>,
    pub calibration: Calibration,
    /// Rows were taken to be exposed one after the other.
    pub has_rolling_shutter: bool,
    /// The sensor of a rig that this one's offset is against.
    pub master: Option<String>,
    /// Rotation to that sensor's camera axes, and projection centre in these; `None` where they are not stated.
    pub offset: Option<(Matrix3<f64>, Vector3<f64>)>,
}

/// An interior orientation; the formula stands in [`super::calibration`].
#[derive(Clone, Copy)]
pub(super) struct Calibration {
    /// Of y; that of x is `f + b1`.
    pub f: f64,
    /// Principal point from the outer corner of the top-left pixel, px.
    pub pp: [f64; 2],
    pub b: [f64; 2],
    pub k: [f64; 4],
    pub p: [f64; 4],
}

/// An image, which Metashape calls a camera.
pub(super) struct Photo {
    pub id: String,
    pub label: String,
    pub sensor: String,
    pub component: Option<String>,
    pub group: Option<String>,
    pub enabled: bool,
    /// Camera to chunk; `None` where it was not aligned.
    pub pose: Option<(Matrix3<f64>, Vector3<f64>)>,
    /// The image of a rig that has the pose of the exposure.
    pub master: Option<String>,
    pub reference: Option<Reference>,
}

/// Coordinates that were given, in the chunk's coordinate system.
#[derive(Clone, Copy)]
pub(super) struct Reference {
    pub position: Vector3<f64>,
    pub sigma_xy: Option<f64>,
    pub sigma_z: Option<f64>,
    /// Takes part in the adjustment; a marker that does not is a check point.
    pub enabled: bool,
}

/// A marker.
pub(super) struct Marker {
    pub id: String,
    pub label: String,
    pub reference: Option<Reference>,
}

/// Where a marker was seen.
pub(super) struct Location {
    pub marker: String,
    pub photo: String,
    pub xy: [f64; 2],
    /// By a person; else the program put it where it computed it.
    pub pinned: bool,
}

/// `x_world = t + s R x_chunk`.
#[derive(Clone, Copy)]
pub(super) struct Similarity {
    pub scale: f64,
    pub rotation: Matrix3<f64>,
    pub translation: Vector3<f64>,
}

/// A chunk without its frames.
pub(super) struct Chunk {
    pub label: String,
    pub sensors: Vec<Sensor>,
    pub photos: Vec<Photo>,
    pub markers: Vec<Marker>,
    /// Of the whole chunk, or of each of its components; empty where the chunk has no relation to a world.
    pub transforms: BTreeMap<Option<String>, Similarity>,
    /// The coordinate system in WKT, where there is one.
    pub wkt: Option<String>,
    /// `accuracy_*` of the settings.
    pub accuracies: BTreeMap<String, f64>,
}

/// Files of the tie points.
#[derive(Default)]
pub(super) struct PointCloud {
    pub points: Option<String>,
    /// Id of the image, file.
    pub projections: Vec<(String, String)>,
}

pub(super) fn chunk(element: Element<'_>) -> Result<Chunk, Error> {
    let all = |list| element.optional(list).into_iter().flat_map(Element::elements);
    let sensors = all("sensors").filter(|sensor| sensor.name() == "sensor");
    let mut photos = Vec::new();
    for photo in all("cameras") {
        match photo.name() {
            "camera" => photos.push(self::photo(photo, None)?),
            "group" => {
                for inner in photo.children("camera") {
                    photos.push(self::photo(inner, photo.optional_attribute("label"))?);
                }
            }
            _ => {}
        }
    }
    let mut transforms = BTreeMap::new();
    if let Some(whole) = similarity(element)? {
        transforms.insert(None, whole);
    }
    for component in all("components") {
        if let (Some(id), Some(similarity)) = (component.optional_attribute("id"), similarity(component)?) {
            transforms.insert(Some(id.to_owned()), similarity);
        }
    }
    let mut accuracies = BTreeMap::new();
    for property in all("settings").filter(|property| property.name() == "property") {
        if let Some(name) = property.optional_attribute("name").filter(|name| name.starts_with("accuracy_")) {
            accuracies.insert(name.to_owned(), property.number_attribute("value")?);
        }
    }
    Ok(Chunk {
        label: element.optional_attribute("label").unwrap_or_default().to_owned(),
        sensors: sensors.map(sensor).collect::<Result<_, _>>()?,
        photos,
        markers: all("markers").filter(|marker| marker.name() == "marker").map(marker).collect::<Result<_, _>>()?,
        transforms,
        wkt: element.optional("reference").map(|reference| reference.text().to_owned()).filter(|wkt| !wkt.is_empty()),
        accuracies,
    })
}

/// Where the markers of a frame were seen.
pub(super) fn locations(frame: Element<'_>) -> Result<Vec<Location>, Error> {
    let mut locations = Vec::new();
    for marker in frame.optional("markers").into_iter().flat_map(|markers| markers.children("marker")) {
        for location in marker.children("location") {
            locations.push(Location {
                marker: marker.attribute("marker_id")?.to_owned(),
                photo: location.attribute("camera_id")?.to_owned(),
                xy: [location.number_attribute("x")?, location.number_attribute("y")?],
                // Where it is not said, it was measured.
                pinned: flag(location, "pinned")?.unwrap_or(true),
            });
        }
    }
    Ok(locations)
}

/// Files of the tie points, in the document that holds them.
pub(super) fn point_cloud(element: Element<'_>) -> Result<PointCloud, Error> {
    let path = |child: Element<'_>| Ok::<String, Error>(child.attribute("path")?.to_owned());
    let projections = element.children("projections");
    Ok(PointCloud {
        points: element.optional("points").map(path).transpose()?,
        projections: projections
            .map(|file| Ok::<_, Error>((file.attribute("camera_id")?.to_owned(), path(file)?)))
            .collect::<Result<_, _>>()?,
    })
}

fn sensor(element: Element<'_>) -> Result<Sensor, Error> {
    let property = |name: &'static str| {
        element.children("property").find(move |property| property.optional_attribute("name") == Some(name))
    };
    let resolution = element.child("resolution")?;
    let (width_px, height_px) = (resolution.count_attribute("width")?, resolution.count_attribute("height")?);
    // What was adjusted is nearer to the truth than what it began with.
    let classed =
        |class| element.children("calibration").find(move |each| each.optional_attribute("class") == Some(class));
    let calibration = classed("adjusted").or_else(|| classed("initial")).or_else(|| element.optional("calibration"));
    let calibration = calibration.ok_or_else(|| {
        element.refuse("the sensor has no <calibration>; align the images in Metashape before exporting")
    })?;
    let pixel_mm = property("pixel_width").map(|property| property.number_attribute("value")).transpose()?;
    let shutter = property("rolling_shutter").or_else(|| element.optional("rolling_shutter"));
    Ok(Sensor {
        id: element.attribute("id")?.to_owned(),
        label: element.optional_attribute("label").unwrap_or_default().to_owned(),
        width_px,
        height_px,
        pixel_um: pixel_mm.map(|mm| 1000.0 * mm).filter(|um| *um > 0.0),
        calibration: self::calibration(calibration, width_px, height_px)?,
        has_rolling_shutter: shutter.is_some_and(|shutter| {
            let value = shutter.optional_attribute("value").unwrap_or(shutter.text());
            !matches!(value, "" | "0" | "false" | "disabled")
        }),
        master: element.optional_attribute("master_id").map(str::to_owned),
        offset: offset(element)?,
    })
}

fn calibration(element: Element<'_>, width_px: u32, height_px: u32) -> Result<Calibration, Error> {
    let kind = element.optional_attribute("type").unwrap_or("frame");
    if kind != "frame" {
        let found = shown(kind.as_bytes());
        return Err(element.refuse(format!("calibration of the type {found}; only \"frame\" is a Fraser camera")));
    }
    let value = |name| element.number_or_zero(name);
    let mut calibration = Calibration {
        f: 0.0,
        pp: [value("cx")?, value("cy")?],
        b: [value("b1")?, value("b2")?],
        k: [value("k1")?, value("k2")?, value("k3")?, value("k4")?],
        p: [value("p1")?, value("p2")?, value("p3")?, value("p4")?],
    };
    match element.optional("f") {
        // Since version 1.3 the principal point is counted from the middle of the image.
        Some(f) => {
            calibration.f = f.number()?;
            calibration.pp[0] += 0.5 * f64::from(width_px);
            calibration.pp[1] += 0.5 * f64::from(height_px);
        }
        None => {
            calibration.f = element.child("fy")?.number()?;
            calibration.b = [element.child("fx")?.number()? - calibration.f, value("skew")?];
        }
    }
    match calibration.f > 0.0 {
        true => Ok(calibration),
        false => Err(element.refuse(format!("expected a focal length above zero, found {}", calibration.f))),
    }
}

fn photo(element: Element<'_>, group: Option<&str>) -> Result<Photo, Error> {
    let pose = match element.optional("transform") {
        None => None,
        Some(transform) => {
            let m = transform.numbers::<16>()?;
            let rotation = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
            Some((rotation, Vector3::new(m[3], m[7], m[11])))
        }
    };
    let owned = |name| element.optional_attribute(name).map(str::to_owned);
    Ok(Photo {
        id: element.attribute("id")?.to_owned(),
        label: element.attribute("label")?.to_owned(),
        sensor: owned("sensor_id").unwrap_or_default(),
        component: owned("component_id"),
        group: group.filter(|group| !group.is_empty()).map(str::to_owned),
        enabled: flag(element, "enabled")?.unwrap_or(true),
        pose,
        master: owned("master_id"),
        reference: element.optional("reference").map(reference).transpose()?.flatten(),
    })
}

fn marker(element: Element<'_>) -> Result<Marker, Error> {
    Ok(Marker {
        id: element.attribute("id")?.to_owned(),
        label: element.attribute("label")?.to_owned(),
        reference: element.optional("reference").map(reference).transpose()?.flatten(),
    })
}

/// `None` where it has no coordinates, but only angles or a flag.
fn reference(element: Element<'_>) -> Result<Option<Reference>, Error> {
    let number = |name: &str| element.optional_number_attribute(name);
    let (Some(x), Some(y), Some(z)) = (number("x")?, number("y")?, number("z")?) else { return Ok(None) };
    let positive = |sigma: Option<f64>| {
        let stated = sigma.map(stated_sigma).transpose();
        stated.map(Option::flatten).map_err(|problem| element.refuse(format!("<reference>: {problem}")))
    };
    let each =
        positive(number("sx")?)?.zip(positive(number("sy")?)?).map(|(sx, sy)| ((sx * sx + sy * sy) / 2.0).sqrt());
    Ok(Some(Reference {
        position: Vector3::new(x, y, z),
        sigma_xy: positive(number("sxy")?.or(each))?,
        sigma_z: positive(number("sz")?)?,
        enabled: flag(element, "enabled")?.unwrap_or(true),
    }))
}

fn similarity(parent: Element<'_>) -> Result<Option<Similarity>, Error> {
    let Some(transform) = parent.optional("transform") else { return Ok(None) };
    let (Some(rotation), Some(translation)) = (transform.optional("rotation"), transform.optional("translation"))
    else {
        return Ok(None);
    };
    let scale = transform.optional("scale").map_or(Ok(1.0), |scale| scale.number())?;
    if scale <= 0.0 {
        return Err(transform.refuse(format!("expected a scale above zero, found {scale}")));
    }
    let rotation = Matrix3::from_row_slice(&rotation.numbers::<9>()?);
    Ok(Some(Similarity { scale, rotation, translation: translation.numbers::<3>()?.into() }))
}

fn flag(element: Element<'_>, name: &str) -> Result<Option<bool>, Error> {
    match element.optional_attribute(name) {
        None => Ok(None),
        Some("true" | "1") => Ok(Some(true)),
        Some("false" | "0") => Ok(Some(false)),
        Some(other) => {
            let found = shown(other.as_bytes());
            Err(element.refuse(format!("<{}> {name}: expected true or false, found {found}", element.name())))
        }
    }
}
