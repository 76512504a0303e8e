//! KML: points, an image each, or lines along which images follow.
//!
//! Planning programs write waypoints as points, and often the path through them as a line besides: points then say
//! where the images are. Coordinates are longitude, latitude, height; `altitudeMode` says of which kind the height is,
//! and without it there is none.

use super::walk::{Nose, Step, Waypoint, walk};
use super::xml::{Element, parse};
use super::{Exposure, Given, Mission, Result, above_ground};

/// Elements that hold a line.
const LINES: [&str; 2] = ["LineString", "Track"];

/// Reads a document.
///
/// # Errors
/// Places without a height above a known ground; a document without points and lines.
pub(super) fn read(file: &str, text: &str, given: &Given) -> Result<Mission> {
    let root = parse(file, text)?;
    let mut found = Vec::new();
    root.descendants("missionConfig", &mut found);
    if let Some(config) = found.first() {
        return Err(config.refuse(file, "this is DJI's template: expected wpmz/waylines.wpml beside it, or the .kmz"));
    }
    let (mut points, mut lines, mut notes) = (Vec::new(), Vec::new(), Vec::new());
    let mut placemarks = Vec::new();
    root.descendants("Placemark", &mut placemarks);
    for placemark in placemarks {
        placemark.descendants("Point", &mut points);
        LINES.iter().for_each(|name| placemark.descendants(name, &mut lines));
    }
    let exposures = match (points.as_slice(), lines.as_slice()) {
        ([], []) => return Err(root.refuse(file, "expected placemarks with points or lines")),
        ([] | [_], lines @ [_, ..]) => {
            if points.len() == 1 {
                notes.push("The one point is no image: images follow along the line.".into());
            }
            notes.push("Images follow along the line as those of the scenario's first flight do.".into());
            along(file, lines, given)?
        }
        (points, lines) => {
            if !lines.is_empty() {
                notes.push(format!("Lines are not read: the {} points are the images.", points.len()));
            }
            at_points(file, points, given)?
        }
    };
    Ok(Mission { name: String::new(), speed_mps: None, exposures, notes })
}

/// An image at each point.
fn at_points(file: &str, points: &[&Element], given: &Given) -> Result<Vec<Exposure>> {
    let mut exposures = Vec::new();
    for point in points {
        let places = places(file, point, given)?;
        let [place] = places.as_slice() else {
            return Err(point.refuse(file, format!("expected the coordinates of one place, found {}", places.len())));
        };
        let steps = [Step::Fly(*place), Step::Shoot];
        exposures.extend(walk(&steps).map_err(|problem| point.refuse(file, problem))?);
    }
    Ok(exposures)
}

/// Images along lines.
fn along(file: &str, lines: &[&Element], given: &Given) -> Result<Vec<Exposure>> {
    let mut exposures = Vec::new();
    for line in lines {
        let places = places(file, line, given)?;
        let base = given.base_to_height.ok_or_else(|| {
            line.refuse(file, "a line has no images: expected a scenario with a flight, whose overlap they get")
        })?;
        let height = places.iter().map(|place| place.height_m).sum::<f64>() / places.len() as f64;
        let mut steps = vec![Step::Every { metres: base * height, now: true }];
        steps.extend(places.into_iter().map(Step::Fly));
        exposures.extend(walk(&steps).map_err(|problem| line.refuse(file, problem))?);
    }
    Ok(exposures)
}

