//! Start values: what is doubtful is said, what is good is not, and `--multistart` finds the camera again from images
//! that are turned or mirrored.

use crate::common;
use misclosure::adjust::Options;
use misclosure::adjust::native::Native;
use misclosure::block::Block;
use misclosure::camera::{F, PARAMETERS, PPX};
use misclosure::model::Model;
use misclosure::run::multistart::best_start;
use misclosure::run::start_focal::{FocalLengths, focal_lengths};
use misclosure::run::start_values::{Doubt, doubts};
use misclosure::scenario::{add_noise, preset_names};
use misclosure::snooping::Snooping;
use nalgebra::{UnitQuaternion, Vector3};

/// px.
const NOISE: f64 = 0.3;
/// A camera is found again within as many standard deviations of each parameter.
const SIGMAS: f64 = 3.0;

/// A block as it comes: without coordinates of its tie points.
fn block(preset: &str, points: f64) -> Block {
    let mut block = common::preset(preset, &[("points", points)], 5).block;
    add_noise(&mut block, NOISE, 5).expect("noise");
    (block.sigma.tie_px, block.sigma.mark_px) = (NOISE, NOISE);
    block
}

fn without_points(mut block: Block) -> Block {
    block.tie_points.iter_mut().for_each(|point| point.position = None);
    block
}

fn turned(mut block: Block, degrees: f64) -> Block {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
    block.images.iter_mut().for_each(|image| image.pose.rotation = turn * image.pose.rotation);
    block
}

/// The base the other way round, as where coordinates have another sign.
fn mirrored(mut block: Block) -> Block {
    block.images.iter_mut().for_each(|image| image.pose.centre = -image.pose.centre);
    block
}

fn doubts_of(block: &Block) -> Vec<Doubt> {
    let interiors: Vec<_> = block.cameras.iter().map(|camera| camera.interior).collect();
    doubts(block, &interiors)
}

#[test]
fn a_good_block_has_nothing_doubtful() {
    for preset in preset_names() {
        let mut block = block(preset, 600.0);
        assert_eq!(doubts_of(&block), [], "{preset}");
        for image in &mut block.images {
            image.pose.centre += Vector3::new(0.3, -0.2, 0.1);
        }
        assert_eq!(doubts_of(&without_points(block)), [], "{preset} without coordinates");
    }
}

#[test]
fn what_is_doubtful_is_said() {
    let text = |block: &Block| doubts_of(block).iter().map(Doubt::to_string).collect::<Vec<_>>().join("\n");
    let good = block("mapping", 600.0);
    let mut shifted = good.clone();
    shifted.cameras[0].interior[PPX] = -50.0;
    assert!(text(&shifted).starts_with("the principal point of camera"), "{}", text(&shifted));
    for spoilt in [mirrored(without_points(good.clone())), turned(without_points(good.clone()), 90.0)] {
        assert!(text(&spoilt).contains("% of the tie points lie behind"), "{}", text(&spoilt));
    }
    // Coordinates that are given, under cameras that look up.
    let mut up = good;
    let half = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    up.images.iter_mut().for_each(|image| image.pose.rotation = half * image.pose.rotation);
    assert!(text(&up).starts_with("100 % of the tie points"), "{}", text(&up));
}

fn focal_lengths_of(block: &Block) -> FocalLengths {
    let interiors: Vec<_> = block.cameras.iter().map(|camera| camera.interior).collect();
    focal_lengths(block, &Model::default(), &interiors).expect("a problem")
}

/// Images off by a metre and a degree, as a flight log has them.
fn as_logged(mut block: Block) -> Block {
    for (i, image) in block.images.iter_mut().enumerate() {
        let wave = |k: f64| (k * (i as f64 + 1.0)).sin();
        image.pose.centre += Vector3::new(wave(1.3), wave(2.1), wave(3.7));
        let turn = Vector3::new(wave(0.7), wave(1.9), wave(2.9)) * 1f64.to_radians();
        image.pose.rotation = UnitQuaternion::from_scaled_axis(turn) * image.pose.rotation;
    }
    block
}

