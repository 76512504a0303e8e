//! Cameras: two under one name, and images without the distortion of their camera.

use super::made::{BLOCKS, assert_value, block, expect, named, only, settings};
use misclosure::block::Block;
use misclosure::block::edited::edited;
use misclosure::camera::undistort::undistort;
use misclosure::camera::{F, PPX, PPY};
use misclosure::diagnose::run::diagnose;
use misclosure::diagnose::two_cameras::under_one_name;
use misclosure::diagnose::verdict::Verdict;
use misclosure::model::{Datum, Model};

/// Focal length of the second camera, as a share of that of the first.
const LONGER: f64 = 1.02;

fn model() -> Model {
    Model { datum: Datum::All, ..Model::default() }
}

/// The second half of the images has a longer focal length.
fn with_second_camera(mut block: Block) -> Block {
    let from = block.images.len() / 2;
    let interior = block.cameras[0].interior;
    let second = block.ties.iter_mut().chain(&mut block.marks).filter(|row| row.image.index() >= from);
    second.for_each(|row| {
        row.x = interior[PPX] + LONGER * (row.x - interior[PPX]);
        row.y = interior[PPY] + LONGER * (row.y - interior[PPY]);
    });
    block
}

#[test]
fn a_focal_length_of_another_lens_is_named_with_its_size() {
    for factor in [0.75, 0.97] {
        let mut block = block("dike", 1);
        block.cameras[0].interior[F] *= factor;
        let found = diagnose(&block, &model(), &settings()).expect("a diagnosis").diagnosis;
        assert!(found.found.is_empty(), "{:?}", found.found);
        if factor > 0.9 {
            assert!(found.mistakes.is_empty(), "as an EXIF header has it: {:?}", found.mistakes);
        } else {
            assert_value(only(&found.mistakes, "focal-wrong", "camera", "dike"), factor, "dike");
        }
    }
}

#[test]
fn two_focal_lengths_are_two_cameras_and_no_effect() {
    let sound = block("mapping", 3);
    assert!(under_one_name(&sound, &model(), &settings()).expect("a base model").is_empty(), "one camera");
    let two = with_second_camera(sound);
    let found = diagnose(&two, &model(), &settings()).expect("a diagnosis").diagnosis;
    assert_eq!(found.verdict, Verdict::Mistake);
    assert!(found.found.is_empty(), "{:?}", found.found);
    let mistake = expect(&found.mistakes, "several-cameras", "camera", "mapping");
    assert_eq!(found.mistakes.len(), 1, "{:?}", found.mistakes);
    let second: Vec<&String> = two.images.iter().skip(two.images.len() / 2).map(|image| &image.name).collect();
    let first: Vec<&String> = two.images.iter().take(two.images.len() / 2).map(|image| &image.name).collect();
    let names: Vec<&String> = mistake.names.iter().collect();
    assert!(names == second || names == first, "{names:?}");
    let [value, sigma] = [mistake.value, mistake.sigma].map(|own| own.expect("a size"));
    let longer = (LONGER - 1.0) * two.cameras[0].interior[F];
    assert!((value - longer).abs() < 0.1 * longer && sigma < 0.1 * longer, "{value} {sigma} {longer}");
    // The base model alone names it, too, and what undoes it leaves none.
    let alone = under_one_name(&two, &model(), &settings()).expect("a base model");
    assert_eq!(alone[0].names, mistake.names);
    let mended = edited(&two, &alone[0].mend).expect("a block");
    assert_eq!(mended.cameras.len(), 2);
    assert!(under_one_name(&mended, &model(), &settings()).expect("a base model").is_empty(), "two cameras");
}

#[test]
fn undistorted_tie_points_are_named_and_marks_stay() {
    for (preset, seed) in BLOCKS {
        let sound = block(preset, seed);
        let mut ideal = sound.clone();
        for row in &mut ideal.ties {
            let camera = sound.camera_of(row.image);
            [row.x, row.y] = undistort(&camera.interior, [row.x, row.y]).expect("an ideal point");
        }
        let found = named(&ideal);
        let mistake = expect(&found, "undistorted", "ties", preset);
        assert_eq!(found.len(), 1, "{preset} {seed}: {found:?}");
        let mended = edited(&ideal, &mistake.mend).expect("a block");
        for (mended, sound) in mended.ties.iter().zip(&sound.ties) {
            assert!((mended.x - sound.x).abs() < 1e-6 && (mended.y - sound.y).abs() < 1e-6, "{mended:?} {sound:?}");
        }
        assert_eq!(mended.marks, sound.marks);
    }
}

#[test]
fn a_distortion_of_the_opposite_sign_is_named() {
    for (preset, seed) in BLOCKS {
        let mut wrong = block(preset, seed);
        wrong.cameras.iter_mut().for_each(|camera| camera.interior[5..10].iter_mut().for_each(|own| *own = -*own));
        let found = named(&wrong);
        expect(&found, "distortion-sign", "camera", preset);
        assert_eq!(found.len(), 1, "{preset} {seed}: {found:?}");
    }
}
