//! The screening on small surveys that are made here: a free network of its own scale and direction, recorded with
//! millimetres of noise.

use super::*;
use crate::evaluate::Similarity;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

const ALPHA: f64 = 1e-3;

/// Points on rolling ground and images 80 m above it.
fn place(subject: Subject, k: usize) -> Vector3<f64> {
    let k = k as f64;
    let height = if subject == Subject::Gnss { 80.0 } else { 0.0 };
    Vector3::new(37.0 * k % 200.0, 53.0 * k % 170.0, 4.0 * (0.7 * k).sin() + height)
}

fn survey() -> Survey {
    survey_at(place)
}

/// Points and images at their places; noise of some millimetres that repeats.
fn survey_at(place: impl Fn(Subject, usize) -> Vector3<f64>) -> Survey {
    let network = Similarity {
        scale: 0.25,
        rotation: UnitQuaternion::from_scaled_axis(Vector3::new(0.02, -0.01, 0.3)),
        translation: Vector3::new(10.0, -20.0, 3.0),
    };
    let noise = |k: usize| 0.003 * Vector3::new((3.1 * k as f64).sin(), (5.3 * k as f64).sin(), (7.7 * k as f64).cos());
    let group = |subject, from: usize, count: usize, flights: &[&str]| {
        let members = (from..from + count).map(|k| {
            let truth = place(subject, k);
            let flight = if flights.is_empty() { 0 } else { (k - from) * flights.len() / count };
            Member {
                name: format!("p{k}"),
                recorded: truth + noise(k),
                computed: Some(network.apply(&truth)),
                covariance: Matrix3::zeros(),
                flight,
                time: Some(3.0 * k as f64),
            }
        });
        let flights = flights.iter().map(|name| name.to_string()).collect();
        Group { subject, sigma: [0.005, 0.005], members: members.collect(), flights }
    };
    let groups = vec![
        group(Subject::Control, 0, 10, &[]),
        group(Subject::Check, 30, 20, &[]),
        group(Subject::Gnss, 100, 60, &["a", "b", "c"]),
    ];
    let cameras = network.rotation * Vector3::z();
    Survey { groups, up: Vector3::z(), cameras, distance: 0.25 * 85.0, pixel: 0.25 * 0.01, focal: Focal::Stated }
}

fn rewrite(survey: &mut Survey, group: usize, change: impl Fn(usize, Vector3<f64>) -> Vector3<f64>) {
    let members = survey.groups[group].members.iter_mut().enumerate();
    members.for_each(|(k, member)| member.recorded = change(k, member.recorded));
}

fn kinds(survey: &Survey) -> Vec<(String, String)> {
    screen(survey, ALPHA).into_iter().map(|mistake| (mistake.kind, mistake.subject)).collect()
}

fn is(found: &[(String, String)], kind: &str, subject: &str) -> bool {
    found.len() == 1 && found[0].0 == kind && found[0].1 == subject
}

#[test]
fn nothing_is_wrong_with_noise_or_with_centimetres() {
    assert!(kinds(&survey()).is_empty());
    let mut bent = survey();
    // A dome of centimetres, and antennas that are 0.2 m beside the cameras.
    for group in 0..3 {
        rewrite(&mut bent, group, |_, p| {
            p + Vector3::new(0.0, 0.0, 3e-6 * (p.xy() - Vector3::new(100.0, 85.0, 0.0).xy()).norm_squared())
        });
    }
    rewrite(&mut bent, 2, |_, p| p + Vector3::new(0.1, -0.1, 0.2));
    assert!(kinds(&bent).is_empty(), "{:?}", screen(&bent, ALPHA));
}

