//! Four control points, and nothing else that is surveyed.

use super::made::{block, expect, named_under, settings};
use misclosure::block::{Block, PointId, Role};
use misclosure::diagnose::run::diagnose;
use misclosure::diagnose::verdict::Verdict;
use misclosure::model::{Datum, Model};
use nalgebra::Vector3;

fn model() -> Model {
    Model { datum: Datum::Control, ..Model::default() }
}

/// A block without GNSS positions, of whose surveyed points four control points are left.
fn with_four() -> Block {
    let mut block = block("mapping", 1);
    block.images.iter_mut().for_each(|image| image.gnss = None);
    let control: Vec<usize> = (0..block.surveyed.len()).filter(|k| block.surveyed[*k].role == Role::Control).collect();
    let kept = [0, 3, 6, 9].map(|k| control[k]);
    let numbered = |point: PointId| kept.iter().position(|k| *k == point.index());
    block.marks.retain_mut(|mark| numbered(mark.point).map(|k| mark.point = PointId::from(k)).is_some());
    block.surveyed = kept.map(|k| block.surveyed[k].clone()).to_vec();
    block
}

#[test]
fn four_points_that_fit_are_left_alone() {
    assert!(named_under(&with_four(), &model()).is_empty());
}

#[test]
fn two_of_four_exchanged_are_named_and_the_diagnosis_goes_on() {
    let mut wrong = with_four();
    let (a, b) = (wrong.surveyed[0].position, wrong.surveyed[1].position);
    (wrong.surveyed[0].position, wrong.surveyed[1].position) = (b, a);
    let found = diagnose(&wrong, &model(), &settings()).expect("a diagnosis").diagnosis;
    assert_eq!((found.verdict, found.found.len()), (Verdict::Mistake, 0));
    let names = [0, 1].map(|k| wrong.surveyed[k].name.clone());
    assert_eq!(expect(&found.mistakes, "exchanged", "control", "four").names, names);
}

#[test]
fn one_of_four_that_is_wrong_is_said_without_a_name() {
    let mut wrong = with_four();
    wrong.surveyed[2].position += Vector3::new(-8.0, 3.0, 5.0);
    let found = diagnose(&wrong, &model(), &settings()).expect("a diagnosis").diagnosis;
    assert_eq!((found.verdict, found.found.len()), (Verdict::Mistake, 0));
    assert_eq!(expect(&found.mistakes, "shape", "control", "four").names.len(), 4);
}

#[test]
fn axes_exchanged_turn_four_points_over() {
    let mut wrong = with_four();
    wrong.surveyed.iter_mut().for_each(|point| point.position.swap_rows(0, 1));
    expect(&named_under(&wrong, &model()), "axes-exchanged", "control", "four");
}
