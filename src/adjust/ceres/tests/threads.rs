//! Repetition, and the number of threads.

use super::*;
use approx::assert_relative_eq;

#[test]
fn one_thread_repeats_to_the_last_bit_and_several_to_rounding() {
    let (_, mut problem) = problem();
    add_noise(&mut problem, 0.5, 14);
    disturb(&mut problem, 15);
    let with = |threads| solve_with(&problem, &Options { threads, ..options() }).unwrap();
    let (one, again, two) = (with(1), with(1), with(2));
    assert!(one.state == again.state, "two runs differ");
    assert_eq!(one.covariance, again.covariance);
    // Ceres adds up in the order in which its threads arrive.
    assert_relative_eq!(one.cost, two.cost, max_relative = 1e-12);
    for (a, b) in one.state.points.iter().zip(&two.state.points) {
        assert!((a - b).norm() < 1e-9);
    }
}