#[test]
fn clean_surveys_of_an_unusual_shape_are_not_accused() {
    let wave = |k: usize| Vector3::new(0.0, (1.9 * k as f64).sin(), (2.3 * k as f64).cos());
    let road = |subject, k: usize| match subject {
        Subject::Control => Vector3::new(20.0 * k as f64, 0.0, 0.0) + 0.02 * wave(k),
        _ => place(subject, k),
    };
    let one_line = |subject, k: usize| match subject {
        Subject::Gnss => Vector3::new(10.0 * k as f64, 0.0, 80.0) + 0.5 * wave(k),
        _ => place(subject, k),
    };
    let plane = |subject, k: usize| match subject {
        Subject::Gnss => place(subject, k),
        _ => place(subject, k).component_mul(&Vector3::new(1.0, 1.0, 0.0)),
    };
    let mut tiny = survey();
    tiny.groups.remove(1);
    tiny.groups[0].members.truncate(5);
    tiny.groups[1].members.truncate(6);
    let mut without_gnss = survey();
    without_gnss.groups.truncate(2);
    let all = [
        ("control along a road", survey_at(road)),
        ("one flight line", survey_at(one_line)),
        ("points on a plane", survey_at(plane)),
        ("five points and six images", tiny),
        ("no GNSS", without_gnss),
    ];
    for (what, survey) in all {
        let found = screen(&survey, ALPHA);
        assert!(found.is_empty(), "{what}: {found:?}");
    }
}

#[test]
fn lists_that_are_recorded_otherwise() {
    type Rewrite = fn(Vector3<f64>) -> Vector3<f64>;
    let changes: [(usize, Rewrite, &str, &str); 7] = [
        (2, |p| p / 0.3048, "scale", "gnss"),
        (1, |p| p * 1000.0, "scale", "check"),
        (0, |p| Vector3::new(p.x, p.y, -p.z), "axis-reversed", "control"),
        (0, |p| Vector3::new(p.x, p.y, p.z / 0.3048), "height-scale", "control"),
        (2, |p| Vector3::new(p.y, p.x, p.z), "axes-exchanged", "gnss"),
        (2, |p| p + Vector3::new(0.0, 0.0, 47.3), "height-offset", "control"),
        (1, |p| p + Vector3::new(0.0, 0.0, 0.8), "height-offset", "check"),
    ];
    for (group, change, kind, subject) in changes {
        let mut wrong = survey();
        rewrite(&mut wrong, group, |_, p| change(p));
        let found = kinds(&wrong);
        assert!(is(&found, kind, subject), "{kind} of {subject}: {found:?}");
    }
}

#[test]
fn two_points_are_enough_to_show_another_height_system() {
    let mut few = survey();
    few.groups.remove(1);
    few.groups[0].members.truncate(3);
    assert!(kinds(&few).is_empty());
    rewrite(&mut few, 0, |_, p| p - Vector3::new(0.0, 0.0, 47.3));
    let found = screen(&few, ALPHA);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!((found[0].value.unwrap() + 47.3).abs() < 0.05 && found[0].sentence.contains("geoid"));
}

#[test]
fn of_a_single_point_its_own_height_may_be_wrong() {
    let mut one = survey();
    one.groups.remove(1);
    one.groups[0].members.truncate(1);
    rewrite(&mut one, 0, |_, p| p - Vector3::new(0.0, 0.0, 47.3));
    let found = screen(&one, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "height-offset", "{found:?}");
    assert!(!found[0].mend.is_empty() && found[0].sentence.contains("One point alone"), "{found:?}");
}

#[test]
fn turned_and_scaled_lists() {
    let mut turned = survey();
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2f64.to_radians());
    rewrite(&mut turned, 1, |_, p| rotation * p);
    let found = screen(&turned, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "rotation", "{found:?}");
    assert!((found[0].value.unwrap() - 2.0).abs() < 0.01);
    let mut scaled = survey();
    rewrite(&mut scaled, 1, |_, p| p * 1.03);
    let found = screen(&scaled, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "scale", "{found:?}");
}

#[test]
fn single_members() {
    let mut wrong = survey();
    wrong.groups[0].members[4].recorded.z += 1.0;
    let found = screen(&wrong, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "wrong-coordinate" && found[0].names == ["p4"], "{found:?}");
    assert!((found[0].value.unwrap() - 1.0).abs() < 0.02);

    let mut swapped = survey();
    let [a, b] = [1, 6].map(|k| swapped.groups[0].members[k].recorded);
    (swapped.groups[0].members[1].recorded, swapped.groups[0].members[6].recorded) = (b, a);
    let found = screen(&swapped, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "exchanged" && found[0].names == ["p1", "p6"], "{found:?}");

    let mut between = survey();
    let (a, b) = (between.groups[0].members[1].recorded, between.groups[1].members[6].recorded);
    (between.groups[0].members[1].recorded, between.groups[1].members[6].recorded) = (b, a);
    let found = screen(&between, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "exchanged" && found[0].names == ["p1", "p36"], "{found:?}");
}

