//! What is added to a block of the images `a.jpg` and `100_0001_0001.JPG`.

use exif::experimental::Writer;
use exif::{Field, In, Rational, Tag, Value};

pub const MRK: &str = "1\t302400.5\t[2300]\t   12,N\t  -34,E\t  150,V\t48.001,Lat\t2.0,Lon\t100.25,Ellh\t0.01, 0.02, \
                       0.03\t50,Q\n\
    2\t302403.057\t[2300]\t   12,N\t  -34,E\t  150,V\t48.0,Lat\t2.001,Lon\t101.25,Ellh\t0.01, 0.02, 0.03\t16,Q\n\
    3\t302405.0\t[2300]\t   12,N\t  -34,E\t  150,V\t48.0,Lat\t2.0,Lon\t101.25,Ellh\t0.01, 0.02, 0.03\t50,Q\n";

fn rational(values: &[(u32, u32)]) -> Value {
    Value::Rational(values.iter().map(|(num, denom)| Rational { num: *num, denom: *denom }).collect())
}

/// A JPEG of nothing but its EXIF and XMP.
pub fn image(time: &str, sub_second: &str, below: bool, xmp: &str) -> Vec<u8> {
    with_stamp(time, sub_second, below, xmp, None)
}

/// The same with the date and the time of a receiver.
pub fn with_stamp(time: &str, sub_second: &str, below: bool, xmp: &str, stamp: Option<(&str, [u32; 3])>) -> Vec<u8> {
    let ascii = |text: &str| Value::Ascii(vec![text.as_bytes().to_vec()]);
    let fields = [
        (Tag::DateTimeOriginal, ascii(time)),
        (Tag::SubSecTimeOriginal, ascii(sub_second)),
        (Tag::OffsetTimeOriginal, ascii("+02:00")),
        (Tag::ExposureTime, rational(&[(1, 800)])),
        (Tag::GPSLatitudeRef, ascii("N")),
        (Tag::GPSLatitude, rational(&[(48, 1), (0, 1), (36, 10)])),
        (Tag::GPSLongitudeRef, ascii("E")),
        (Tag::GPSLongitude, rational(&[(2, 1), (0, 1), (0, 1)])),
        (Tag::GPSAltitudeRef, Value::Byte(vec![u8::from(below)])),
        (Tag::GPSAltitude, rational(&[(125, 10)])),
    ]
    .map(|(tag, value)| Field { tag, ifd_num: In::PRIMARY, value });
    let stamp = stamp.map(|(date, [hours, minutes, seconds])| {
        let time = rational(&[(hours, 1), (minutes, 1), (seconds, 1)]);
        [(Tag::GPSDateStamp, ascii(date)), (Tag::GPSTimeStamp, time)]
    });
    let stamp: Vec<Field> =
        stamp.into_iter().flatten().map(|(tag, value)| Field { tag, ifd_num: In::PRIMARY, value }).collect();
    let mut writer = Writer::new();
    fields.iter().chain(&stamp).for_each(|field| writer.push_field(field));
    let mut tiff = std::io::Cursor::new(Vec::new());
    writer.write(&mut tiff, true).unwrap();
    let segment = |content: &[u8]| [&[0xff, 0xe1][..], &(content.len() as u16 + 2).to_be_bytes(), content].concat();
    let exif = segment(&[b"Exif\0\0", &tiff.into_inner()[..]].concat());
    let packet = format!(
        "http://ns.adobe.com/xap/1.0/\0<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF \
         xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\
         <rdf:Description xmlns:drone-dji=\"http://www.dji.com/drone-dji/1.0/\" {xmp}/></rdf:RDF></x:xmpmeta>"
    );
    let xmp = if xmp.is_empty() { Vec::new() } else { segment(packet.as_bytes()) };
    [&[0xff, 0xd8][..], &exif, &xmp, &[0xff, 0xd9]].concat()
}

/// Of DJI.
pub const XMP: &str = "drone-dji:GpsLatitude=\"+48.0\" drone-dji:GpsLongitude=\"+2.001\" \
                       drone-dji:AbsoluteAltitude=\"+99.5\" drone-dji:RtkStdLon=\"0.03\" drone-dji:RtkStdLat=\"0.01\" \
    drone-dji:RtkStdHgt=\"0.05\" drone-dji:FlightXSpeed=\"+1.0\" drone-dji:FlightYSpeed=\"+2.0\" \
    drone-dji:FlightZSpeed=\"-0.5\" drone-dji:SensorTemperature=\"31.5\" drone-dji:AltitudeType=\"RtkAlt\"";
/// `gcp_list.txt`.
pub const LIST: &str = "EPSG:4326\n2.001 48.0 5 99.5 199.5 a.jpg G1\n2.0 48.0 6 1 2 a.jpg CHK-1\n";
/// `ground_control_points.json`.
pub const CONTROL: &str = r#"{"points": [{"id": "p", "position": {"latitude": 48.0, "longitude": 2.0, "altitude": 100.0},
    "observations": [{"shot_id": "a.jpg", "projection": [0.01, -0.02]}]}]}"#;
/// Metashape's table of markers.
pub const TABLE: &str =
    "#CoordinateSystem: GEOGCS[\"WGS 84\",AUTHORITY[\"EPSG\",\"4326\"]]\nG1,2.001,48.0,5,0.01,0.02\na.jpg,G1,100,200\n";
/// ODM's `geo.txt`.
pub const GEO: &str = "EPSG:4326\na.jpg 2.0 48.0 120 0 0 0 0.5 1.5\n";
