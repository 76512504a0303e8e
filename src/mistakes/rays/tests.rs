//! Whole blocks that are made here, right and with every mistake.

use super::coordinates::{Coordinates, Unit};
use super::lens::{Length, Lens};
use super::orientation::Orientation;
use super::*;
use crate::block::edit::{Change, Edit};
use crate::camera::undistort::undistort;
use crate::camera::{F, K1, K2, P1};
use nalgebra::Vector3;

fn none() -> Scene {
    Scene { points: Vec::new(), ..made::scene() }
}

fn named(scene: &Scene) -> Vec<(String, String)> {
    conventions(scene, &none()).into_iter().map(|mistake| (mistake.subject, mistake.kind)).collect()
}

fn expect(scene: &Scene, subject: &str, kind: &str) {
    let found = named(scene);
    assert_eq!(found, [(subject.to_string(), kind.to_string())]);
}

/// Changes that undo themselves when they are made once more.
fn after(scene: &Scene, cause: Cause) -> Scene {
    let mut changed = scene.clone();
    cause.undo(&mut changed).expect("a change");
    changed
}

#[test]
fn a_right_block_names_nothing_whatever_its_approximations() {
    for (degrees, metres) in [(0.0, 0.0), (0.3, 0.3), (2.0, 2.0), (6.0, 10.0), (40.0, 30.0)] {
        let found = named(&made::approximate(degrees, metres));
        assert!(found.is_empty(), "{degrees} degrees, {metres} m: {found:?}");
    }
    assert!(named(&none()).is_empty());
}

#[test]
fn not_a_number_names_nothing() {
    let mut scene = made::scene();
    scene.cameras[0].interior[F] = f64::NAN;
    assert!(named(&scene).is_empty());
    let mut scene = made::scene();
    scene.points.iter_mut().flatten().for_each(|sight| sight.xy[0] = f64::NAN);
    assert!(named(&scene).is_empty());
    let mut scene = made::scene();
    scene.views.iter_mut().for_each(|view| view.pose.centre = Vector3::zeros());
    assert!(named(&scene).is_empty());
}

#[test]
fn coordinates_of_another_convention_are_named() {
    for scene in [made::scene(), made::approximate(0.3, 0.3)] {
        for cause in [Coordinates::YUp, Coordinates::Mirrored, Coordinates::Exchanged] {
            expect(&after(&scene, Cause::Coordinates(cause)), "ties", cause.kind());
        }
        let mut half = scene.clone();
        half.points.iter_mut().flatten().for_each(|sight| sight.xy = sight.xy.map(|value| 0.5 * value));
        expect(&half, "ties", "image-scale");
        assert_eq!(conventions(&half, &none())[0].value, Some(0.5));
        let mut centred = scene.clone();
        centred.points.iter_mut().flatten().for_each(|sight| sight.xy = [sight.xy[0] - 2000.0, 1500.0 - sight.xy[1]]);
        expect(&centred, "ties", "centred");
    }
}

#[test]
fn coordinates_in_another_unit_are_named() {
    let scene = made::scene();
    let in_unit = |convert: &dyn Fn([f64; 2]) -> [f64; 2]| {
        let mut scene = scene.clone();
        scene.points.iter_mut().flatten().for_each(|sight| sight.xy = convert(sight.xy));
        scene
    };
    expect(&in_unit(&|[x, y]| [(x - 2000.0) * 0.004, (1500.0 - y) * 0.004]), "ties", "millimetres");
    expect(&in_unit(&|[x, y]| [x * 0.004, y * 0.004]), "ties", "millimetres");
    expect(&in_unit(&|[x, y]| [x / 4000.0, y / 3000.0]), "ties", "normalised");
    expect(&in_unit(&|[x, y]| [(x - 2010.0) / 3000.0, (y - 1490.0) / 3000.0]), "ties", "normalised");
    let by = Coordinates::Normalised { by: Unit::Sides, up: true };
    expect(&in_unit(&|[x, y]| [x / 4000.0, (3000.0 - y) / 3000.0]), "ties", by.kind());
}

#[test]
fn orientations_of_another_convention_are_named() {
    let scene = made::approximate(0.2, 0.2);
    for cause in [
        Orientation::Inverse,
        Orientation::Axes { backwards: true, quarters: 0 },
        Orientation::Axes { backwards: false, quarters: 2 },
    ] {
        expect(&after(&scene, Cause::Orientation(cause)), "images", cause.kind());
    }
    // Each of the two orders undoes the other.
    expect(&after(&scene, Cause::Orientation(Orientation::RealFirst)), "images", "quaternion-order");
    let mut translations = scene.clone();
    for view in &mut translations.views {
        view.pose.centre = -(view.pose.rotation * (view.pose.centre + scene.origin)) - scene.origin;
    }
    expect(&translations, "images", "position-frame");
}

