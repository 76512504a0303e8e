//! What an image file says of its exposure: EXIF, and the XMP of DJI and Pix4D.

use super::super::super::error::{Error, shown};
use super::super::fill::Recorded;
use super::super::refuse;
use super::super::xml::{self, Element};
use super::contradictions::Said;
use super::time;
use crate::geodesy::geographic::{Geographic, stated_sigma};
use exif::{Exif, In, Rational, Tag, Value};
use nalgebra::Vector3;
use std::collections::HashMap;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// XMP stands among the first segments of a file.
const XMP_WITHIN_BYTES: u64 = 1 << 20;
/// DJI's `RtkFlag` of a receiver that knew nothing.
const NO_SOLUTION: &str = "0";

/// An image's own words on itself.
pub(super) struct Tags {
    pub recorded: Recorded,
    /// From UTC to the camera's clock, s, where the file says so.
    pub offset_s: Option<f64>,
    /// What it says twice.
    pub said: Said,
    /// What is wrong with its EXIF, of which the rest was read.
    pub damage: Option<String>,
}

/// Reads a file; `None` where it has neither EXIF nor XMP.
pub(super) fn read(path: &Path) -> Result<Option<Tags>, Error> {
    let failed = |source| Error::Read { path: path.to_owned(), source };
    let mut file = BufReader::new(super::super::super::open(path).map_err(failed)?);
    let mut damage = None;
    let exif = match exif::Reader::new().continue_on_error(true).read_from_container(&mut file) {
        Ok(exif) => Some(exif),
        Err(exif::Error::NotFound(_)) => None,
        Err(exif::Error::PartialResult(partial)) => {
            let (exif, errors) = partial.into_inner();
            damage = errors.first().map(ToString::to_string);
            Some(exif)
        }
        Err(error) => return Err(refuse(path, format!("EXIF: {error}"))),
    };
    file.seek(SeekFrom::Start(0)).map_err(failed)?;
    let mut start = Vec::new();
    file.take(XMP_WITHIN_BYTES).read_to_end(&mut start).map_err(failed)?;
    let xmp = match packet(&start) {
        Some(packet) => properties(path, packet)?,
        None => HashMap::new(),
    };
    if exif.is_none() && xmp.is_empty() {
        return Ok(None);
    }
    let source = Source { path, exif, xmp };
    let (recorded, offset_s) = (source.recorded()?, source.offset()?);
    let said = source.said(recorded.time_s, offset_s);
    Ok(Some(Tags { recorded, offset_s, said, damage }))
}

/// Between the tags that begin and end an XMP packet.
fn packet(bytes: &[u8]) -> Option<&str> {
    const END: &[u8] = b"</x:xmpmeta>";
    let find = |bytes: &[u8], what: &[u8]| bytes.windows(what.len()).position(|window| window == what);
    let start = find(bytes, b"<x:xmpmeta")?;
    let end = start + find(&bytes[start..], END)? + END.len();
    std::str::from_utf8(&bytes[start..end]).ok()
}

/// Attributes and simple elements of all descriptions, by name without name space.
fn properties(path: &Path, packet: &str) -> Result<HashMap<String, String>, Error> {
    let file = format!("{}, XMP", path.display());
    let document = xml::parse(&file, packet)?;
    let mut properties = HashMap::new();
    for description in Element::root(&file, &document).descendants("Description") {
        let attributes = description.attributes().map(|(name, value)| (name.to_owned(), value.to_owned()));
        properties.extend(attributes);
        let simple = description.elements().filter(|element| !element.text().is_empty());
        properties.extend(simple.map(|element| (element.name().to_owned(), element.text().to_owned())));
    }
    Ok(properties)
}

struct Source<'a> {
    path: &'a Path,
    exif: Option<Exif>,
    xmp: HashMap<String, String>,
}

