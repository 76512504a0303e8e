//! Turned images: a pose that is turned about the camera's axis absorbs a turn, but for the principal point.

use super::super::scene::Scene;
use super::cause::Cause;
use super::network::{FITS, Known};
use super::resect::{Row, resect};
use super::shifted::{cost, seen};
use super::start::starts;
use super::words::{self, Fitting};
use super::{MOSTLY, NEAR, fitting};
use crate::block::Pose;
use crate::mistakes::{Mistake, ln_p, price};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

/// Quarters by which an image may be turned, the most common first: programs turn pictures upright.
const QUARTERS: [u8; 3] = [2, 1, 3];

/// Turned images that fit the network turned against their approximate rotation. Whether the image or that rotation is
/// wrong, the principal point tells.
pub fn turned(scene: &Scene, approximate: &[Pose], known: &Known, alpha: f64) -> Vec<Mistake> {
    let of_view = |view: usize| {
        let quarters = quarters(scene, approximate, known, view);
        quarters.into_iter().find_map(|quarters| turned_by(scene, approximate, known, view, quarters, alpha))
    };
    (0..scene.views.len()).filter_map(of_view).collect()
}

fn turned_by(
    scene: &Scene,
    approximate: &[Pose],
    known: &Known,
    view: usize,
    quarters: u8,
    alpha: f64,
) -> Option<Mistake> {
    let (camera, rows) = seen(scene, known, view)?;
    let cause = Cause::Turned(quarters);
    let undone: Vec<Row> = rows.iter().map(|row| Row { xy: cause.undo(camera, row.xy), ..*row }).collect();
    let starts = starts(scene, approximate, known, view);
    let best = |rows: &[Row], turn: u8| {
        let from = |start: &Pose| Pose { rotation: about_axis(turn) * start.rotation, ..*start };
        let resected = starts.iter().filter_map(|start| resect(camera, rows, &from(start), false, known.usual));
        let cost = resected
            .map(|found| (cost(camera, rows, &found, known), fitting(camera, rows, &found, FITS * known.usual)));
        cost.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let (as_recorded, (cost, fits)) = (best(&rows, quarters)?.0, best(&undone, 0)?);
    let fit = [fits, rows.len()];
    let (drop, tried) = (as_recorded - cost, QUARTERS.len() * scene.views.len());
    let is_one = drop > price(alpha, tried) && fits as f64 >= MOSTLY * rows.len() as f64;
    let found = Fitting { image: &scene.views[view].name, camera, cause, shift: [0.0; 2], fit };
    is_one.then(|| words::altered(&found).tested(drop, ln_p(drop, tried)))
}

/// Quarters by which the image may be turned clockwise against what its neighbours make of its approximate rotation:
/// that which the network shows, where the image fits it.
fn quarters(scene: &Scene, approximate: &[Pose], known: &Known, view: usize) -> Vec<u8> {
    if known.bad[view] {
        return QUARTERS.to_vec();
    }
    let is_turned_by = |quarters: &u8| {
        let starts = starts(scene, approximate, known, view);
        let is_near = |start: &Pose| {
            let turn = scene.views[view].pose.rotation * start.rotation.inverse();
            turn.angle_to(&about_axis(*quarters)) < NEAR
        };
        !starts.is_empty() && starts.iter().all(is_near)
    };
    QUARTERS.into_iter().filter(is_turned_by).collect()
}

/// A turn of the camera about its axis by quarters: what it sees turns clockwise.
fn about_axis(quarters: u8) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::z() * (f64::from(quarters) * FRAC_PI_2))
}

#[cfg(test)]
mod tests {
    use super::super::made_wrong::{VIEW, approximate, with};
    use super::*;
    use std::f64::consts::PI;

    const ALPHA: f64 = 0.001;

    #[test]
    fn a_turned_image_is_told_from_a_turned_approximation() {
        let (scene, known) = with(|[x, y]| [4000.0 - x, 3000.0 - y], PI);
        let found = turned(&scene, &approximate(), &known, ALPHA);
        let said: Vec<_> = found.iter().map(|found| (found.kind.as_str(), &found.names[..], found.value)).collect();
        assert_eq!(said, [("turned", &["i7".to_string()][..], Some(180.0))]);

        let (scene, known) = with(|xy| xy, 0.0);
        let mut poses = approximate();
        poses[VIEW].rotation = UnitQuaternion::from_scaled_axis(Vector3::z() * PI) * poses[VIEW].rotation;
        assert_eq!(turned(&scene, &poses, &known, ALPHA), []);
    }
}
