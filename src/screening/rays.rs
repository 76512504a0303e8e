//! Conventions of image measurements, cameras and orientations, examined at the start values of a block; and single
//! images beside a free network.

use super::network::free_network;
use crate::adjust::Options;
use crate::block::{Block, ByPoint, Measurement, PointId};
use crate::camera::Camera;
use crate::mistakes::rays::{self, Scene, Sight, View, single};
use crate::mistakes::{BEYOND, Mistake};
use crate::model::Model;
use crate::run::fit::Fit;
use nalgebra::Vector3;

/// Rays of each image that are examined: their median is known to a tenth.
const RAYS_PER_IMAGE: usize = 40;
/// Rays in all that are examined of a whole block: a few hundred points.
const RAYS: usize = 2000;
/// Tie points of an imported block that are projected.
const OWN_POINTS: usize = 2000;
/// Rays of each image that decide whether it fits: it loses most of them where its neighbours do not fit.
const RAYS_PER_SINGLE: usize = 80;
/// And in all: a few hundred images.
const RAYS_OF_SINGLES: usize = 40_000;

/// Conventions that are wrong in a whole block, at its start values.
pub fn of_rays(block: &Block) -> Vec<Mistake> {
    let ties = sample(block, &block.ties, block.tie_points.len(), RAYS_PER_IMAGE, RAYS);
    let marks = sample(block, &block.marks, block.surveyed.len(), RAYS_PER_IMAGE, RAYS);
    rays::conventions(&ties, &marks)
}

/// What is wrong where the tie points of an imported block are missed at its own orientation, by their own coordinates.
/// `reported_px`: what the other program says that they are missed by.
pub fn of_own_points(block: &Block, reported_px: Option<f64>) -> Vec<Mistake> {
    let by_point = ByPoint::new(&block.ties, block.tie_points.len());
    let known: Vec<usize> = (0..block.tie_points.len()).filter(|k| block.tie_points[*k].position.is_some()).collect();
    let step = known.len().div_ceil(OWN_POINTS).max(1);
    let (mut points, mut places) = (Vec::new(), Vec::new());
    for point in known.into_iter().step_by(step) {
        points.push(by_point.of(point.into()).map(|row| sight(&block.ties[row])).collect());
        places.extend(block.tie_points[point].position);
    }
    let scene = Scene { cameras: cameras(block), views: views(block), points, origin: origin(block) };
    let marks = sample(block, &block.marks, block.surveyed.len(), RAYS_PER_IMAGE, RAYS);
    rays::own_points(&scene, &places, &marks, reported_px)
}

/// Single images that do not fit a network of the block; the poses of the block are their approximate ones. The shift
/// of a cropped image is estimated in a network without it, since its error bends the poses of its neighbours. There it
/// must be known to a tenth: what a shutter or a lens does to an image looks like a shift that is known worse.
pub fn of_images(block: &Block, network: &Fit, model: &Model, significance: f64, options: &Options) -> Vec<Mistake> {
    let approximate: Vec<_> = block.images.iter().map(|image| image.pose).collect();
    let Some(scene) = in_place(block, network) else { return Vec::new() };
    let mut found = single::images(&scene, &approximate, significance);
    let is_shift = |mistake: &Mistake| (&*mistake.kind, &*mistake.subject) == ("offset", "images");
    let names: Vec<&String> = found.iter().filter(|mistake| is_shift(mistake)).flat_map(|own| &own.names).collect();
    let images: Vec<usize> = (0..block.images.len()).filter(|k| names.contains(&&block.images[*k].name)).collect();
    if images.is_empty() {
        return found;
    }
    let others = block.ties.iter().filter(|row| !images.contains(&row.image.index())).copied().collect();
    let without = free_network(&block.with_measurements(others, block.marks.clone()), model, options);
    let refined = without.and_then(|own| in_place(block, &own.fit)).map(|scene| single::shifts_beside(&scene, &images));
    for refined in refined.into_iter().flatten() {
        let same = found.iter_mut().find(|own| is_shift(own) && own.names == refined.names);
        same.into_iter().for_each(|own| *own = refined.clone());
    }
    let is_known = |own: &Mistake| own.value.zip(own.sigma).is_none_or(|(value, sigma)| value > BEYOND * sigma);
    found.retain(|own| !is_shift(own) || is_known(own));
    found
}

/// A part of the block with the images and cameras of a network.
fn in_place(block: &Block, network: &Fit) -> Option<Scene> {
    let state = &network.solution.state;
    let mut scene = sample(block, &block.ties, block.tie_points.len(), RAYS_PER_SINGLE, RAYS_OF_SINGLES);
    if state.poses.len() != scene.views.len() || state.interiors.len() != scene.cameras.len() {
        return None;
    }
    scene.views.iter_mut().zip(&state.poses).for_each(|(view, pose)| view.pose = *pose);
    scene.cameras.iter_mut().zip(&state.interiors).for_each(|(camera, interior)| camera.interior = *interior);
    Some(scene)
}

/// Images and cameras of the block, and so many points of a table that each image has `per_image` rays, as long as they
/// are no more than `most`. Points of many rays come first: they are seen by several strips, and two images of one
/// strip can meet under nearly every convention.
fn sample(block: &Block, table: &[Measurement], points: usize, per_image: usize, most: usize) -> Scene {
    let by_point = ByPoint::new(table, points);
    let mut order: Vec<PointId> = (0..points).map(PointId::from).filter(|p| by_point.count(*p) > 1).collect();
    order.sort_by_key(|point| std::cmp::Reverse(by_point.count(*point)));
    let mut seen = vec![0; block.images.len()];
    let mut rays = 0;
    let mut chosen = Vec::new();
    for point in order {
        if rays >= most {
            break;
        }
        let sights: Vec<Sight> = by_point.of(point).map(|row| sight(&table[row])).collect();
        if sights.iter().any(|sight| seen[sight.view] < per_image) {
            sights.iter().for_each(|sight| seen[sight.view] += 1);
            rays += sights.len();
            chosen.push(sights);
        }
    }
    Scene { cameras: cameras(block), views: views(block), points: chosen, origin: origin(block) }
}

fn sight(row: &Measurement) -> Sight {
    Sight { view: row.image.index(), xy: [row.x, row.y] }
}

fn cameras(block: &Block) -> Vec<Camera> {
    block.cameras.clone()
}

fn views(block: &Block) -> Vec<View> {
    let view =
        |image: &crate::block::Image| View { name: image.name.clone(), camera: image.camera.index(), pose: image.pose };
    block.images.iter().map(view).collect()
}

fn origin(block: &Block) -> Vector3<f64> {
    block.origin
}
