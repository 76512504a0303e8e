//! The number of threads, and the width of the vector registers, change how long it takes, not what comes out.

use crate::adjust::null_model::null_model;
use crate::common::{effect, half_dike, preset, solve_both_with};
#[cfg(feature = "ceres")]
use misclosure::adjust::ceres::Ceres;
use misclosure::adjust::native::Native;
use misclosure::adjust::{Options, Solution, Solver};
use misclosure::block::Block;
use misclosure::math::vectors::{Vectors, use_vectors};
use misclosure::model::{Datum, Loss, Model};
use misclosure::null_model::{NoColumns, Parts};
use misclosure::problem::Problem;
use misclosure::scenario::add_noise;
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

/// Held by a test that chooses the width of registers, which holds for the whole program.
static WIDTH: Mutex<()> = Mutex::new(());

/// Enough measurements for several chunks of work.
fn block() -> Block {
    let mut block = preset("dike", &[("points", 9000.0), ("check", 10.0)], 31).block;
    add_noise(&mut block, 0.3, 32).expect("noise");
    assert!(block.ties.len() > 3 * 16_384, "several chunks");
    block
}

fn solve(solver: &dyn Solver, block: &Block, threads: usize) -> Solution {
    let problem = Problem::new(block, &Model { datum: Datum::All, ..Model::default() }).expect("a problem");
    let options = Options { threads, ..Options::default() };
    solver.solve(&problem, &options, &mut |_| ControlFlow::Continue(())).expect("a solution")
}

/// Every bit of estimates, cost and covariance.
fn bits(solution: &Solution) -> Vec<u64> {
    let state = &solution.state;
    let covariance = solution.covariance.as_ref().expect("a covariance");
    let mut numbers: Vec<f64> = state.interiors.iter().flatten().copied().collect();
    for pose in &state.poses {
        numbers.extend(pose.rotation.coords.iter().chain(pose.centre.iter()));
    }
    numbers.extend(state.points.iter().flat_map(|point| point.iter().copied().collect::<Vec<_>>()));
    numbers.extend(covariance.shared.iter().copied());
    numbers.extend(covariance.poses.iter().flat_map(|block| block.iter().copied().collect::<Vec<_>>()));
    numbers.extend(covariance.points.iter().flat_map(|block| block.iter().copied().collect::<Vec<_>>()));
    numbers.push(solution.cost);
    numbers.into_iter().map(f64::to_bits).collect()
}

#[test]
fn native_gives_the_same_bits_on_any_number_of_threads() {
    let block = block();
    let one = solve(&Native, &block, 1);
    for threads in [2, 3] {
        let other = solve(&Native, &block, threads);
        assert_eq!(one.iterations, other.iterations);
        assert!(bits(&one) == bits(&other), "{threads} threads change bits");
    }
}

#[test]
fn native_gives_the_same_bits_in_registers_of_any_width() {
    let mut block = half_dike(500.0, 10.0, 33).block;
    add_noise(&mut block, 0.3, 34).expect("noise");
    let plain = Model { datum: Datum::All, ..Model::default() };
    let mut field = effect("image-grid");
    for (name, value) in [("centre_x", 2000.0), ("centre_y", 1500.0), ("cell", 200.0)] {
        field.values.insert(name.to_owned(), value);
    }
    let models = [
        plain.clone(),
        // Values per image in the images' blocks; a border too wide for whole rows; a loss that weighs each
        // measurement.
        Model { effects: vec![effect("focal-image")], ..plain.clone() },
        Model { effects: vec![field], ..plain.clone() },
        Model { loss: Loss::Huber, tie_dc_to_pp: true, ..plain },
    ];
    let solve = |model: &Model| {
        let problem = Problem::new(&block, model).expect("a problem");
        Native.solve(&problem, &Options::default(), &mut |_| ControlFlow::Continue(())).expect("a solution")
    };
    let _chosen = WIDTH.lock().unwrap_or_else(PoisonError::into_inner);
    for (number, model) in models.iter().enumerate() {
        let widest = bits(&solve(model));
        let mut tried = 0;
        for vectors in [Vectors::Plain, Vectors::Avx2, Vectors::Avx512] {
            if use_vectors(Some(vectors)) {
                assert!(bits(&solve(model)) == widest, "model {number}: {vectors:?} changes bits");
                tried += 1;
            } else {
                eprintln!("skipped: no {vectors:?} on this machine");
            }
        }
        assert!(use_vectors(None) && tried > 0);
    }
}

/// Every bit of what a null model says, by image and by cell of the sensor too.
fn score_bits(block: &Block, threads: usize) -> Vec<u64> {
    let null = null_model(block, threads);
    let mut scores = null.test(&NoColumns).expect("scores");
    let by_pass =
        [scores.score.as_slice(), scores.information.as_slice(), &scores.squares, &scores.held, &scores.length]
            .concat();
    let columns: Vec<usize> = (0..scores.score.len()).collect();
    let Parts { of_images, of_sensor, .. } = null.parts(&mut scores, &columns).expect("parts");
    let parts = of_images.iter().chain(of_sensor.iter().flatten());
    let by_part = parts.flat_map(|(score, information)| score.iter().chain(information.iter()));
    by_pass.iter().chain(by_part).map(|number| number.to_bits()).collect()
}

#[test]
fn null_model_has_the_same_bits_on_any_number_of_threads_and_in_registers_of_any_width() {
    let mut block = half_dike(500.0, 10.0, 33).block;
    add_noise(&mut block, 0.3, 34).expect("noise");
    let one = score_bits(&block, 1);
    for threads in [2, 3] {
        assert!(score_bits(&block, threads) == one, "{threads} threads change bits");
    }
    let _chosen = WIDTH.lock().unwrap_or_else(PoisonError::into_inner);
    for vectors in [Vectors::Plain, Vectors::Avx2, Vectors::Avx512] {
        if use_vectors(Some(vectors)) {
            assert!(score_bits(&block, 1) == one, "{vectors:?} changes bits");
        } else {
            eprintln!("skipped: no {vectors:?} on this machine");
        }
    }
    assert!(use_vectors(None));
}

/// Ceres sums in the order in which its threads finish; on one thread the order is fixed, on several the rounding is
/// not.
#[cfg(feature = "ceres")]
#[test]
fn ceres_repeats_itself_on_one_thread_and_agrees_on_several() {
    let block = block();
    let one = solve(&Ceres, &block, 1);
    assert!(bits(&one) == bits(&solve(&Ceres, &block, 1)), "one thread repeats its bits");
    let two = solve(&Ceres, &block, 2);
    let covariance = &one.covariance.as_ref().expect("a covariance").shared;
    for k in 0..12 {
        let difference = (one.state.interiors[0][k] - two.state.interiors[0][k]).abs() / covariance[(k, k)].sqrt();
        assert!(difference < misclosure::adjust::agreement::PARAMETER_SIGMA, "{difference:e} sigma");
    }
    assert!((one.cost / two.cost - 1.0).abs() < misclosure::adjust::agreement::COST_REL);
}

#[test]
fn both_solvers_agree_whatever_the_threads() {
    let block = block();
    for threads in [1, 3] {
        solve_both_with(&block, &Model::default(), &Options { threads, ..Options::default() });
    }
}
