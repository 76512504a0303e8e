//! What a plan says of a block is what a diagnosis of that block does, once it is measured.

use crate::common;
use misclosure::adjust::{CovarianceOf, Options};
use misclosure::block::{Block, Role};
use misclosure::diagnose::run::diagnose;
use misclosure::diagnose::settings::Settings;
use misclosure::evaluate::CheckRow;
use misclosure::inject;
use misclosure::model::{Datum, Model};
use misclosure::plan::notice::Drawn;
use misclosure::plan::said::Said;
use misclosure::plan::{Plan, plan};
use misclosure::residuals::check_points::patterns::{DOME, Patterns};
use misclosure::scenario::add_stated_noise;
use misclosure::score::power::POWER;

/// Blocks of each size: by chance at the stated power seven of eight or fewer are found beyond it, one or more below.
const BLOCKS: u64 = 8;

fn model() -> Model {
    Model { datum: Datum::All, ..Model::default() }
}

fn settings() -> Settings<'static> {
    let options = Options::default();
    Settings { plugins: &[], options, significance: 1e-3, snoop: true, tell: &|_| {} }
}

fn truth() -> Block {
    common::preset("closerange", &[("points", 100.0)], 1).block
}

fn planned(block: &Block) -> Plan {
    plan(block, &model(), &settings()).expect("a plan")
}

/// In how many blocks an error of a size is named as `effect`.
fn found(truth: &Block, effect: &str, error: &str, size: f64) -> usize {
    let errors = [format!("{error}={size}"), "noise:gnss=1,control=1".to_owned()];
    let errors = errors.map(|text| inject::parse(&text).expect("an error"));
    let is_found = |seed: &u64| {
        let block = inject::apply(truth, truth, &errors, *seed).expect("a block").block;
        let options = Options { covariance: CovarianceOf::Nothing, ..Options::default() };
        common::solve_native(&block, &model(), &options);
        let found = diagnose(&block, &model(), &settings()).expect("a diagnosis").diagnosis;
        found.recommended.iter().any(|own| own == effect)
    };
    (0..BLOCKS).filter(is_found).count()
}

#[test]
fn a_diagnosis_finds_what_the_plan_says_that_it_shows() {
    let truth = truth();
    let planned = planned(&truth);
    assert_eq!((planned.power, planned.images), (POWER, truth.images.len()));
    for (effect, error) in [("rolling-shutter", "rolling-shutter:readout"), ("focal-image", "focus-hunting:size")] {
        let own = planned.effects.iter().find(|own| own.effect == effect).expect("it can be seen");
        let size = own.sizes[0].size;
        let [below, above] = [0.5, 1.5].map(|times| found(&truth, effect, error, times * size));
        assert!(below <= 2, "{effect} of half of {size}: in {below} of {BLOCKS} blocks");
        assert!(above >= 7, "{effect} of one and a half times {size}: in {above} of {BLOCKS} blocks");
    }
}

/// Precision grows with the square root of the number of measurements, and with it what a block shows.
#[test]
fn more_points_show_smaller_effects() {
    let of = |points: f64| planned(&common::preset("dike", &[("points", points), ("check", 60.0)], 1).block);
    let [few, many] = [400.0, 1600.0].map(of);
    for effect in ["rolling-shutter", "pp-time", "radial-high"] {
        let size = |plan: &Plan| plan.effects.iter().find(|own| own.effect == effect).expect("it").sizes[0].size;
        let ratio = size(&few) / size(&many);
        assert!(ratio > 1.4 && ratio < 4.5, "{effect}: {ratio} with four times as many points");
    }
    let height = |plan: &Plan| plan.precision.height_m.expect("a small block").typical;
    assert!(height(&many) <= height(&few), "of a point, which its own rays determine most");
    // Control and positions determine a part of both.
    assert!(few.precision.parameters["f"] > many.precision.parameters["f"]);
}

