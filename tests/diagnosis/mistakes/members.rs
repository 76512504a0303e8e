//! Mistakes of single points and images.

use super::made::{BLOCKS, assert_value, block, named, noisy, only};
use misclosure::block::Role;
use nalgebra::Vector3;

#[test]
fn two_points_exchanged() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut swapped = block(preset, seed);
        let (a, b) = (swapped.surveyed[1].position, swapped.surveyed[3].position);
        (swapped.surveyed[1].position, swapped.surveyed[3].position) = (b, a);
        let found = named(&swapped);
        let names = [&swapped.surveyed[1].name, &swapped.surveyed[3].name];
        assert!(only(&found, "exchanged", "control", &what).names.iter().eq(names), "{what}");
    }
}

#[test]
fn one_height_wrong() {
    for (preset, seed) in BLOCKS {
        for (k, size) in [(2, 1.0), (5, -3.0)] {
            let what = format!("{preset} {seed}, {size} m");
            let mut wrong = block(preset, seed);
            assert_eq!(wrong.surveyed[k].role, Role::Control);
            wrong.surveyed[k].position.z += size;
            let found = named(&wrong);
            let mistake = only(&found, "wrong-coordinate", "control", &what);
            assert_value(mistake, size, &what);
            assert_eq!(mistake.names, [wrong.surveyed[k].name.clone()], "{what}");
        }
    }
}

#[test]
fn gnss_positions_without_a_fix() {
    for (preset, seed) in BLOCKS {
        let what = format!("{preset} {seed}");
        let mut wrong = block(preset, seed);
        for k in [11, 56] {
            wrong.images[k].gnss.as_mut().expect("measured").position += Vector3::new(-8.0, 0.0, 5.0);
        }
        let found = named(&wrong);
        let names = [11, 56].map(|k| wrong.images[k].name.clone());
        assert_eq!(only(&found, "wrong-position", "gnss", &what).names, names, "{what}");
    }
}

#[test]
fn a_place_that_few_tie_points_hold_contradicts_nobody() {
    // Eight tie points an image, and check points and positions that their noise leaves decimetres off.
    for seed in 1..=20 {
        let found = named(&noisy("mapping", 150.0, seed));
        assert!(found.is_empty(), "{seed}: {found:?}");
    }
}