impl Source<'_> {
    fn recorded(&self) -> Result<Recorded, Error> {
        let sigma = |names: [&str; 2]| -> Result<Option<f64>, Error> {
            let stated = |(name, sigma): (&str, f64)| {
                stated_sigma(sigma).map_err(|problem| refuse(self.path, format!("XMP {name}: {problem}")))
            };
            for name in names {
                if let Some(sigma) = self.number(name)? {
                    return stated((name, sigma));
                }
            }
            Ok(None)
        };
        let east_north = [sigma(["RtkStdLon", "GPSXYAccuracy"])?, sigma(["RtkStdLat", "GPSXYAccuracy"])?];
        let temperature = self.number("LensTemperature")?.or(self.number("SensorTemperature")?);
        // North, east, down.
        let speeds = [self.number("FlightXSpeed")?, self.number("FlightYSpeed")?, self.number("FlightZSpeed")?];
        let mut extra = Vec::new();
        for (name, column) in [("AltitudeType", "altitude_type"), ("RtkFlag", "gnss_quality")] {
            extra.extend(self.xmp.get(name).map(|value| (column, value.clone())));
        }
        let stated = self.place()?;
        let has_solution = self.xmp.get("RtkFlag").is_none_or(|flag| flag.trim() != NO_SOLUTION);
        let place = stated.flatten().filter(|_| has_solution);
        Ok(Recorded {
            time_s: self.time()?,
            place,
            nowhere: stated.is_some() && place.is_none(),
            sigma_xy: east_north[0].zip(east_north[1]).map(|(e, n)| ((e * e + n * n) / 2.0).sqrt()),
            sigma_z: sigma(["RtkStdHgt", "GPSZAccuracy"])?,
            velocity: match speeds {
                [Some(north), Some(east), Some(down)] => Some(Vector3::new(east, north, -down)),
                _ => None,
            },
            temperature_c: temperature,
            exposure_s: self.rational(Tag::ExposureTime).filter(|seconds| *seconds > 0.0),
            focus_m: self.rational(Tag::SubjectDistance).filter(|metres| *metres > 0.0),
            extra,
        })
    }

    /// Of the camera's clock: EXIF counts it in no zone.
    fn time(&self) -> Result<Option<f64>, Error> {
        let Some(text) = self.text(Tag::DateTimeOriginal) else { return Ok(None) };
        let fraction = self.text(Tag::SubSecTimeOriginal);
        // Cameras without a clock write blanks or zeros.
        if text.bytes().all(|byte| matches!(byte, b' ' | b':' | b'0')) {
            return Ok(None);
        }
        let found = shown(text.as_bytes());
        let expected = || refuse(self.path, format!("DateTimeOriginal: expected YYYY:MM:DD HH:MM:SS, found {found}"));
        time::seconds(&text, fraction.as_deref()).map(Some).ok_or_else(expected)
    }

    fn offset(&self) -> Result<Option<f64>, Error> {
        let Some(text) = self.text(Tag::OffsetTimeOriginal).filter(|text| !text.trim().is_empty()) else {
            return Ok(None);
        };
        let found = shown(text.as_bytes());
        let expected = || refuse(self.path, format!("OffsetTimeOriginal: expected +HH:MM, found {found}"));
        time::offset(&text).map(Some).ok_or_else(expected)
    }

    /// XMP has more digits than EXIF. `None` where nothing is stated, `Some(None)` where what is stated is no position.
    fn place(&self) -> Result<Option<Option<Geographic>>, Error> {
        let longitude = self.number("GpsLongitude")?.or(self.number("GpsLongtitude")?);
        if let (Some(latitude), Some(longitude), Some(height)) =
            (self.number("GpsLatitude")?, longitude, self.number("AbsoluteAltitude")?)
        {
            let place = Geographic::checked(latitude, longitude, height);
            return place.map(Some).map_err(|problem| refuse(self.path, format!("XMP: {problem}")));
        }
        let degrees = |tag, reference, negative: &str| {
            let [d, m, s] = self.rationals(tag)?.try_into().ok()?;
            let value: f64 = d + m / 60.0 + s / 3600.0;
            let is_negative = self.text(reference)?.trim() == negative;
            Some(if is_negative { -value } else { value })
        };
        let latitude = degrees(Tag::GPSLatitude, Tag::GPSLatitudeRef, "S");
        let longitude = degrees(Tag::GPSLongitude, Tag::GPSLongitudeRef, "W");
        let (Some(latitude), Some(longitude), Some(height)) = (latitude, longitude, self.rational(Tag::GPSAltitude))
        else {
            return Ok(None);
        };
        let height = self.signed(height);
        let place = Geographic::checked(latitude, longitude, height);
        place.map(Some).map_err(|problem| refuse(self.path, format!("GPS: {problem}")))
    }

    /// A height with the sign of its reference: some write the sign in both places.
    fn signed(&self, height: f64) -> f64 {
        let is_below = self.field(Tag::GPSAltitudeRef).and_then(|value| value.get_uint(0)) == Some(1);
        if is_below { -height.abs() } else { height }
    }

    /// What EXIF and XMP both say. A value that cannot be read contradicts nothing.
    fn said(&self, clock_s: Option<f64>, offset_s: Option<f64>) -> Said {
        let stamp = || {
            let [hours, minutes, seconds] = self.rationals(Tag::GPSTimeStamp)?.try_into().ok()?;
            let midnight = format!("{} 00:00:00", self.text(Tag::GPSDateStamp)?.trim_end_matches('\0').trim());
            Some(time::seconds(&midnight, None)? + 3600.0 * hours + 60.0 * minutes + seconds)
        };
        Said {
            exif_height: self.rational(Tag::GPSAltitude).map(|height| self.signed(height)),
            xmp_height: self.number("AbsoluteAltitude").ok().flatten(),
            gps_s: stamp(),
            clock_s,
            offset_s,
            utc_s: self.xmp.get("UTCAtExposure").and_then(|text| time::seconds(text, None)),
        }
    }

    fn number(&self, name: &str) -> Result<Option<f64>, Error> {
        let Some(text) = self.xmp.get(name) else { return Ok(None) };
        let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite());
        let found = shown(text.as_bytes());
        number.map(Some).ok_or_else(|| refuse(self.path, format!("XMP {name}: expected a number, found {found}")))
    }

    fn field(&self, tag: Tag) -> Option<&Value> {
        self.exif.as_ref()?.get_field(tag, In::PRIMARY).map(|field| &field.value)
    }

    fn text(&self, tag: Tag) -> Option<String> {
        match self.field(tag)? {
            Value::Ascii(parts) => parts.first().map(|part| String::from_utf8_lossy(part).into_owned()),
            _ => None,
        }
    }

    fn rationals(&self, tag: Tag) -> Option<Vec<f64>> {
        let finite = |value: f64| value.is_finite().then_some(value);
        match self.field(tag)? {
            Value::Rational(values) => values.iter().map(|value: &Rational| finite(value.to_f64())).collect(),
            Value::SRational(values) => values.iter().map(|value| finite(value.to_f64())).collect(),
            _ => None,
        }
    }

    fn rational(&self, tag: Tag) -> Option<f64> {
        self.rationals(tag)?.first().copied()
    }
}