#[test]
fn what_a_block_cannot_show_is_said_with_what_it_lacks() {
    let truth = truth();
    let planned = planned(&truth);
    let needs = |effect: &str| planned.hidden.iter().find(|own| own.effect == effect).map(|own| own.needs.join(" "));
    assert!(needs("gnss-shift").is_some_and(|needs| needs.contains("GNSS")), "{:?}", planned.hidden);
    let mut alone = truth;
    alone.ties.retain(|row| row.image.index() > 0);
    alone.marks.retain(|row| row.image.index() > 0);
    let planned = plan(&alone, &model(), &settings()).expect("a plan without one image");
    assert_eq!(planned.blind, [alone.images[0].name.clone()]);
    let flight = alone.images[0].flight;
    let is_of_flight: Vec<bool> = alone.images.iter().map(|image| image.flight == flight).collect();
    alone.ties.retain(|row| !is_of_flight[row.image.index()]);
    alone.marks.retain(|row| !is_of_flight[row.image.index()]);
    let error = plan(&alone, &model(), &settings()).expect_err("a flight without measurements").to_string();
    assert!(error.contains("all images of flight low have fewer than 3 measurements"), "{error}");
}

/// Where GNSS positions alone are the datum, a shift of all of them is a shift of the points, and no residual says so.
#[test]
fn what_a_block_can_never_show_moves_points_as_the_plan_says() {
    let truth = common::preset("mapping", &[("points", 400.0), ("check", 40.0)], 1).block;
    let model = Model { datum: Datum::Gnss, ..Model::default() };
    let planned = plan(&truth, &model, &settings()).expect("a plan");
    let shift = planned.hidden.iter().find(|own| own.effect == "gnss-shift").expect("hidden");
    for (axis, name) in ["tx", "ty", "tz"].into_iter().enumerate() {
        let typical = shift.typical.iter().find(|own| own.parameter == name).expect("a parameter");
        let mut block = truth.clone();
        let positions = block.images.iter_mut().filter_map(|image| image.gnss.as_mut());
        positions.for_each(|gnss| gnss.position[axis] += typical.size);
        let run = common::solve_both(&block, &model);
        let rows = || run.comparison.iter().flat_map(|own| &own.rows).filter(|row| row.role == Role::Check);
        let rms = |of: &dyn Fn(&CheckRow) -> f64| (rows().map(of).sum::<f64>() / rows().count() as f64).sqrt();
        let moved = [rms(&|row| row.d.norm_squared()), rms(&|row| row.d.z.powi(2))];
        for (planned, moved) in [typical.moves_m, typical.moves_height_m].into_iter().zip(moved) {
            // Both are solutions of the same linear equations: a hundredth is far above what is not linear in them.
            assert!((planned - moved).abs() < 0.01 * typical.size, "{name}: {moved} by adjustments, {typical:?}");
        }
    }
}

#[test]
fn strips_that_do_not_meet_are_refused() {
    let mut block = common::preset("mapping", &[("points", 400.0)], 1).block;
    // Of each point the images of one flight alone, of the points in turn.
    let flights: Vec<usize> = block.images.iter().map(|image| image.flight.index()).collect();
    block.ties.retain(|row| row.point.index() % block.flights.len() == flights[row.image.index()]);
    block.marks.clear();
    let error = plan(&block, &model(), &settings()).expect_err("two parts").to_string();
    assert!(error.contains("no common tie points"), "{error}");
}

/// Mean, and its standard error.
fn mean(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    [mean, (square / n).sqrt()]
}