#[test]
fn a_focal_length_that_starts_at_half_or_at_twice_is_doubted() {
    let exact = preset_names().into_iter().map(|preset| (preset, without_points(block(preset, 600.0))));
    // Images that all look down tell it only where their poses are known better; and a metre is the whole scene of
    // `closerange`.
    let logged = ["dike", "corridor"].map(|preset| (preset, as_logged(without_points(block(preset, 600.0)))));
    for (preset, good) in exact.chain(logged) {
        assert_eq!(focal_lengths_of(&good).doubts, [], "{preset}");
        for factor in [0.5, 1.0 / 1.8, 1.8, 2.0] {
            let mut wrong = good.clone();
            let truth = wrong.cameras[0].interior[F];
            wrong.cameras[0].interior[F] *= factor;
            let found = focal_lengths_of(&wrong);
            let [Doubt::FocalLength { better, .. }] = found.doubts[..] else {
                panic!("{preset} at {factor} times: {found:?}");
            };
            assert!((0.7..1.4).contains(&(better / truth)), "{preset} at {factor} times: {found:?}");
        }
    }
}

#[test]
fn a_good_focal_length_is_told_by_exact_poses() {
    for preset in preset_names() {
        let found = focal_lengths_of(&without_points(block(preset, 600.0)));
        assert_eq!(found, FocalLengths::default(), "{preset}");
    }
}

/// Control in feet, or of another place: it stands beside where the images look, at every focal length.
#[test]
fn wrong_control_says_nothing_of_the_focal_length() {
    for preset in ["dike", "corridor", "mapping"] {
        let good = as_logged(without_points(block(preset, 600.0)));
        let in_feet: fn(&mut Vector3<f64>) = |at| *at /= 0.3048;
        let elsewhere: fn(&mut Vector3<f64>) = |at| *at += Vector3::new(400.0, -250.0, 0.0);
        for wrong in [in_feet, elsewhere] {
            let mut block = good.clone();
            block.surveyed.iter_mut().for_each(|point| wrong(&mut point.position));
            assert_eq!(focal_lengths_of(&block).doubts, [], "{preset}");
        }
    }
}

#[test]
fn what_tells_nothing_of_the_focal_length_is_said() {
    // One strip that looks down, its attitudes and heights no better than level flight: height and focal length scale
    // alike.
    let mut level = without_points(block("dike", 600.0));
    let strip: Vec<_> = (0..level.images.len()).filter(|i| level.images[*i].name.starts_with("nadir50")).collect();
    let is_in = |image: misclosure::block::ImageId| strip.contains(&image.index());
    level.ties.retain(|row| is_in(row.image));
    level.marks.clear();
    level.images.iter_mut().for_each(|image| image.gnss = None);
    let found = focal_lengths_of(&as_logged(level));
    assert_eq!(found.doubts, []);
    assert!(matches!(&found.untold[..], [(camera, _)] if camera == "cam"), "{:?}", found.untold);
}

#[test]
fn a_camera_is_found_again_from_turned_and_mirrored_images() {
    let good = without_points(block("mapping", 400.0));
    let truth = good.cameras[0].interior;
    let model = Model::default();
    let options = Options { threads: 2, ..Options::default() };
    let starts = [
        ("turned by 90 degrees", turned(good.clone(), 90.0)),
        ("turned by 180 degrees", turned(good.clone(), 180.0)),
        ("turned by 270 degrees", turned(good.clone(), 270.0)),
        ("mirrored", mirrored(good)),
    ];
    for (name, spoilt) in starts {
        let (block, model) = best_start(&spoilt, &model, &Native, &options, &|_| {}).expect("a start");
        assert_eq!(doubts_of(&block), [], "{name}");
        // As the program does: without the points whose rays do not meet.
        let block = Snooping::new(&block, &model).block(&block);
        let run = common::solve_native(&block, &model, &options);
        assert!(run.sigma0() < 1.2, "{name}: sigma0 {}", run.sigma0());
        let covariance = run.solution().covariance.as_ref().expect("a covariance");
        for (k, parameter) in PARAMETERS.iter().enumerate() {
            let row = covariance.shared_unknowns.iter().position(|unknown| *unknown == k).expect("a free parameter");
            let off = (run.solution().state.interiors[0][k] - truth[k]) / covariance.shared[(row, row)].sqrt();
            assert!(off.abs() < SIGMAS, "{name}: {parameter} is off by {off:.2} sigma");
        }
    }
}