#[test]
fn an_offset_in_a_bent_network_is_no_tilt() {
    // A bend of a ten thousandth of the extent, as long blocks have it.
    let mut bent = survey();
    rewrite(&mut bent, 1, |_, p| p + Vector3::new(0.0, 0.0, 1.5 + 1e-4 * (p.x - 100.0)));
    let found = screen(&bent, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "height-offset", "{found:?}");
    assert!((found[0].value.expect("a size").abs() - 1.5).abs() < 0.02, "{found:?}");
    let mut tilted = survey();
    rewrite(&mut tilted, 1, |_, p| p + Vector3::new(0.0, 0.0, 1e-2 * (p.x - 100.0)));
    let found = screen(&tilted, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "tilt", "{found:?}");
}

#[test]
fn lists_of_positions_that_slipped() {
    let mut slipped = survey();
    let list: Vec<_> = slipped.groups[2].members.iter().map(|member| member.recorded).collect();
    rewrite(&mut slipped, 2, |k, p| list.get(k + 1).copied().unwrap_or(p));
    let found = screen(&slipped, ALPHA);
    assert!(found.iter().any(|m| m.kind == "paired-with-neighbour" && m.value == Some(1.0)), "{found:?}");

    let mut zeros = survey();
    rewrite(&mut zeros, 2, |k, p| if k % 9 == 0 { Vector3::zeros() } else { p });
    let found = screen(&zeros, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "collapsed" && found[0].names.len() == 7, "{found:?}");

    let mut one = survey();
    rewrite(&mut one, 0, |k, p| if k == 4 { Vector3::zeros() } else { p });
    let found = screen(&one, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "collapsed" && found[0].names == ["p4"], "{found:?}");

    let mut images = survey();
    rewrite(&mut images, 2, |k, _| {
        list[if k == 20 {
            31
        } else if k == 31 {
            20
        } else {
            k
        }]
    });
    let found = screen(&images, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "exchanged" && found[0].subject == "images", "{found:?}");

    let mut flight = survey();
    rewrite(&mut flight, 2, |k, p| if k >= 40 { p + Vector3::new(0.0, 0.0, 15.0) } else { p });
    let found = screen(&flight, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "flight-offset" && found[0].names.len() == 20, "{found:?}");
}

/// Strips that are all flown one way move together by a difference of clocks; those at another speed stay behind.
#[test]
fn a_difference_of_clocks_shows_in_the_flights_of_another_speed() {
    const SPEEDS: [f64; 4] = [5.0, 5.0, 4.0, 6.0];
    const IMAGES: usize = 15;
    let along = |flight: usize, time: f64| {
        let wander = 0.4 * Vector3::new((0.9 * time).sin(), 0.0, (1.7 * time).sin());
        Vector3::new(12.0 * flight as f64, SPEEDS[flight] * time - 200.0, 60.0 + 8.0 * flight as f64) + wander
    };
    let of_image = |k: usize| (k / IMAGES, 4.0 * (k % IMAGES) as f64);
    let place_of = |subject: Subject, k: usize| match subject {
        Subject::Gnss => along(of_image(k - 100).0, of_image(k - 100).1),
        _ => place(subject, k),
    };
    let mut survey = survey_at(place_of);
    survey.groups[2].flights = ["a", "b", "c", "d"].map(String::from).to_vec();
    survey.groups[2].members.iter_mut().enumerate().for_each(|(k, member)| {
        let (flight, time) = of_image(k);
        (member.flight, member.time) = (flight, Some(time));
    });
    assert!(kinds(&survey).is_empty());
    rewrite(&mut survey, 2, |k, _| along(of_image(k).0, of_image(k).1 + 18.0));
    let found = screen(&survey, ALPHA);
    assert!(found.len() == 1 && found[0].kind == "clock-offset", "{found:?}");
    assert!(found[0].value.is_some_and(|seconds| (seconds - 18.0).abs() < 0.3), "{found:?}");
}