#[test]
fn a_whole_habit_is_two_mistakes() {
    let mut scene = made::scene();
    let backwards = Orientation::Axes { backwards: true, quarters: 0 };
    // Camera to world with y upwards: R_recorded = (D R)'.
    backwards.undo(&mut scene).expect("a change");
    Orientation::Inverse.undo(&mut scene).expect("a change");
    let kinds: Vec<String> = named(&scene).into_iter().map(|(_, kind)| kind).collect();
    assert_eq!(kinds, ["inverse-rotation", "camera-axes"]);
}

#[test]
fn numbers_of_the_camera_in_another_unit_are_named() {
    let scene = made::scene();
    let with = |change: &dyn Fn(&mut [f64; 12])| {
        let mut scene = scene.clone();
        change(&mut scene.cameras[0].interior);
        scene
    };
    expect(&with(&|interior| interior[F] *= 0.004), "camera", "focal-unit");
    expect(&with(&|interior| interior[F] *= 0.5), "camera", "focal-wrong");
    let centred = with(&|interior| (1..5).for_each(|k| interior[k] -= if k % 2 == 1 { 2000.0 } else { 1500.0 }));
    expect(&centred, "camera", "principal-point-unit");
    expect(&with(&|interior| (K1..=P1 + 1).for_each(|k| interior[k] = -interior[k])), "camera", "distortion-sign");
    let normalised = with(&|interior| {
        interior[K1] *= 3000f64.powi(2);
        interior[K2] *= 3000f64.powi(4);
        (P1..=P1 + 1).for_each(|k| interior[k] *= 3000.0);
    });
    let found = conventions(&normalised, &none());
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].kind.as_str(), Lens::Unit(Length::Focal).kind()[1]), ("distortion-unit", "distortion-unit"));
}

#[test]
fn marks_follow_the_tie_points_where_they_share_the_mistake() {
    let right = made::scene();
    let up = after(&right, Cause::Coordinates(Coordinates::YUp));
    let edit = |file: &str| Edit::all(file, Change::Affine { column: "y".into(), factor: -1.0, offset: 3000.0 });
    assert_eq!(conventions(&up, &up)[0].mend, [edit("ties.csv"), edit("marks.csv")]);
    assert_eq!(conventions(&up, &right)[0].mend, [edit("ties.csv")]);
    let marks = conventions(&right, &up);
    assert_eq!(marks.len(), 1, "{marks:?}");
    assert_eq!((marks[0].subject.as_str(), marks[0].kind.as_str()), ("marks", "y-up"));
}

#[test]
fn undistorted_tie_points_get_their_distortion_and_marks_keep_theirs() {
    let right = made::scene();
    let mut ideal = right.clone();
    for sight in ideal.points.iter_mut().flatten() {
        sight.xy = undistort(&right.cameras[0].interior, sight.xy).expect("an ideal point");
    }
    expect(&ideal, "ties", "undistorted");
    let edit = |file: &str| Edit::all(file, Change::Distort { interior: right.cameras[0].interior });
    assert_eq!(conventions(&ideal, &right)[0].mend, [edit("ties.csv")]);
    assert_eq!(conventions(&ideal, &ideal)[0].mend, [edit("ties.csv"), edit("marks.csv")]);
    let few = Scene { points: right.points[..4].to_vec(), ..right.clone() };
    assert_eq!(conventions(&ideal, &few)[0].mend, [edit("ties.csv")], "too few marks to tell");
    let mut undone = ideal.clone();
    Coordinates::Undistorted.undo(&mut undone).expect("measurements");
    for (undone, right) in undone.sights().zip(right.sights()) {
        assert!((0..2).all(|axis| (undone.xy[axis] - right.xy[axis]).abs() < 1e-6), "{undone:?} {right:?}");
    }
}

#[test]
fn one_camera_of_two_is_named_alone() {
    let mut scene = made::scene();
    let second = crate::camera::Camera { id: "second".into(), ..scene.cameras[0].clone() };
    scene.cameras.push(second);
    // The second strip has the second camera, whose images are upside down.
    scene.views.iter_mut().skip(6).take(6).for_each(|view| view.camera = 1);
    for sight in scene.points.iter_mut().flatten().filter(|sight| (6..12).contains(&sight.view)) {
        sight.xy = [4000.0 - sight.xy[0], 3000.0 - sight.xy[1]];
    }
    for mistake in conventions(&scene, &none()) {
        assert_eq!(mistake.names, (6..12).map(|k| format!("i{k}")).collect::<Vec<_>>(), "{mistake:?}");
    }
}
