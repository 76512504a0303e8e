//! Outliers: what is wrong is found, what an effect moved stays.

use crate::common;
use misclosure::adjust::{CovarianceOf, Options};
use misclosure::block::{Block, ImageId, PointId};
use misclosure::model::{Datum, Model};
use misclosure::problem::{MeasurementKind, Problem, State};
use misclosure::run::RunError;
use misclosure::scenario::add_noise;
use misclosure::snooping::{self, Outliers, Round, Snooping, Solved, Strictness};
use std::collections::BTreeSet;

/// px.
const NOISE: f64 = 0.3;
/// Size of a gross error, in sigma.
const GROSS: f64 = 20.0;
/// One measurement in fifty is wrong.
const EVERY: usize = 50;

fn block(preset: &str, points: f64, seed: u64) -> Block {
    let mut block = common::preset(preset, &[("points", points)], seed).block;
    add_noise(&mut block, NOISE, seed).unwrap();
    block
}

/// A sequence of numbers in 0..1 that has nothing to do with the noise.
fn scatter(k: usize) -> f64 {
    (k as f64 * 0.754_877_666_246_693).fract()
}

/// Moves one tie measurement in [`EVERY`] by [`GROSS`] sigma in a scattered direction; returns which.
fn contaminate(block: &mut Block) -> BTreeSet<usize> {
    let picked: BTreeSet<usize> =
        (0..block.ties.len() / EVERY).map(|k| k * EVERY + (scatter(k) * EVERY as f64) as usize).collect();
    for k in &picked {
        let angle = scatter(k * 7 + 3) * std::f64::consts::TAU;
        block.ties[*k].x += GROSS * NOISE * angle.cos();
        block.ties[*k].y += GROSS * NOISE * angle.sin();
    }
    picked
}

fn search(block: &Block, strictness: Strictness) -> Outliers {
    let model = Model { datum: Datum::Free, ..Model::default() };
    let options = Options { covariance: CovarianceOf::Nothing, ..Options::default() };
    let refit = |block: &Block| -> Result<(Problem, State), RunError> {
        let run = common::solve_both_with(block, &model, &options);
        let state = run.solution().state.clone();
        Ok((run.problem, state))
    };
    snooping::find(block, snooping::SnoopingOptions { strictness, ..Default::default() }, refit).unwrap()
}

fn rays(block: &Block) -> Vec<usize> {
    let mut rays = vec![0; block.tie_points.len()];
    block.ties.iter().for_each(|row| rays[row.point.index()] += 1);
    rays
}

struct Score {
    /// Share of the wrong measurements that are rejected or whose point takes no part any more.
    found: f64,
    /// The same where a third ray shows which one is wrong.
    found_of_three: f64,
    /// Share of the good measurements that were rejected.
    false_rejections: f64,
    /// The same at points with three rays or more.
    false_of_three: f64,
}

fn judge(block: &Block, wrong: &BTreeSet<usize>, found: &Outliers) -> Score {
    let rejected: BTreeSet<usize> =
        found.rejected.iter().filter(|r| r.kind == MeasurementKind::Tie).map(|r| r.measurement).collect();
    let lost: BTreeSet<PointId> = found.lost_points.iter().copied().collect();
    let rays = rays(block);
    let three = |m: &usize| rays[block.ties[*m].point.index()] > 2;
    let hit = |m: &&usize| rejected.contains(*m) || lost.contains(&block.ties[**m].point);
    let good: Vec<usize> = (0..block.ties.len()).filter(|m| !wrong.contains(m)).collect();
    let share = |n: usize, of: usize| n as f64 / of.max(1) as f64;
    let false_rejections = |of: &mut dyn FnMut(&usize) -> bool| {
        let of: Vec<usize> = good.iter().copied().filter(|m| of(m)).collect();
        share(of.iter().filter(|m| rejected.contains(m)).count(), of.len())
    };
    Score {
        found: share(wrong.iter().filter(hit).count(), wrong.len()),
        found_of_three: share(
            wrong.iter().filter(|m| three(m)).filter(hit).count(),
            wrong.iter().filter(|m| three(m)).count(),
        ),
        false_rejections: false_rejections(&mut |_| true),
        false_of_three: false_rejections(&mut |m| three(m)),
    }
}

