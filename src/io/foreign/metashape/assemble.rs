//! From a project to a block.

use super::super::super::error::{Error, Place, shown};
use super::super::tracks::Tracks;
use super::super::{GUESSED, ImportOptions, Note, flight_of};
use super::document::{Chunk, Marker, Photo, Reference, Similarity};
use super::project::Project;
use super::rig::{Rigs, Slaves};
use super::world::World;
use crate::block::{Block, Gnss, Image, ImageId, Measurement, PointId, Role, Sigma, SurveyedPoint};
use crate::camera::Camera;
use nalgebra::{Matrix3, Vector3};
use std::collections::{HashMap, HashSet};

pub(super) fn block(project: Project, options: &ImportOptions, notes: &mut Vec<Note>) -> Result<Block, Error> {
    let Project { file, name, chunk, locations, projections, points } = project;
    let refuse = |problem: String| Error::content(&file, Place::File, problem);
    let oriented = oriented(&chunk, notes);
    if oriented.is_empty() {
        return Err(refuse("no enabled image has a pose; align the images in Metashape".into()));
    }
    let world = World::of(&chunk, oriented.iter().map(|oriented| (oriented.similarity, oriented.centre)), notes)
        .map_err(refuse)?;
    let sigma = sigma(&chunk, options, notes);
    let (cameras, number_of_sensor) = cameras(&file, &chunk, options, notes)?;
    let mut flights: Vec<String> = Vec::new();
    let mut images = Vec::with_capacity(oriented.len());
    let mut image_of_photo = HashMap::new();
    let repeated = repeated(oriented.iter().map(|oriented| oriented.photo.label.as_str()));
    for Oriented { photo, similarity, rotation, centre } in &oriented {
        let camera = number_of_sensor.get(photo.sensor.as_str()).ok_or_else(|| {
            refuse(format!("image {}: sensor {} is not there", quoted(&photo.label), quoted(&photo.sensor)))
        })?;
        let pose = world
            .pose(similarity, rotation, centre)
            .ok_or_else(|| refuse(format!("image {}: <transform> is no rotation", quoted(&photo.label))))?;
        let flight = photo.group.as_deref().unwrap_or_else(|| flight_of(&photo.label));
        let flight = flights.iter().position(|other| other == flight).unwrap_or_else(|| {
            flights.push(flight.to_owned());
            flights.len() - 1
        });
        image_of_photo.insert(photo.id.as_str(), ImageId::from(images.len()));
        images.push(Image {
            gnss: gnss(photo, &world).map_err(refuse)?,
            ..Image::new(unique(&photo.label, &photo.id, &repeated), (*camera).into(), flight.into(), pose)
        });
    }
    let unused = oriented.iter().filter(|oriented| oriented.photo.reference.is_some_and(|r| !r.enabled)).count();
    if unused > 0 {
        notes.push(Note::loss(format!("{unused} images have a position that Metashape does not use: left out")));
    }
    let is_nowhere = |oriented: &&Oriented<'_>| {
        oriented.photo.reference.is_some_and(|reference| reference.enabled && world.is_nowhere(&reference.position))
    };
    let nowhere = oriented.iter().filter(is_nowhere).count();
    if nowhere > 0 {
        notes.push(Note::loss(format!("{nowhere} images have the position 0, 0, which is none: left out")));
    }
    // Points have no component: where there are several, nobody knows in whose coordinates they are.
    let similarity = (chunk.transforms.len() <= 1).then(|| oriented[0].similarity);
    let mut tracks = tracks(&file, &projections, &points, &image_of_photo, notes, |point| {
        Some(world.position(&similarity?, &point))
    })?;
    let seen: Vec<(&str, ImageId, [f64; 2])> = {
        let pinned = locations.iter().filter(|location| location.pinned);
        let own = pinned.filter_map(|l| Some((l.marker.as_str(), *image_of_photo.get(l.photo.as_str())?, l.xy)));
        own.collect()
    };
    let computed = locations.iter().filter(|location| !location.pinned).count();
    if computed > 0 {
        notes.push(Note::loss(format!("{computed} marks that Metashape computed and nobody measured are left out")));
    }
    let (surveyed, marks) = survey(&chunk.markers, &seen, &world, &mut tracks, notes).map_err(refuse)?;
    let (tie_points, ties) = tracks.finish(notes);
    Ok(Block {
        name: if chunk.label.is_empty() { name } else { format!("{name}, {}", chunk.label) },
        crs: world.crs(),
        survey_crs: String::new(),
        sigma,
        cameras,
        flights,
        images,
        tie_points,
        ties,
        surveyed,
        marks,
        origin: Vector3::zeros(),
        extra_image_columns: Vec::new(),
    })
}

