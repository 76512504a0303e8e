//! DJI's waypoints: place, height above the ground, heading.

use super::walk::{Nose, Waypoint};
use super::xml::Element;
use super::{Given, Result, above_ground};
use std::collections::BTreeSet;

/// A waypoint of a folder.
///
/// # Errors
/// No place, no height above a known ground, an unknown heading.
pub(super) fn waypoint(
    file: &str,
    folder: &Element,
    placemark: &Element,
    given: &Given,
    notes: &mut BTreeSet<String>,
) -> Result<Waypoint> {
    let point = placemark.child("Point").ok_or_else(|| placemark.refuse(file, "expected <Point> in it"))?;
    let [longitude, latitude] = numbers(point.text_of("coordinates")).ok_or_else(|| {
        point.refuse(file, format!("expected longitude and latitude, found {:.40?}", point.text_of("coordinates")))
    })?;
    let height = placemark.required(file, "executeHeight")?;
    let height_m = match folder.text_of("executeHeightMode") {
        "relativeToStartPoint" => Ok(height - given.ground_m.unwrap_or(0.0)),
        "realTimeFollowSurface" => {
            notes.insert("Heights are above the terrain, which is a plain here.".into());
            Ok(height)
        }
        "WGS84" => above_ground(height, given.ground_m),
        other => {
            Err(format!("executeHeightMode {other:?}: expected relativeToStartPoint, realTimeFollowSurface or WGS84"))
        }
    }
    .map_err(|problem| placemark.refuse(file, problem))?;
    let nose = match placemark.child("waypointHeadingParam") {
        Some(heading) => nose(file, heading, notes)?,
        None => Nose::Path,
    };
    Ok(Waypoint { place: [latitude, longitude], height_m, nose })
}

fn nose(file: &str, heading: &Element, notes: &mut BTreeSet<String>) -> Result<Nose> {
    let angle = || heading.number(file, "waypointHeadingAngle");
    Ok(match heading.text_of("waypointHeadingMode") {
        "" | "followWayline" => Nose::Path,
        "smoothTransition" => Nose::Turning(heading.required(file, "waypointHeadingAngle")?),
        "fixed" if heading.text_of("waypointHeadingAngleEnable") == "1" => {
            Nose::Turning(heading.required(file, "waypointHeadingAngle")?)
        }
        mode @ ("fixed" | "manually") => {
            // The angle is left over where it is not switched on.
            angle()?;
            notes.insert(format!("A heading is left open (`{mode}`): that of the path is taken."));
            Nose::Path
        }
        "towardPOI" => {
            let place = numbers::<3>(heading.text_of("waypointPoiPoint"));
            let [latitude, longitude, _] =
                place.ok_or_else(|| heading.refuse(file, "waypointPoiPoint: expected latitude, longitude, height"))?;
            Nose::Towards([latitude, longitude])
        }
        other => return Err(heading.refuse(file, format!("waypointHeadingMode {other:?} is not known"))),
    })
}

/// The first `N` numbers between commas.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let mut numbers = [0.0; N];
    let mut parts = text.split(',');
    for number in &mut numbers {
        *number = parts.next()?.trim().parse().ok().filter(|value: &f64| value.is_finite())?;
    }
    Some(numbers)
}