fn gross_errors_are_found(preset: &str, points: f64) {
    for strictness in [Strictness::Tight, Strictness::Loose] {
        let mut block = block(preset, points, 11);
        let wrong = contaminate(&mut block);
        let found = search(&block, strictness);
        let score = judge(&block, &wrong, &found);
        let two = wrong.iter().filter(|m| rays(&block)[block.ties[**m].point.index()] == 2).count();
        println!(
            "{preset} {strictness:?}: {} measurements, {} wrong ({two} of them on two rays): found {:.1} % ({:.1} % \
             with three rays), false {:.3} % ({:.3} %), {} points lost, rounds {:?}",
            block.ties.len(),
            wrong.len(),
            100.0 * score.found,
            100.0 * score.found_of_three,
            100.0 * score.false_rejections,
            100.0 * score.false_of_three,
            found.lost_points.len(),
            found.rounds,
        );
        assert!(found.settled);
        assert!(score.found >= 0.95 && score.found_of_three >= 0.95);
        assert!(score.false_rejections < 0.002);
    }
}

#[test]
fn gross_errors_are_found_in_a_corridor() {
    gross_errors_are_found("dike", 6000.0);
}

#[test]
fn gross_errors_are_found_in_a_mapping_block() {
    gross_errors_are_found("mapping", 6000.0);
}

#[test]
fn nothing_is_rejected_where_nothing_is_wrong() {
    for seed in 1..=3 {
        let found = search(&block("mapping", 3000.0, seed), Strictness::Tight);
        // The level allows one measurement in a hundred blocks.
        assert!(found.rejected.is_empty(), "{:?}", found.rejected);
        assert!(found.settled && found.rounds.len() == 1);
    }
}

/// A solution by the native solver.
fn solved(block: &Block) -> (Problem, State) {
    let options = Options { covariance: CovarianceOf::Nothing, ..Options::default() };
    let run = common::solve_native(block, &Model::default(), &options);
    let state = run.solution().state.clone();
    (run.problem, state)
}

fn judge_at(search: &mut Snooping, block: &Block, (problem, state): &(Problem, State)) -> Round {
    search.judge(block, Solved { problem, state }, Strictness::Tight).unwrap()
}

#[test]
fn a_point_that_was_lost_comes_back_where_its_rays_agree() {
    let block = block("mapping", 600.0, 7);
    let model = Model::default();
    let rays = rays(&block);
    let k = (0..block.ties.len()).find(|k| rays[block.ties[*k].point.index()] == 2).expect("a point of two rays");
    let mut spoilt = block.clone();
    spoilt.ties[k].x += 100.0;
    spoilt.ties[k].y += 100.0;
    let mut search = Snooping::new(&spoilt, &model);
    judge_at(&mut search, &spoilt, &solved(&block));
    assert_eq!(search.outliers(&spoilt).lost_points, [block.ties[k].point], "one ray is left, which fits anything");
    let without = solved(&search.block(&spoilt));
    // As it was, it stays out; what it should have been comes back.
    judge_at(&mut search, &spoilt, &without);
    assert_eq!(search.outliers(&spoilt).lost_points, [block.ties[k].point]);
    let round = judge_at(&mut search, &block, &without);
    let found = search.outliers(&block);
    assert_eq!((round.returned, found.rejected.len(), found.lost_points.len()), (1, 0, 0));
    assert_eq!(*search.block(&block), block);
}

#[test]
fn the_ray_that_a_lost_point_had_kept_is_named_where_the_others_agree_without_it() {
    let block = block("mapping", 600.0, 7);
    let rays = rays(&block);
    let point = (0..rays.len()).find(|p| rays[*p] == 4).expect("a point of four rays");
    let own: Vec<usize> = (0..block.ties.len()).filter(|k| block.ties[*k].point.index() == point).collect();
    let fit = solved(&block);
    // Two of four wrong rays may meet by chance: turned until none do, and one is left.
    let lost_with = |turn: usize| -> Option<(Snooping, usize)> {
        let mut spoilt = block.clone();
        for (number, k) in own.iter().enumerate() {
            let angle = (turn * number) as f64;
            spoilt.ties[*k].x += 100.0 * angle.cos();
            spoilt.ties[*k].y += 100.0 * angle.sin();
        }
        let mut search = Snooping::new(&spoilt, &Model::default());
        judge_at(&mut search, &spoilt, &fit);
        let outliers = search.outliers(&spoilt);
        let is_out = |k: usize| outliers.rejected.iter().any(|rejected| rejected.measurement == k);
        let kept: Vec<usize> = own.iter().copied().filter(|k| !is_out(*k)).collect();
        (outliers.lost_points == [PointId::from(point)]).then(|| (search, kept[0]))
    };
    let (mut search, kept) = (1..50).find_map(lost_with).expect("a point that is lost");

    // The three others are what they should be; this one is not.
    let mut other = block.clone();
    other.ties[kept].y += 100.0;
    let fit = solved(&search.block(&other));
    let round = judge_at(&mut search, &other, &fit);
    let found: Vec<usize> = search.outliers(&other).rejected.iter().map(|rejected| rejected.measurement).collect();
    assert_eq!((round.returned, round.rejected, found), (3, 1, vec![kept]));
    assert_eq!(search.block(&other).ties.len() + 1, other.ties.len());
}

