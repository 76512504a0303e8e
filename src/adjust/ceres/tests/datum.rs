//! Position, orientation and scale from observed positions, or from nothing.

use super::recovery::{RECOVERED_SIGMAS, assert_recovered};
use super::*;

/// No pose held: position, orientation and scale come from observed positions.
fn hold_by_positions(control: bool) {
    let (truth, mut problem) = problem();
    problem.pose_free = vec![[true; 6]; IMAGES];
    problem.datum_defect = 0;
    for i in 0..IMAGES {
        if control {
            observe_point(&mut problem, 9 * i);
        } else {
            observe_image(&mut problem, i);
        }
    }
    disturb(&mut problem, 7);
    let solution = solve(&problem).unwrap();
    assert_recovered(&problem, &truth, &solution, RECOVERED_SIGMAS);
}

#[test]
fn datum_by_control() {
    hold_by_positions(true);
}

#[test]
fn datum_by_gnss() {
    hold_by_positions(false);
}

#[test]
fn without_a_datum_poses_are_named() {
    let (_, mut problem) = problem();
    problem.pose_free = vec![[true; 6]; IMAGES];
    let names = null_directions(&problem);
    assert_eq!(names.len(), 7, "{names:?}");
    assert!(names.iter().all(|name| name.starts_with("img")), "{names:?}");
}
