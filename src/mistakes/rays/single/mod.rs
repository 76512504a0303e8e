//! Single images that do not fit a network of the others: mirrored, turned, reduced, cropped, or exchanged.
//!
//! Points are placed by the rays of images that fit. An image that does not is resected alone from these points, as
//! recorded and under each alternative. It is named where most of its measurements fit under an alternative and few as
//! recorded, wherever it may stand. A pose absorbs most of a turn and of a crop: there the shift of the image tells.

mod cause;
mod exchanged;
#[cfg(test)]
mod made_wrong;
mod network;
mod resect;
mod several;
mod shifted;
mod start;
mod turned;
mod words;

use super::scene::Scene;
use crate::block::Pose;
use crate::camera::Camera;
use crate::math::statistics::median;
use crate::mistakes::Mistake;
use crate::mistakes::words::exchanged_images;
use cause::{CAUSES, Cause};
use network::{FEWEST_ROWS, FITS, Known, known, rows};
use resect::{Resected, Row, resect};
use start::{neighbours, starts};

/// Share of its measurements that fit an image that is in its place; false matches are fewer than that.
const MOSTLY: f64 = 0.6;
/// Share of these that may fit by chance under anything else: half as many.
const HALF: f64 = 0.5;
/// Share of bad images beyond which the network is no judge of them.
const MOST_BAD: f64 = 0.25;
/// Bad images that are examined; more are another mistake than one of single images.
const MOST_EXAMINED: usize = 20;
/// An image stands where its approximate pose says, within so many rad: a quarter turn is four times more.
const NEAR: f64 = 0.4;
/// And within this share of the distance to its points.
const NEAR_SHARE: f64 = 0.3;
/// A crop below this share of the longer side is the principal point, which an adjustment estimates.
const LEAST_CROP: f64 = 0.01;

/// Mistakes of single images at a level `alpha`. `scene`: images in their places in a network that wrong measurements
/// did not bend, with its cameras; `approximate`: their approximate poses.
pub fn images(scene: &Scene, approximate: &[Pose], alpha: f64) -> Vec<Mistake> {
    if approximate.len() != scene.views.len() {
        return Vec::new();
    }
    let Some(known) = known(scene, &[]) else { return Vec::new() };
    let bad: Vec<usize> = (0..scene.views.len()).filter(|view| known.bad[*view]).collect();
    if bad.len() as f64 > MOST_BAD * scene.views.len() as f64 {
        return Vec::new();
    }
    let pairs = exchanged::pairs(scene, approximate, &known);
    let name = |view: usize| scene.views[view].name.as_str();
    let mut found: Vec<Mistake> =
        pairs.iter().map(|pair| exchanged_images(pair.map(name), f64::NAN, f64::NEG_INFINITY)).collect();
    let rest = bad.into_iter().filter(|view| pairs.iter().flatten().all(|other| other != view));
    found.extend(rest.take(MOST_EXAMINED).filter_map(|view| altered(scene, approximate, &known, view)));
    let shifted = shifted::shifted(scene, &known);
    let mut absorbed = several::cameras(scene, &shifted, alpha);
    if absorbed.is_empty() {
        absorbed.extend(turned::turned(scene, approximate, &known, alpha));
        absorbed.extend(shifted::cropped(scene, &shifted, alpha));
    }
    for mistake in absorbed {
        // The place of an exchanged image says nothing of how it is turned.
        if found.iter().all(|own| mistake.names.iter().all(|name| !own.names.contains(name))) {
            found.push(mistake);
        }
    }
    found
}

/// How far the measurements of some images are shifted, in a network that these images had no part in.
pub fn shifts_beside(scene: &Scene, images: &[usize]) -> Vec<Mistake> {
    let Some(known) = known(scene, images) else { return Vec::new() };
    images.iter().filter_map(|view| shifted::shift_of(scene, &known, *view)).collect()
}

/// Share of measurements that fit.
fn share(camera: &Camera, rows: &[Row], resected: &Resected, limit: f64) -> f64 {
    fitting(camera, rows, resected, limit) as f64 / rows.len().max(1) as f64
}

fn fitting(camera: &Camera, rows: &[Row], resected: &Resected, limit: f64) -> usize {
    rows.iter().filter(|row| resected.error(camera, row) < limit).count()
}

/// An alternative with the share of measurements that fit.
#[derive(Clone, Copy)]
struct Tried {
    cause: Cause,
    share: f64,
    fitting: usize,
    shift: [f64; 2],
}

/// What was done to an image, where one alternative alone explains it.
fn altered(scene: &Scene, approximate: &[Pose], known: &Known, view: usize) -> Option<Mistake> {
    let rows = rows(scene, known, view, &[]);
    if rows.len() < FEWEST_ROWS {
        return None;
    }
    let camera = &scene.cameras[scene.views[view].camera];
    let starts = starts(scene, approximate, known, view);
    let limit = FITS * known.usual;
    // As recorded it may stand anywhere.
    let beside = neighbours(scene, known, view).into_iter().map(|other| scene.views[other].pose);
    let anywhere = starts.iter().copied().chain(beside).chain([scene.views[view].pose]);
    let as_recorded = anywhere
        .filter_map(|start| resect(camera, &rows, &start, false, known.usual))
        .map(|found| share(camera, &rows, &found, limit))
        .fold(0.0, f64::max);
    let mut tried: Vec<Tried> = CAUSES
        .into_iter()
        .filter_map(|cause| {
            let undone: Vec<Row> = rows.iter().map(|row| Row { xy: cause.undo(camera, row.xy), ..*row }).collect();
            let all = starts.iter().filter_map(|start| of_start(camera, &undone, start, cause, known.usual));
            all.max_by_key(|tried| tried.fitting)
        })
        .collect();
    tried.sort_by(|a, b| b.share.total_cmp(&a.share));
    let (best, others) = tried.split_first()?;
    let next = others.first().map_or(0.0, |other| other.share).max(as_recorded);
    if best.share < MOSTLY || next > HALF * best.share {
        return None;
    }
    let Tried { cause, shift, .. } = *best;
    let fit = [best.fitting, rows.len()];
    Some(words::altered(&words::Fitting { image: &scene.views[view].name, camera, cause, shift, fit }))
}

/// An alternative from one start; `None` where it leads away from there, or is too small to be one.
fn of_start(camera: &Camera, rows: &[Row], start: &Pose, cause: Cause, usual: f64) -> Option<Tried> {
    let found = resect(camera, rows, start, cause == Cause::Cropped, usual)?;
    let distance = median(&rows.iter().map(|row| (row.place - start.centre).norm()).collect::<Vec<_>>());
    let is_near = found.pose.rotation.angle_to(&start.rotation) < NEAR
        && (found.pose.centre - start.centre).norm() < NEAR_SHARE * distance;
    let [dx, dy] = found.offset;
    let side = f64::from(camera.width_px.max(camera.height_px));
    let is_crop = cause != Cause::Cropped || dx.hypot(dy) > LEAST_CROP * side;
    let fitting = fitting(camera, rows, &found, FITS * usual);
    let share = fitting as f64 / rows.len().max(1) as f64;
    (is_near && is_crop).then_some(Tried { cause, share, fitting, shift: found.offset })
}