/// An image that has a pose.
struct Oriented<'a> {
    photo: &'a Photo,
    similarity: Similarity,
    rotation: Matrix3<f64>,
    centre: Vector3<f64>,
}

fn oriented<'a>(chunk: &'a Chunk, notes: &mut Vec<Note>) -> Vec<Oriented<'a>> {
    let alone = Similarity { scale: 1.0, rotation: Matrix3::identity(), translation: Vector3::zeros() };
    let (mut disabled, mut unaligned) = (0, 0);
    let rigs = Rigs::of(chunk);
    let mut slaves = Slaves::default();
    let mut oriented = Vec::new();
    for photo in &chunk.photos {
        let is_slave = photo.pose.is_none() && photo.master.as_ref().is_some_and(|master| *master != photo.id);
        let component = rigs.master(photo).filter(|_| is_slave).map_or(&photo.component, |master| &master.component);
        let similarity = match chunk.transforms.get(component).or(chunk.transforms.get(&None)) {
            Some(similarity) => Some(*similarity),
            None => chunk.transforms.is_empty().then_some(alone),
        };
        let pose = match photo.enabled && is_slave {
            true => rigs.pose(photo).map(Some).unwrap_or_else(|reason| {
                slaves.lost.push(reason);
                None
            }),
            false => photo.pose,
        };
        match (photo.enabled, pose, similarity) {
            (false, ..) => disabled += 1,
            (true, Some((rotation, centre)), Some(similarity)) => {
                slaves.resolved += usize::from(is_slave);
                oriented.push(Oriented { photo, similarity, rotation, centre });
            }
            // Why a slave has no pose is said below.
            (true, None, _) if is_slave => {}
            (true, ..) => unaligned += 1,
        }
    }
    slaves.tell(notes);
    for (count, why) in [(disabled, "disabled"), (unaligned, "not aligned")] {
        if count > 0 {
            notes.push(Note::loss(format!("{count} images are {why} in Metashape: left out")));
        }
    }
    oriented
}

/// As the project's settings have them.
fn sigma(chunk: &Chunk, options: &ImportOptions, notes: &mut Vec<Note>) -> Sigma {
    let mut guessed = Vec::new();
    let mut of = |setting: &str, guess: f64, what: &str| {
        let accuracy = chunk.accuracies.get(&format!("accuracy_{setting}")).copied();
        accuracy.filter(|accuracy| *accuracy > 0.0).unwrap_or_else(|| {
            guessed.push(format!("{guess} {what}"));
            guess
        })
    };
    let (markers, cameras) = (
        of("markers", GUESSED.control_xy_m, "m for control"),
        of("cameras", GUESSED.gnss_xy_m, "m for GNSS positions"),
    );
    let sigma = Sigma {
        tie_px: options.tie_px.unwrap_or_else(|| of("tiepoints", GUESSED.tie_px, "px for tie points")),
        mark_px: of("projections", GUESSED.mark_px, "px for marks"),
        control_xy_m: markers,
        control_z_m: markers,
        gnss_xy_m: cameras,
        gnss_z_m: cameras,
    };
    if !guessed.is_empty() {
        let text = format!("the settings have no standard deviations of everything: {} are taken", guessed.join(", "));
        notes.push(Note::guess(text));
    }
    sigma
}

type Cameras<'a> = (Vec<Camera>, HashMap<&'a str, usize>);

fn cameras<'a>(
    file: &str,
    chunk: &'a Chunk,
    options: &ImportOptions,
    notes: &mut Vec<Note>,
) -> Result<Cameras<'a>, Error> {
    let repeated = repeated(chunk.sensors.iter().map(|sensor| sensor.label.as_str()));
    let (mut cameras, mut numbers) = (Vec::new(), HashMap::new());
    for sensor in &chunk.sensors {
        let id = unique(&sensor.label, &sensor.id, &repeated);
        let fit = sensor.calibration.to_fraser([sensor.width_px, sensor.height_px]).ok_or_else(|| {
            Error::content(file, Place::File, format!("camera {}: no Fraser camera comes near it", quoted(&id)))
        })?;
        if sensor.has_rolling_shutter {
            let text = format!("camera {id}: Metashape modelled its rolling shutter, which poses here leave out");
            notes.push(Note::loss(text));
        }
        numbers.insert(sensor.id.as_str(), cameras.len());
        cameras.push(Camera {
            interior: fit.judge(file, &id, options.approximate, notes)?,
            id,
            width_px: sensor.width_px,
            height_px: sensor.height_px,
            pixel_um: sensor.pixel_um,
        });
    }
    Ok((cameras, numbers))
}

