//! Mistakes of a whole list.

use super::made::{BLOCKS, assert_value, block, expect, gnss, named, only, points};
use misclosure::block::Role;
use misclosure::block::mended::mended;
use nalgebra::Vector3;

/// m.
const FOOT: f64 = 0.3048;

#[test]
fn coordinates_in_feet() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut control = block(preset, seed);
        points(&mut control, Role::Control, |p| p / FOOT);
        points(&mut control, Role::Check, |p| p / FOOT);
        assert_value(expect(&named(&control), "scale", "control", &what), 1.0 / FOOT, &what);
        let mut check = block(preset, seed);
        points(&mut check, Role::Check, |p| p / FOOT);
        assert_value(only(&named(&check), "scale", "check", &what), 1.0 / FOOT, &what);
        let mut antennas = block(preset, seed);
        gnss(&mut antennas, |_, p| p / FOOT);
        assert_value(only(&named(&antennas), "scale", "gnss", &what), 1.0 / FOOT, &what);
    }
}

#[test]
fn heights_in_feet_and_of_the_wrong_sign() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut feet = block(preset, seed);
        points(&mut feet, Role::Control, |p| Vector3::new(p.x, p.y, p.z / FOOT));
        assert_value(only(&named(&feet), "height-scale", "control", &what), 1.0 / FOOT, &what);
        let mut sign = block(preset, seed);
        points(&mut sign, Role::Control, |p| Vector3::new(p.x, p.y, -p.z));
        only(&named(&sign), "axis-reversed", "control", &what);
    }
}

#[test]
fn ellipsoid_beside_geoid() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut heights = block(preset, seed);
        gnss(&mut heights, |_, p| p + Vector3::new(0.0, 0.0, 47.3));
        let found = named(&heights);
        let mistake = only(&found, "height-offset", "control", &what);
        assert_value(mistake, -47.3, &what);
        assert!(mistake.sentence.contains("geoid"), "{}", mistake.sentence);
    }
}

/// Stations and antennas move positions by metres (the effect `gnss-shift`); another datum by more.
#[test]
fn positions_of_another_datum() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let moved = |by: f64| {
            let mut moved = block(preset, seed);
            gnss(&mut moved, |_, p| p + Vector3::new(-by, 0.0, 0.0));
            moved
        };
        assert!(named(&moved(5.0)).is_empty(), "{what}");
        let wrong = moved(45.0);
        let found = named(&wrong);
        let mistake = only(&found, "plan-offset", "control", &what);
        assert_value(mistake, 45.0, &what);
        let mended = mended(&wrong, &mistake.mend).expect("edits of this block");
        assert!(named(&mended).is_empty(), "{what}");
    }
}

#[test]
fn gnss_of_another_kind() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut exchanged = block(preset, seed);
        gnss(&mut exchanged, |_, p| Vector3::new(p.y, p.x, p.z));
        only(&named(&exchanged), "axes-exchanged", "gnss", &what);
        let mut degrees = block(preset, seed);
        gnss(&mut degrees, |_, p| Vector3::new(48.0 + p.y / 111_195.0, 11.0 + p.x / 74_400.0, p.z));
        expect(&named(&degrees), "geographic", "gnss", &what);
        let mut national = block(preset, seed);
        gnss(&mut national, |_, p| p + Vector3::new(691_000.0, 5_334_000.0, 510.0));
        only(&named(&national), "other-frame", "control", &what);
    }
}

#[test]
fn gnss_of_the_neighbouring_image() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut shifted = block(preset, seed);
        let positions: Vec<_> = shifted.images.iter().map(|image| image.gnss.expect("measured").position).collect();
        gnss(&mut shifted, |k, p| positions.get(k + 1).copied().unwrap_or(p));
        assert_value(expect(&named(&shifted), "paired-with-neighbour", "gnss", &what), 1.0, &what);
    }
}

#[test]
fn a_flight_with_other_heights() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut flight = block(preset, seed);
        let last = flight.flights.len() - 1;
        let of_last: Vec<bool> = flight.images.iter().map(|image| image.flight.index() == last).collect();
        gnss(&mut flight, |k, p| if of_last[k] { p + Vector3::new(0.0, 0.0, 15.0) } else { p });
        let found = named(&flight);
        let mistake = only(&found, "flight-offset", "gnss", &what);
        assert_value(mistake, 15.0, &what);
        assert_eq!(mistake.names.len(), of_last.iter().filter(|is| **is).count(), "{what}");
    }
}

#[test]
fn all_at_one_place() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut control = block(preset, seed);
        points(&mut control, Role::Control, |_| Vector3::new(1.0, 2.0, 3.0));
        assert!(only(&named(&control), "collapsed", "control", &what).names.is_empty(), "{what}");
        let mut zeros = block(preset, seed);
        gnss(&mut zeros, |k, p| if k % 9 == 0 { Vector3::zeros() } else { p });
        let found = named(&zeros);
        let names = &only(&found, "collapsed", "gnss", &what).names;
        let expected: Vec<&String> = zeros.images.iter().step_by(9).map(|image| &image.name).collect();
        assert!(names.iter().eq(expected), "{what}: {names:?}");
    }
}

#[test]
fn a_tilt_between_control_and_gnss_is_named_with_its_angle() {
    for (preset, seed) in BLOCKS {
        let sound = block(preset, seed);
        let middle = sound.surveyed.iter().map(|p| p.position).sum::<Vector3<f64>>() / sound.surveyed.len() as f64;
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), 1f64.to_radians());
        let mut tilted = sound.clone();
        points(&mut tilted, Role::Control, |p| middle + turn * (p - middle));
        let found = named(&tilted);
        let tilts: Vec<_> = found.iter().filter(|own| own.kind == "tilt").collect();
        let brief: Vec<_> = found.iter().map(|own| (&own.kind, &own.subject, own.value)).collect();
        assert!(!tilts.is_empty() && tilts.len() == found.len(), "{preset}, seed {seed}: {brief:?}");
        let angle = tilts[0].value.expect("an angle");
        assert!((angle - 1.0).abs() < 0.1, "{preset}, seed {seed}: {angle} degrees");
    }
}