/// Squares of the errors at check points of drawn blocks, in plan, in height and of their dome, against the variances
/// of the plan. `MISCLOSURE_NULL_BLOCKS` draws more blocks.
#[test]
fn check_points_err_as_the_plan_promises() {
    let truth = common::half_dike(400.0, 60.0, 1).block;
    let promised = planned(&truth).precision.check.expect("check points");
    let promised = [promised.plan_m.rms, promised.height_m.rms, promised.dome_m.expect("60 points")];
    let mut squares: [Vec<f64>; 3] = Default::default();
    for seed in 1..=common::null_blocks(10) {
        let mut block = truth.clone();
        add_stated_noise(&mut block, seed);
        let run = common::solve_both(&block, &model());
        let rows: Vec<_> =
            run.comparison.iter().flat_map(|own| &own.rows).filter(|row| row.role == Role::Check).collect();
        let of_rows = |of: &dyn Fn(usize) -> f64| (0..rows.len()).map(of).sum::<f64>() / rows.len() as f64;
        squares[0].push(of_rows(&|k| 0.5 * (rows[k].d.x.powi(2) + rows[k].d.y.powi(2))));
        squares[1].push(of_rows(&|k| rows[k].d.z.powi(2)));
        let patterns = Patterns::new(&rows.iter().map(|row| row.position).collect::<Vec<_>>()).expect("patterns");
        let dome: f64 = rows.iter().enumerate().map(|(k, row)| patterns.functions[(k, DOME)] * row.d.z).sum();
        squares[2].push(dome.powi(2));
    }
    for ((name, promised), squares) in ["plan", "height", "dome"].into_iter().zip(promised).zip(&squares) {
        let [mean, error] = mean(squares);
        println!("{name}: {:.2} mm, promised {:.2} mm", 1e3 * mean.sqrt(), 1e3 * promised);
        assert!((mean - promised.powi(2)).abs() < 4.0 * error, "{name}: {mean:e} +- {error:e}, {:e}", promised.powi(2));
    }
}

/// The redundancy number is the share of an error that its residual keeps, and the error moves its point by the rest.
#[test]
fn a_wrong_position_leaves_in_its_residual_what_the_redundancy_says() {
    let truth = common::half_dike(400.0, 0.0, 1).block;
    let heights = planned(&truth).reliability.into_iter().find(|own| own.of == "gnss height").expect("positions");
    let (size, sigma) = (0.5, truth.sigma.gnss_z_m);
    let mut kept = Vec::new();
    for image in (0..truth.images.len()).step_by(8) {
        let mut block = truth.clone();
        block.images[image].gnss.as_mut().expect("a position").position.z += size;
        let run = common::solve_both(&block, &model());
        let moved = run.solution().state.poses[image].centre.z - truth.images[image].pose.centre.z;
        kept.push(1.0 - moved / size);
    }
    let [redundancy, error] = mean(&kept);
    assert!((redundancy - heights.redundancy).abs() < 4.0 * error + 1e-3, "{redundancy} {}", heights.redundancy);
    // Baarda's 4.13 at 0.001 and 80 %.
    let internal = 4.13 * sigma / redundancy.sqrt();
    assert!((heights.internal.typical / internal - 1.0).abs() < 0.05, "{internal} {:?}", heights.internal);
}

#[test]
fn a_mistake_is_noticed_from_a_size_on() {
    let truth = common::half_dike(400.0, 20.0, 1).block;
    let (model, settings) = (model(), settings());
    let drawn = Drawn::of(&truth, 1, &model, &settings).expect("a drawn block without mistakes");
    let kind = |id: &str| inject::mistakes::find(id).expect("a kind");
    let wrong = drawn.smallest(kind("wrong-coordinate"), "control").expect("control points");
    let (least, named) = (wrong.size.expect("noticed"), wrong.named_size.expect("named"));
    assert!(0.01 < least && least <= named && named < 1.0 && wrong.unit == "m", "{wrong:?}");
    let exchanged = drawn.smallest(kind("exchanged"), "control").expect("control points");
    assert_eq!((exchanged.said, exchanged.size), (Said::Named, None));
    // The block has no images of another camera.
    let possible = drawn.possible();
    assert!(possible.iter().any(|(kind, of)| (kind.id(), *of) == ("clock-offset", "gnss")));
}
