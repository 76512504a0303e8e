//! The judge: `improve` on a block of every seed, held against what was put in.

use crate::fresh::draw::Fresh;
use crate::fresh::measure::Measured;
use crate::in_turn::in_turn;
use crate::judging::program::improve;
use crate::judging::rule::Truth;
use crate::judging::tally::{Judged, judged, print_hit_rates, score};
use misclosure::io::block::write_block;
use std::path::PathBuf;

/// Seeds to judge, `1..40` say, both included.
const SEEDS: &str = "MISCLOSURE_FRESH";
/// Those that `make test` judges.
const SOME: &str = "1..4";
/// Folder that keeps the blocks and what is in them, one folder for each seed, for a closer look.
const KEEP: &str = "MISCLOSURE_FRESH_KEEP";
/// Part that must be right.
const RIGHT: f64 = 0.95;

#[test]
fn improve_finds_what_nobody_chose() {
    let seeds = seeds();
    let all = in_turn(&seeds, |seed| judge(*seed));
    print_hit_rates(&all);
    let score = score(&all);
    let right = all.iter().filter(|judged| judged.right()).count() as f64;
    assert!(right >= RIGHT * all.len() as f64, "{score}");
    assert!(all.iter().all(|judged| !judged.clean || judged.right()), "a block without any cause is wrong: {score}");
}

fn seeds() -> Vec<u64> {
    let text = std::env::var(SEEDS).ok().filter(|text| !text.is_empty()).unwrap_or(SOME.into());
    let seeds = text.split_once("..").and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
    let Some((from, to)): Option<(u64, u64)> = seeds else { panic!("{SEEDS}={text} is not of the form 1..40") };
    assert!(from <= to, "{SEEDS}={text}: no seed");
    (from..=to).collect()
}

/// Looks at the instrument, not at the program: [`Measured::new`] fails where an effect leaves a tenth of its cause or
/// more. Prints what the seeds put into their blocks: `MISCLOSURE_FRESH=1..40 cargo test --release --test diagnosis
/// every_cause -- --nocapture`.
#[test]
fn every_cause_is_described_by_its_effect() {
    for seed in seeds() {
        let measured = Measured::new(Fresh::draw(seed));
        let block = measured.block();
        let hidden: Vec<String> =
            measured.hidden(&[]).iter().map(|hidden| format!("{} {:.0}", hidden.name, hidden.noncentrality)).collect();
        println!(
            "{seed} {:?}: {} images, {} tie measurements, {}",
            measured.fresh.scene.kind,
            block.images.len(),
            block.ties.len(),
            hidden.join(" + ")
        );
    }
}

fn judge(seed: u64) -> Judged {
    let measured = Measured::new(Fresh::draw(seed));
    let scratch = tempfile::tempdir().expect("a temporary folder");
    write_block(&measured.block(), scratch.path()).expect("written");
    if let Some(folder) = std::env::var_os(KEEP) {
        let folder = PathBuf::from(folder).join(seed.to_string());
        write_block(&measured.block(), &folder).expect("written");
        std::fs::write(folder.join("causes.txt"), measured.causes().join("\n")).expect("written");
    }
    let found = improve(scratch.path());
    let candidates = found.as_ref().map_or(&[][..], |found| &found.recommended);
    let truth = Truth { hidden: measured.hidden(candidates), correlated_noise: false, check_mm: measured.check_mm() };
    let name = format!("{seed} {:?}", measured.fresh.scene.kind);
    judged(&name, &truth, found)
}

/// Seeds that were judged wrongly: 95 and 98 a window left the model as it had entered, 129 focal lengths by image
/// passed for imprecise heights, 131 and 243 nobody saw a vibration, 150 a robust fit had left the camera in another
/// minimum, 158 a spot stood for a pattern all over the sensor, 167 and 202 for a radial term, 226 a centre of
/// distortion was not determined beside what was found, 232 a radial term ended in another minimum, 259 a decentring
/// passed for a sensor that is not flat and a radial term, 314 for a window beside a sensor of impossible shape, 326
/// focal lengths by image passed for imprecise heights where images are noisier than stated, 340 a growing focal length
/// and a step that hide each other for chance, 341 a sensor that is not flat stayed beside the spot that it had stood
/// for, 407 one measurement held the jump of a spot. In 5137 Ceres gave up where rounding hid what was left to gain.
const WRONG_ONCE: [u64; 18] = [95, 98, 129, 131, 150, 158, 167, 202, 226, 232, 243, 259, 314, 326, 340, 341, 407, 5137];

/// `make test` judges every third seed, `make test-fresh` all.
#[test]
fn what_was_judged_wrongly_once_is_right() {
    let step = if std::env::var_os(SEEDS).is_some_and(|seeds| !seeds.is_empty()) { 1 } else { 3 };
    let seeds: Vec<u64> = WRONG_ONCE.into_iter().step_by(step).collect();
    let all = in_turn(&seeds, |seed| judge(*seed));
    assert!(all.iter().all(Judged::right), "{}", score(&all));
}

#[test]
fn a_seed_is_a_block() {
    let block = |seed| Measured::new(Fresh::draw(seed)).block();
    assert!(block(1) == block(1) && block(1) != block(2));
}