#[test]
fn of_a_point_whose_rays_do_not_meet_the_wrong_one_alone_stays_out() {
    let good = block("mapping", 600.0, 7);
    let mut spoilt = good.clone();
    spoilt.tie_points.iter_mut().for_each(|point| point.position = None);
    let rays = rays(&spoilt);
    let model = Model::default();
    // Across the whole sensor, so that the point lies behind an image.
    let across = |k: usize| {
        let camera = &good.cameras[good.images[good.ties[k].image.index()].camera.index()];
        [f64::from(camera.width_px) - good.ties[k].x, f64::from(camera.height_px) - good.ties[k].y]
    };
    let unmet = |k: usize| -> Option<(Block, Snooping)> {
        let mut block = spoilt.clone();
        [block.ties[k].x, block.ties[k].y] = across(k);
        let search = Snooping::new(&block, &model);
        let point = block.ties[k].point;
        let out = search.outliers(&block).rejected;
        (out.len() == rays[point.index()] && out[0].point == point).then_some((block, search))
    };
    let mut of_four = (0..spoilt.ties.len()).filter(|k| rays[spoilt.ties[*k].point.index()] == 4);
    let (wrong, (block, mut search)) =
        of_four.find_map(|k| Some((k, unmet(k)?))).expect("a point whose rays do not meet");
    let fit = solved(&search.block(&block));
    let round = judge_at(&mut search, &block, &fit);
    let out = search.outliers(&block).rejected;
    assert_eq!((round.returned, out.len()), (3, 1), "{out:?}");
    assert_eq!(out[0].measurement, wrong);
    assert!(out[0].normalised.is_finite(), "it is known by how much");

    // Where those that came back do not meet either, it does not come back a second time.
    assert!(search.set_aside(&block, block.ties[wrong].point));
    assert_eq!(judge_at(&mut search, &block, &fit).returned, 0);
}

#[test]
fn a_local_flaw_of_the_sensor_stays() {
    let mut block = block("mapping", 6000.0, 5);
    let camera = &block.cameras[0];
    let (cx, cy) = (0.62 * f64::from(camera.width_px), 0.4 * f64::from(camera.height_px));
    let reach = 0.12 * f64::from(camera.width_px);
    let mut inside = BTreeSet::new();
    for (k, row) in block.ties.iter_mut().enumerate() {
        let share = 1.0 - ((row.x - cx).powi(2) + (row.y - cy).powi(2)) / (reach * reach);
        if share > 0.0 {
            // A hump of 2 px in one direction, smooth to its edge.
            row.x += 2.0 * share * share * 0.8;
            row.y += 2.0 * share * share * 0.6;
            inside.insert(k);
        }
    }
    let found = search(&block, Strictness::Loose);
    let taken = found.rejected.iter().filter(|r| inside.contains(&r.measurement)).count();
    let tight = search(&block, Strictness::Tight);
    let taken_tight = tight.rejected.iter().filter(|r| inside.contains(&r.measurement)).count();
    println!(
        "{} measurements in the flaw: {taken} rejected loose ({} elsewhere), {taken_tight} tight ({} elsewhere)",
        inside.len(),
        found.rejected.len() - taken,
        tight.rejected.len() - taken_tight
    );
    assert!(inside.len() > 500);
    assert!(found.rejected.is_empty());
    assert!((taken_tight as f64) < 0.002 * inside.len() as f64);
}

#[test]
fn the_block_without_them_has_all_the_rest() {
    let block = block("mapping", 300.0, 1);
    let one = snooping::Rejected {
        kind: MeasurementKind::Tie,
        measurement: 7,
        image: ImageId(0),
        point: PointId(0),
        normalised: 9.0,
        round: 1,
    };
    let left = Outliers { rejected: vec![one], ..Outliers::default() }.without(&block);
    assert_eq!(left.ties.len() + 1, block.ties.len());
    assert_eq!(left.ties[7], block.ties[8]);
    assert_eq!(left.marks, block.marks);
}