/// The places of a geometry; at least one.
fn places(file: &str, geometry: &Element, given: &Given) -> Result<Vec<Waypoint>> {
    let mode = geometry.text_of("altitudeMode");
    let above = |height: f64| match mode {
        "relativeToGround" => Ok(height - given.ground_m.unwrap_or(0.0)),
        "absolute" => above_ground(height, given.ground_m),
        "" => Err("its heights do not count without <altitudeMode>: expected relativeToGround or absolute".into()),
        other => Err(format!("<altitudeMode> {other:?}: expected relativeToGround or absolute")),
    };
    let mut places = Vec::new();
    // A track has an element for each place, with blanks in the place of commas.
    for element in geometry.children.iter().filter(|child| ["coordinates", "coord"].contains(&child.name.as_str())) {
        let is_track = element.name == "coord";
        let tuples: Vec<&str> =
            if is_track { vec![element.text()] } else { element.text().split_whitespace().collect() };
        for tuple in tuples {
            let parts = tuple.split(|c: char| if is_track { c.is_whitespace() } else { c == ',' });
            let numbers: Option<Vec<f64>> =
                parts.map(|part| part.parse().ok().filter(|v: &f64| v.is_finite())).collect();
            let Some([longitude, latitude, height]) = numbers.as_deref() else {
                let expected = format!("expected longitude, latitude and height, found {tuple:.40?}");
                return Err(element.refuse(file, expected));
            };
            let height_m = above(*height).map_err(|problem| geometry.refuse(file, problem))?;
            places.push(Waypoint { place: [*latitude, *longitude], height_m, nose: Nose::Path });
        }
    }
    match places.is_empty() {
        true => Err(geometry.refuse(file, "expected <coordinates> in it")),
        false => Ok(places),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(mode: &str, coordinates: &str) -> String {
        format!("<Placemark><Point>{mode}<coordinates>{coordinates}</coordinates></Point></Placemark>")
    }

    const GROUND: &str = "<altitudeMode>relativeToGround</altitudeMode>";
    const SEA: &str = "<altitudeMode>absolute</altitudeMode>";

    fn document(placemarks: &str) -> String {
        format!("<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document>{placemarks}</Document></kml>")
    }

    #[test]
    fn points_are_images_in_their_order() {
        let text = document(&(point(GROUND, "7.5,48.25,50") + &point(GROUND, " 7.6,48.25,60\n")));
        let mission = read("m.kml", &text, &Given::default()).unwrap();
        let places: Vec<_> =
            mission.exposures.iter().map(|own| [own.latitude_deg, own.longitude_deg, own.height_m]).collect();
        assert_eq!(places, [[48.25, 7.5, 50.0], [48.25, 7.6, 60.0]]);
        assert!(mission.exposures.iter().all(|own| own.heading_deg.is_none() && own.tilt_deg.is_none()));
        let ground = Given { ground_m: Some(100.0), ..Given::default() };
        let absolute = read("m.kml", &document(&point(SEA, "7.5,48.25,150")), &ground).unwrap();
        assert_eq!(absolute.exposures[0].height_m, 50.0);
    }

    #[test]
    fn images_follow_along_a_line_with_the_given_overlap() {
        // 0.001 degrees of latitude are 111.2 m.
        let line = format!(
            "<Placemark><LineString>{GROUND}<coordinates>7,48,50 7,48.001,50</coordinates></LineString></Placemark>"
        );
        let track = format!(
            "<Placemark><gx:Track>{GROUND}<when/><gx:coord>7 48 50</gx:coord>\
             <gx:coord>7 48.001 50</gx:coord></gx:Track></Placemark>"
        );
        let given = Given { base_to_height: Some(0.5), ..Given::default() };
        for text in [&line, &track] {
            let mission = read("m.kml", &document(text), &given).unwrap();
            assert_eq!(mission.exposures.len(), 5, "{mission:?}");
            let error = read("m.kml", &document(text), &Given::default()).unwrap_err().to_string();
            assert!(error.contains("expected a scenario with a flight"), "{error}");
        }
        let both = read("m.kml", &document(&(line + &point(GROUND, "7,48,0"))), &given).unwrap();
        assert_eq!((both.exposures.len(), both.notes.len()), (5, 2));
    }

    #[test]
    fn what_is_no_height_above_the_ground_is_refused() {
        for (mode, expected) in [
            ("", "<Point>: its heights do not count"),
            (SEA, "--ground"),
            ("<altitudeMode>clampToGround</altitudeMode>", "\"clampToGround\": expected relativeToGround"),
        ] {
            let error = read("m.kml", &document(&point(mode, "7,48,50")), &Given::default()).unwrap_err().to_string();
            assert!(error.starts_with("m.kml:1:") && error.contains(expected), "{error}");
        }
        for (text, expected) in [
            (document(&point(GROUND, "7,48")), "expected longitude, latitude and height, found \"7,48\""),
            (document(""), "expected placemarks with points or lines"),
            (document("<wpml:missionConfig/>"), "expected wpmz/waylines.wpml"),
        ] {
            let error = read("m.kml", &text, &Given::default()).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
