//! Control that does not fix a block, and blocks that need none.

use super::made::{block, expect, named_under, settings};
use misclosure::block::{Block, Role};
use misclosure::diagnose::run::diagnose;
use misclosure::diagnose::verdict::Verdict;
use misclosure::mistakes::Mistake;
use misclosure::model::{Datum, Model};

fn model(datum: Datum) -> Model {
    Model { datum, ..Model::default() }
}

fn named(block: &Block, datum: Datum) -> Vec<Mistake> {
    named_under(block, &model(datum))
}

/// A block without GNSS positions, of whose control points those with these numbers are left.
fn with_control(kept: &[usize]) -> Block {
    let mut block = block("dike", 1);
    block.images.iter_mut().for_each(|image| image.gnss = None);
    let control = block.surveyed.iter_mut().filter(|point| point.role == Role::Control).enumerate();
    control.filter(|(k, _)| !kept.contains(k)).for_each(|(_, point)| point.role = Role::Check);
    block
}

#[test]
fn two_control_points_are_too_few_where_they_must_fix_the_block() {
    let two = with_control(&[0, 5]);
    let found = named(&two, Datum::Control);
    assert_eq!((found.len(), expect(&found, "too-few", "control", "dike").value), (1, Some(2.0)), "{found:?}");
    assert!(named(&two, Datum::Free).is_empty(), "a free network needs none");
    let all: Vec<usize> = (0..10).collect();
    assert!(named(&with_control(&all), Datum::All).is_empty(), "ten are enough");
    // The diagnosis goes on without a datum, and has no parameter that nothing determines.
    let found = diagnose(&two, &model(Datum::All), &settings()).expect("a diagnosis").diagnosis;
    assert_eq!(found.verdict, Verdict::Mistake);
    expect(&found.mistakes, "too-few", "control", "diagnosis");
    assert!(found.found.is_empty(), "{:?}", found.found);
}

#[test]
fn gnss_positions_fix_a_block_beside_two_control_points() {
    let mut both = with_control(&[0, 5]);
    let right = block("dike", 1);
    both.images.iter_mut().zip(right.images).for_each(|(image, right)| image.gnss = right.gnss);
    assert!(named(&both, Datum::All).is_empty());
    expect(&named(&both, Datum::Control), "too-few", "control", "positions that take no part");
}
