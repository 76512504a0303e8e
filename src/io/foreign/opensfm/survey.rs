//! Surveyed points: `ground_control_points.json`, else `gcp_list.txt`.

use super::super::super::error::{Error, Place, shown};
use super::super::gcp_list;
use super::super::tracks::Tracks;
use super::super::{Note, refuse};
use super::reconstruction::{self, GroundControl, GroundControlPoint};
use crate::block::{ImageId, Measurement, PointId, Role, SurveyedPoint};
use crate::geodesy::geographic::{Geographic, LocalSystem};
use std::collections::HashMap;
use std::path::Path;

/// Surveyed points and their marks.
#[derive(Default)]
pub(super) struct Survey {
    pub points: Vec<SurveyedPoint>,
    pub marks: Vec<Measurement>,
    /// Coordinate system of the file; empty where the file has latitudes and longitudes.
    pub system: String,
}

pub(super) fn read(
    folder: &Path,
    system: Option<LocalSystem>,
    images: &HashMap<&str, ImageId>,
    pixel: &dyn Fn(ImageId, [f64; 2]) -> [f64; 2],
    tracks: &mut Tracks,
    notes: &mut Vec<Note>,
) -> Result<Survey, Error> {
    let path = folder.join("ground_control_points.json");
    let beside = [folder.join("gcp_list.txt"), folder.join("../gcp_list.txt")];
    let list = beside.iter().find(|path| path.is_file());
    let is_json = path.is_file();
    if !is_json && list.is_none() {
        return Ok(Survey::default());
    }
    let Some(system) = system else {
        notes.push(Note::loss("without reference_lla ground control has no place in the world: left out"));
        return Ok(Survey::default());
    };
    if is_json {
        return json(&path, &system, images, pixel, tracks, notes);
    }
    let Some(list) = list else { return Ok(Survey::default()) };
    let control = gcp_list::read(list)?;
    let (points, marks) =
        control.in_system(&|place| Ok(system.local(place)), &|name| images.get(name).copied(), notes)?;
    Ok(Survey { points, marks, system: control.system })
}

fn json(
    path: &Path,
    system: &LocalSystem,
    images: &HashMap<&str, ImageId>,
    pixel: &dyn Fn(ImageId, [f64; 2]) -> [f64; 2],
    tracks: &mut Tracks,
    notes: &mut Vec<Note>,
) -> Result<Survey, Error> {
    let GroundControl { points } = reconstruction::read(path)?;
    let mut survey = Survey::default();
    let (mut strange, mut heightless, mut unseen) = (0, 0, 0);
    for point in &points {
        if points.iter().filter(|other| other.id == point.id).count() > 1 {
            return Err(refuse(path, format!("point {} stands twice", shown(point.id.as_bytes()))));
        }
        let seen: Vec<(ImageId, [f64; 2])> = point
            .observations
            .iter()
            .filter_map(|seen| Some((*images.get(seen.shot_id.as_str())?, seen.projection)))
            .map(|(image, xy)| (image, pixel(image, xy)))
            .collect();
        strange += point.observations.len() - seen.len();
        let Some(surveyed) = surveyed(path, point, system)? else {
            // Seen but not surveyed: a tie point that a person measured.
            heightless += usize::from(point.position.is_some());
            let number = tracks.point(format!("ground control {}", point.id), None);
            seen.iter().for_each(|(image, xy)| tracks.measure(*image, number, *xy));
            continue;
        };
        if seen.is_empty() {
            unseen += 1;
            continue;
        }
        let number = PointId::from(survey.points.len());
        survey.points.push(surveyed);
        survey.marks.extend(seen.into_iter().map(|(image, [x, y])| Measurement {
            image,
            point: number,
            x,
            y,
            sigma: None,
        }));
    }
    for (count, what) in [
        (strange, "marks are in images that are not in the reconstruction: left out"),
        (heightless, "ground control points have no place with an altitude: taken for tie points"),
        (unseen, "ground control points are measured in no image: left out"),
    ] {
        if count > 0 {
            notes.push(Note::loss(format!("{count} {what}")));
        }
    }
    Ok(survey)
}

fn surveyed(path: &Path, point: &GroundControlPoint, system: &LocalSystem) -> Result<Option<SurveyedPoint>, Error> {
    let role = match point.role.as_deref() {
        None | Some("optimization") => gcp_list::role_of(&point.id),
        Some("metrics_only") => Role::Check,
        Some(other) => {
            let problem = format!("role {}: expected optimization or metrics_only", shown(other.as_bytes()));
            return Err(Error::content(path.display().to_string(), Place::File, problem));
        }
    };
    let Some(position) = point.position else { return Ok(None) };
    let Some(height) = position.altitude else { return Ok(None) };
    let place = Geographic::checked(position.latitude, position.longitude, height).map_err(|problem| {
        let problem = format!("point {}: {problem}", shown(point.id.as_bytes()));
        Error::content(path.display().to_string(), Place::File, problem)
    })?;
    let Some(place) = place else { return Ok(None) };
    let position = system.local(&place);
    Ok(Some(SurveyedPoint { name: point.id.clone(), position, role, sigma_xy: None, sigma_z: None }))
}
