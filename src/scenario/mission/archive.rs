//! A `.kmz`: a zip file with a mission of DJI or a KML document.

use super::{Given, MOST_BYTES, Mission, MissionError, Place, Result, kml, wpml};
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// What the aircraft flies; `template.kml` beside it is what people edit, and adds nothing.
const WAYLINES: &str = "wpmz/waylines.wpml";

/// Reads the mission of a zip file.
///
/// # Errors
/// What is no zip file, has no mission, or is too long when unpacked.
pub(super) fn read(file: &str, bytes: &[u8], given: &Given) -> Result<Mission> {
    let refuse = |problem: String| MissionError::new(file, Place::File, problem);
    let mut zip =
        ZipArchive::new(Cursor::new(bytes)).map_err(|error| refuse(format!("expected a zip file: {error}")))?;
    let names: Vec<String> = zip.file_names().filter_map(|name| Some(name.ok()?.into_owned())).collect();
    let is_kml = |name: &&String| name.to_ascii_lowercase().ends_with(".kml") && !name.starts_with("wpmz/");
    let member = match names.iter().find(|name| *name == WAYLINES) {
        Some(waylines) => waylines,
        // The first document of a KMZ is the one that is shown.
        None => names.iter().find(is_kml).ok_or_else(|| refuse(format!("expected {WAYLINES} or a .kml in it")))?,
    };
    let name = format!("{file}, {member}");
    let refuse = |problem: String| MissionError::new(&name, Place::File, problem);
    let packed = zip.by_name(member).map_err(|error| refuse(format!("cannot be unpacked: {error}")))?;
    let mut unpacked = Vec::new();
    let read = packed.take(MOST_BYTES + 1).read_to_end(&mut unpacked);
    let length = read.map_err(|error| refuse(format!("cannot be unpacked: {error}")))?;
    if length as u64 > MOST_BYTES {
        return Err(refuse(format!("expected at most {MOST_BYTES} bytes when unpacked")));
    }
    let text = String::from_utf8(unpacked).map_err(|_| refuse("expected a text in UTF-8".into()))?;
    match member == WAYLINES {
        true => wpml::read(&name, &text, given),
        false => kml::read(&name, &text, given),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use zip::{ZipWriter, write::SimpleFileOptions};

    fn zipped(members: &[(&str, &str)]) -> Vec<u8> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, text) in members {
            zip.start_file(*name, SimpleFileOptions::default()).unwrap();
            zip.write_all(text.as_bytes()).unwrap();
        }
        zip.finish().unwrap().into_inner()
    }

    #[test]
    fn the_document_that_is_flown_is_read() {
        let kml = "<kml><Placemark><Point><altitudeMode>relativeToGround</altitudeMode>\
                   <coordinates>7,48,50</coordinates></Point></Placemark></kml>";
        let mission = read("m.kmz", &zipped(&[("doc.kml", kml)]), &Given::default()).unwrap();
        assert_eq!(mission.exposures.len(), 1);
        let dji = zipped(&[("wpmz/template.kml", kml), (WAYLINES, "<kml><Document/></kml>")]);
        let error = read("m.kmz", &dji, &Given::default()).unwrap_err().to_string();
        assert!(error.starts_with("m.kmz, wpmz/waylines.wpml"), "{error}");
        let error = read("m.kmz", &zipped(&[("wpmz/template.kml", kml)]), &Given::default()).unwrap_err();
        assert_eq!(error.to_string(), "m.kmz: expected wpmz/waylines.wpml or a .kml in it");
    }
}
