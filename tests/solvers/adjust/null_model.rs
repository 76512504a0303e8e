//! What a null model says twice, it says the same.

use crate::common::{effect, half_dike};
use misclosure::block::Block;
use misclosure::camera::{K1, K3};
use misclosure::model::Model;
use misclosure::null_model::{NoColumns, NullModel, Part, Parts, SharedBase};
use misclosure::problem::{CameraPrior, Problem};
use misclosure::scenario::add_noise;

/// The two passes of a null model round apart: the first takes of a column what the base absorbs, up to all but a
/// thousandth, as a difference of sums.
const PASSES: f64 = 1e-6;

fn block() -> Block {
    let mut block = half_dike(500.0, 10.0, 33).block;
    add_noise(&mut block, 0.3, 34).expect("noise");
    block
}

/// A null model asked about values per image and coefficients that all images share.
pub fn null_model(block: &Block, threads: usize) -> NullModel {
    null_model_sharing(&SharedBase::default(), block, true, threads)
}

/// The same on a base that is at hand; of the camera k3 is free in the base or not.
fn null_model_sharing(base: &SharedBase, block: &Block, free_k3: bool, threads: usize) -> NullModel {
    let effects = vec![effect("focal-image"), effect("radial-high"), effect("decentring-high")];
    let mut problem = Problem::new(block, &Model { effects, ..Model::default() }).expect("a problem");
    for entry in &mut problem.theta {
        (entry.free, entry.prior_sigma) = (false, None);
    }
    problem.camera_free[0][K3] &= free_k3;
    // A prior that pulls: far from its value, and as strong as the measurements.
    let [value, sigma] = [10.0, 1.0].map(|scales| scales * problem.camera_scales[0][K1]);
    let value = problem.start.interiors[0][K1] + value;
    problem.camera_priors.push(CameraPrior { camera: 0, parameter: K1 as u32, value, sigma });
    let columns = (0..problem.theta.len()).map(|t| problem.layout().theta(t)).collect();
    let state = problem.start.clone();
    NullModel::sharing(base, problem, state, columns, threads).expect("a null model")
}

#[test]
fn null_models_share_a_base_of_the_same_unknowns_and_no_other() {
    let block = block();
    let score = |base: &SharedBase, free_k3| {
        null_model_sharing(base, &block, free_k3, 1).test(&NoColumns).expect("scores").score
    };
    let [free, held] = [true, false].map(|free_k3| score(&SharedBase::default(), free_k3));
    assert!(free != held, "the base is another");
    let shared = SharedBase::default();
    for (free_k3, alone) in [(true, &free), (true, &free), (false, &held), (true, &free)] {
        assert!(score(&shared, free_k3) == *alone, "k3 free: {free_k3}");
    }
}

/// Of two families there are no products; whatever else there is has the same bits.
#[test]
fn families_are_asked_apart_from_each_other() {
    let block = block();
    let null = null_model(&block, 1);
    let together = null.test(&NoColumns).expect("scores");
    let last = together.score.len();
    // Local columns with a dense one, dense ones alone, and a column that goes with all.
    for families in [[0..3, 3..last - 1], [1..last - 2, last - 2..last], [0..last - 2, last - 2..last - 2]] {
        let apart = null.test_apart(&NoColumns, &families).expect("scores");
        assert!(apart.score == together.score && apart.squares == together.squares);
        let of = |column: usize| families.iter().position(|family| family.contains(&column));
        let mut products = 0;
        for (a, b) in (0..last).flat_map(|a| (0..last).map(move |b| (a, b))) {
            let value = apart.information[(a, b)];
            match (of(a), of(b)) {
                (Some(one), Some(other)) if one != other => assert!(value.is_nan(), "{a} with {b} is {value}"),
                _ => {
                    products += 1;
                    assert_eq!(value, together.information[(a, b)], "{a} with {b}");
                }
            }
        }
        assert!(products > last, "not the diagonal alone");
    }
}

/// The second pass takes the base out row by row, the first out of the sums; priors, which are nobody's rows, are in
/// both.
#[test]
fn parts_sum_to_what_the_null_model_says() {
    let block = block();
    let null = null_model(&block, 1);
    let scores = null.test(&NoColumns).expect("scores");
    let mut refined = scores.clone();
    let all: Vec<usize> = (0..scores.score.len()).collect();
    let Parts { columns, of_images, of_sensor } = null.parts(&mut refined, &all).expect("parts");
    assert_eq!(of_images.len(), block.images.len() + 1, "those of no image are the last");
    let has_any = |(score, _): &&Part| score.iter().any(|value| *value != 0.0);
    let count = |parts: &[Part]| parts[..parts.len() - 1].iter().filter(has_any).count();
    let [places, rows, across] = of_sensor.each_ref().map(|parts| count(parts));
    assert!(places > 100 && rows == 48 && across == 64, "{places} places, {rows} and {across} bands");
    assert!(columns.len() > 1 && columns.len() < all.len(), "values per image are not projected");
    for (a, one) in columns.iter().enumerate() {
        let size = scores.information[(*one, *one)].sqrt();
        for parts in of_sensor.iter().chain([&of_images]) {
            let sum: f64 = parts.iter().map(|(score, _)| score[a]).sum();
            let first = scores.score[*one];
            assert!((sum - first).abs() < PASSES * size, "score of {one}: {sum} for {first}");
            for (b, other) in columns.iter().enumerate() {
                let sum: f64 = parts.iter().map(|(_, information)| information[(a, b)]).sum();
                let size = size * scores.information[(*other, *other)].sqrt();
                let first = scores.information[(*one, *other)];
                assert!((sum - first).abs() < PASSES * size, "information of {one} with {other}: {sum} for {first}");
            }
        }
        assert_eq!(of_images.iter().map(|(score, _)| score[a]).sum::<f64>(), refined.score[*one]);
    }
    let per_image: Vec<usize> = all.iter().copied().filter(|column| !columns.contains(column)).collect();
    let Parts { columns, of_images, of_sensor } = null.parts(&mut refined, &per_image).expect("nothing is projected");
    assert!(columns.is_empty() && of_images.is_empty() && of_sensor.iter().all(Vec::is_empty));
}
