//! Surveyed positions that lie where no camera sees them: told by their values alone, with few points, too.

use super::made::{block, expect, gnss, named, points};
use misclosure::block::edit::Change;
use misclosure::block::{Block, Role};
use misclosure::geodesy::exchanged::exchanged;
use misclosure::geodesy::geographic::{Geographic, LocalSystem};
use nalgebra::Vector3;

/// A block with a few surveyed points: too few to judge their shape.
fn few(count: usize) -> Block {
    let mut block = block("mapping", 3);
    block.surveyed.truncate(count);
    block.marks.retain(|mark| mark.point.index() < count);
    block.surveyed.iter_mut().for_each(|point| point.role = Role::Control);
    let origin = Geographic { latitude: 52.5, longitude: 13.4, height: 0.0 };
    block.crs = LocalSystem { origin }.crs();
    block
}

#[test]
fn right_ones_are_not_named() {
    let found = named(&few(3));
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn latitude_and_longitude_exchanged() {
    let right = few(3);
    let mut wrong = right.clone();
    points(&mut wrong, Role::Control, |p| exchanged(&right.crs, &p).expect("a place"));
    let found = named(&wrong);
    let mistake = expect(&found, "geographic", "control", "exchanged");
    assert!(mistake.value.expect("a distance") > 1e6, "{mistake:?}");
    let value = |edit: &misclosure::block::edit::Edit| match &edit.change {
        Change::Set { value, .. } => value.parse::<f64>().expect("a number"),
        other => panic!("{other:?}"),
    };
    let undone: Vec<f64> = mistake.mend.iter().map(value).collect();
    let expected = right.surveyed.iter().flat_map(|point| [point.position.x, point.position.y, point.position.z]);
    assert_eq!(undone.len(), 9);
    for (undone, expected) in undone.iter().zip(expected) {
        assert!((undone - expected).abs() < 0.01, "{undone} {expected}");
    }
}

#[test]
fn another_system_in_the_head_of_the_list() {
    let mut wrong = few(3);
    points(&mut wrong, Role::Control, |p| p + Vector3::new(218_000.0, 0.0, -3700.0));
    expect(&named(&wrong), "other-frame", "control", "218 km away");
}

#[test]
fn cameras_below_what_they_look_down_on() {
    let mut wrong = few(3);
    points(&mut wrong, Role::Control, |p| p + Vector3::new(0.0, 0.0, 400.0));
    expect(&named(&wrong), "height-offset", "control", "400 m too high");
    let mut sign = few(3);
    gnss(&mut sign, |_, p| Vector3::new(p.x, p.y, -p.z));
    expect(&named(&sign), "axis-reversed", "gnss", "GNSS heights of the wrong sign");
}

#[test]
fn four_points_with_the_same_coordinates() {
    let mut wrong = few(4);
    points(&mut wrong, Role::Control, |_| Vector3::new(1.0, 2.0, 3.0));
    let found = named(&wrong);
    assert_eq!(expect(&found, "collapsed", "control", "one place").value, Some(4.0));
}