fn gnss(photo: &Photo, world: &World) -> Result<Option<Gnss>, String> {
    let Some(reference) = photo.reference.filter(|reference| reference.enabled) else { return Ok(None) };
    let Reference { position, sigma_xy, sigma_z, .. } = reference;
    if world.is_nowhere(&position) {
        return Ok(None);
    }
    let position = world
        .reference(&position)
        .map_err(|problem| format!("reference of image {}: {problem}", quoted(&photo.label)))?;
    Ok(Some(Gnss { position, sigma_xy, sigma_z }))
}

/// Tie points that Metashape kept: it has coordinates of them.
fn tracks(
    file: &str,
    projections: &[(String, Vec<[f64; 3]>)],
    points: &[[f64; 4]],
    image_of_photo: &HashMap<&str, ImageId>,
    notes: &mut Vec<Note>,
    position: impl Fn(Vector3<f64>) -> Option<Vector3<f64>>,
) -> Result<Tracks, Error> {
    let mut tracks = Tracks::default();
    let mut numbers: HashMap<u64, PointId> = HashMap::with_capacity(points.len());
    for [x, y, z, id] in points {
        let point = tracks.point(id.to_string(), position(Vector3::new(*x, *y, *z)));
        if numbers.insert(id.to_bits(), point).is_some() {
            let problem = format!("point {id} has coordinates twice; expected one row per point");
            return Err(Error::content(file, Place::File, problem));
        }
    }
    let mut dropped = HashSet::new();
    for (photo, seen) in projections {
        let Some(image) = image_of_photo.get(photo.as_str()) else { continue };
        for [x, y, id] in seen {
            match numbers.get(&id.to_bits()) {
                Some(point) => tracks.measure(*image, *point, [*x, *y]),
                None => {
                    dropped.insert(id.to_bits());
                }
            }
        }
    }
    if !dropped.is_empty() {
        let text = format!("{} tie points have no coordinates, Metashape set them aside: left out", dropped.len());
        notes.push(Note::loss(text));
    }
    if !points.is_empty() {
        notes.push(Note::fact("tie points are those that Metashape kept: large residuals are gone already"));
    }
    Ok(tracks)
}

type Survey = (Vec<SurveyedPoint>, Vec<Measurement>);

/// Markers with coordinates are control where these are enabled, check points else; markers without are tie points.
fn survey(
    markers: &[Marker],
    seen: &[(&str, ImageId, [f64; 2])],
    world: &World,
    tracks: &mut Tracks,
    notes: &mut Vec<Note>,
) -> Result<Survey, String> {
    let repeated = repeated(markers.iter().map(|marker| marker.label.as_str()));
    let (mut surveyed, mut marks) = (Vec::new(), Vec::new());
    let mut unseen = 0;
    for marker in markers {
        let name = unique(&marker.label, &marker.id, &repeated);
        let own = seen.iter().filter(|(id, ..)| *id == marker.id);
        if own.clone().next().is_none() {
            unseen += 1;
            continue;
        }
        let Some(reference) = marker.reference else {
            // A tie point may have the number that is this marker's label.
            let point = tracks.point(format!("marker {name}"), None);
            own.for_each(|(_, image, xy)| tracks.measure(*image, point, *xy));
            continue;
        };
        let Reference { position, sigma_xy, sigma_z, enabled } = reference;
        let position = world.reference(&position).map_err(|problem| format!("marker {}: {problem}", quoted(&name)))?;
        let point = PointId::from(surveyed.len());
        marks.extend(own.map(|(_, image, [x, y])| Measurement { image: *image, point, x: *x, y: *y, sigma: None }));
        let role = if enabled { Role::Control } else { Role::Check };
        surveyed.push(SurveyedPoint { name, position, role, sigma_xy, sigma_z });
    }
    if unseen > 0 {
        notes.push(Note::loss(format!("{unseen} markers are measured in no image: left out")));
    }
    Ok((surveyed, marks))
}

fn repeated<'a>(labels: impl Iterator<Item = &'a str>) -> HashSet<&'a str> {
    let mut once = HashSet::new();
    labels.filter(|label| label.is_empty() || !once.insert(*label)).collect()
}

/// A label is no name where two things have it.
fn unique(label: &str, id: &str, repeated: &HashSet<&str>) -> String {
    if repeated.contains(label) { format!("{label} ({id})").trim().to_owned() } else { label.to_owned() }
}

fn quoted(name: &str) -> String {
    shown(name.as_bytes())
}
