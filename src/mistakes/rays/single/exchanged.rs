//! Measurements of two images that are exchanged: each fits at the place of the other.

use super::super::scene::Scene;
use super::network::{FEWEST_ROWS, FITS, Known, rows};
use super::resect::{Row, resect};
use super::start::starts;
use super::{MOSTLY, share};
use crate::block::Pose;
use crate::math::statistics::median;
use nalgebra::Vector3;

/// Nearer to the place of the other image than this share of the distance between the two: halfway would not tell.
const NEARER: f64 = 0.3;
/// So many times as far from where its neighbours expect it as the others are, an image is suspect; whether it stands
/// at the place of another one, the comparison says.
const FAR: f64 = 3.0;
/// Images that are compared in pairs: one exchange concerns two.
const MOST_SUSPECTS: usize = 12;

/// Pairs of images whose measurements are exchanged.
pub fn pairs(scene: &Scene, approximate: &[Pose], known: &Known) -> Vec<[usize; 2]> {
    let expected: Vec<Vec<Pose>> = (0..scene.views.len()).map(|view| starts(scene, approximate, known, view)).collect();
    let suspects = suspects(scene, known, &expected);
    if suspects.len() > MOST_SUSPECTS {
        return Vec::new();
    }
    let rows: Vec<Vec<Row>> = suspects.iter().map(|view| rows(scene, known, *view, &suspects)).collect();
    let lies_at = |one: usize, other: usize| {
        let (view, place) = (suspects[one], suspects[other]);
        let [Some(own), Some(others)] = [view, place].map(|view| expected[view].first()) else { return false };
        is_at(scene, known, view, &rows[one], others, &own.centre)
    };
    let mut found: Vec<[usize; 2]> = Vec::new();
    for one in 0..suspects.len() {
        for other in 0..one {
            let pair = [suspects[other], suspects[one]];
            let is_new = found.iter().flatten().all(|view| !pair.contains(view));
            if is_new && lies_at(one, other) && lies_at(other, one) {
                found.push(pair);
            }
        }
    }
    found
}

/// Do the measurements of an image fit from the place of another one, far from its own?
fn is_at(scene: &Scene, known: &Known, view: usize, rows: &[Row], other: &Pose, own: &Vector3<f64>) -> bool {
    if rows.len() < FEWEST_ROWS {
        return false;
    }
    let camera = &scene.cameras[scene.views[view].camera];
    let apart = (other.centre - own).norm();
    resect(camera, rows, other, false, known.usual).is_some_and(|found| {
        share(camera, rows, &found, FITS * known.usual) >= MOSTLY
            && (found.pose.centre - other.centre).norm() < NEARER * apart
    })
}

/// Images that do not fit, and images that the network moved far from where their neighbours expect them: two images
/// with much in common change places without a residual.
fn suspects(scene: &Scene, known: &Known, expected: &[Vec<Pose>]) -> Vec<usize> {
    let moved: Vec<f64> = scene
        .views
        .iter()
        .zip(expected)
        .map(|(view, expected)| {
            let by = expected.iter().map(|pose| (pose.centre - view.pose.centre).norm()).collect::<Vec<_>>();
            // The neighbours may have moved, too.
            if by.is_empty() { 0.0 } else { median(&by) }
        })
        .collect();
    let usual = median(&moved);
    let spacing = spacing(expected);
    let is_moved = |view: usize| moved[view] > FAR * usual && moved[view] > NEARER * spacing;
    (0..scene.views.len()).filter(|view| known.bad[*view] || is_moved(*view)).collect()
}

/// The usual distance between an image and the next one.
fn spacing(expected: &[Vec<Pose>]) -> f64 {
    let centres: Vec<Vector3<f64>> = expected.iter().filter_map(|poses| Some(poses.first()?.centre)).collect();
    let next = |k: usize| {
        let others = (0..centres.len()).filter(|other| *other != k);
        others.map(|other| (centres[k] - centres[other]).norm()).fold(f64::INFINITY, f64::min)
    };
    median(&(0..centres.len()).map(next).collect::<Vec<_>>())
}
