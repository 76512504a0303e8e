//! The small block for tests with one image that is recorded wrongly.

use super::super::made;
use super::super::scene::Scene;
use super::network::{Known, known, rows};
use super::resect::resect;
use crate::block::Pose;
use nalgebra::{UnitQuaternion, Vector3};

/// The image.
pub const VIEW: usize = 7;

/// The scene with other coordinates in one image, which stands where these put it.
pub fn with(change: impl Fn([f64; 2]) -> [f64; 2], turn: f64) -> (Scene, Known) {
    let mut scene = made::scene();
    let first = known(&scene, &[]).expect("points");
    scene.points.iter_mut().flatten().filter(|sight| sight.view == VIEW).for_each(|sight| sight.xy = change(sight.xy));
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::z() * turn) * scene.views[VIEW].pose.rotation;
    let start = Pose { rotation, ..scene.views[VIEW].pose };
    let found =
        resect(&scene.cameras[0], &rows(&scene, &first, VIEW, &[]), &start, false, first.usual).expect("a pose");
    scene.views[VIEW].pose = found.pose;
    let known = known(&scene, &[]).expect("points");
    (scene, known)
}

/// Poses as they are approximately known.
pub fn approximate() -> Vec<Pose> {
    made::views().into_iter().map(|view| view.pose).collect()
}
