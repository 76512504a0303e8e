//! Images along paths.

use super::Exposure;
use super::walk::*;

/// Metres of a degree of latitude at 48 degrees, from published tables.
const NORTH_M: f64 = 111_200.0;

fn fly(north_m: f64, east_deg: f64, nose: Nose) -> Step {
    Step::Fly(Waypoint { place: [48.0 + north_m / NORTH_M, 7.0 + east_deg], height_m: 50.0, nose })
}

fn north(exposures: &[Exposure]) -> Vec<f64> {
    exposures.iter().map(|own| ((own.latitude_deg - 48.0) * NORTH_M).round()).collect()
}

#[test]
fn images_follow_by_distance_until_they_are_stopped() {
    let steps = [
        Step::Pitch(-60.0),
        fly(0.0, 0.0, Nose::Path),
        Step::Every { metres: 20.0, now: true },
        fly(50.0, 0.0, Nose::Path),
        fly(100.0, 0.0, Nose::Path),
        Step::Stop,
        fly(100.0, 1e-3, Nose::Path),
        fly(0.0, 1e-3, Nose::Path),
        Step::Shoot,
    ];
    let images = walk(&steps).unwrap();
    assert_eq!(north(&images), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 0.0]);
    assert!(images.iter().all(|own| own.follows_path && own.tilt_deg == Some(30.0)), "{images:?}");
    let headings: Vec<f64> = images.iter().map(|own| own.heading_deg.unwrap().round()).collect();
    assert_eq!(headings, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 180.0]);
}

#[test]
fn without_an_image_at_once_the_first_comes_after_the_distance() {
    let begin = |now| [Step::Every { metres: 30.0, now }, fly(0.0, 0.0, Nose::Path), fly(70.0, 0.0, Nose::Path)];
    assert_eq!(north(&walk(&begin(false)).unwrap()), [30.0, 60.0]);
    assert_eq!(north(&walk(&begin(true)).unwrap()), [0.0, 30.0, 60.0]);
}

#[test]
fn nose_and_camera_turn_as_they_are_told() {
    let every = Step::Every { metres: 25.0, now: true };
    let headings = |steps: &[Step]| -> Vec<f64> {
        walk(steps).unwrap().iter().map(|own| own.heading_deg.unwrap().round()).collect()
    };
    let turning = [fly(0.0, 0.0, Nose::Turning(350.0)), every, fly(50.0, 0.0, Nose::Turning(10.0))];
    assert_eq!(headings(&turning), [350.0, 0.0, 10.0]);
    let held = [Step::Yaw(Yaw::OfNose(-30.0)), fly(0.0, 0.0, Nose::Path), every, fly(50.0, 0.0, Nose::Held(90.0))];
    assert_eq!(headings(&held), [330.0, 60.0, 60.0]);
    let north = [Step::Yaw(Yaw::OfNorth(45.0)), fly(0.0, 0.0, Nose::Held(90.0)), Step::Shoot];
    assert_eq!(headings(&north), [45.0]);
    let aim = Nose::Towards([48.0 + 25.0 / NORTH_M, 7.0 + 1e-3]);
    let aimed = headings(&[fly(0.0, 0.0, aim), every, fly(50.0, 0.0, aim)]);
    // 74.6 m to the east, 25 m to the north.
    assert_eq!(aimed, [71.0, 90.0, 109.0]);
    let tilts = [Step::Pitch(-90.0), fly(0.0, 0.0, Nose::Path), every, Step::PitchAlong(-50.0)];
    let images = walk(&[&tilts[..], &[fly(50.0, 0.0, Nose::Path)]].concat()).unwrap();
    let tilts: Vec<f64> = images.iter().map(|own| own.tilt_deg.unwrap().round()).collect();
    assert_eq!(tilts, [0.0, 20.0, 40.0]);
}

#[test]
fn what_is_no_path_is_refused() {
    let error = |steps: &[Step]| walk(steps).unwrap_err();
    let at =
        |latitude, longitude| Step::Fly(Waypoint { place: [latitude, longitude], height_m: 9.0, nose: Nose::Path });
    assert!(error(&[at(95.0, 7.0)]).starts_with("expected a latitude"));
    assert!(error(&[at(0.0, 0.0)]).contains("found 0 and 0"));
    assert!(error(&[Step::Shoot, at(48.0, 7.0)]).contains("a waypoint before the first image"));
    let many = [at(48.0, 7.0), Step::Every { metres: 1e-4, now: false }, at(48.1, 7.0)];
    assert!(error(&many).contains("at most 1000000 images"));
    assert!(error(&[at(48.0, 7.0), Step::Every { metres: -1.0, now: false }]).contains("more than 0 m"));
    assert_eq!(walk(&[]), Ok(Vec::new()));
}
