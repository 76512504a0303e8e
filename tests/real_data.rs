//! Real blocks: what was published of them, or found by an independent adjustment, comes out of both solvers.
//! Each test prints one row of a table (`cargo test --release --test real_data -- --nocapture`).

mod common;

use common::{solve_both, tie_rms_px};
use misclosure::block::Block;
use misclosure::io::block::read_block;
use misclosure::model::{Datum, Model};
use misclosure::run::Run;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// The block of a name; `None`, loudly, where the real data are not at hand.
fn real(name: &str) -> Option<Block> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    if !folder.is_dir() {
        println!("skipped: no ../shared/data/{name}");
        return None;
    }
    Some(read_block(&folder).unwrap_or_else(|error| panic!("{name}: {error}")).block)
}

/// A model with the named camera parameters free.
fn model(datum: Datum, free: &[&str], tie_dc_to_pp: bool) -> Model {
    let mut flags = [false; 12];
    for k in free.iter().flat_map(|name| misclosure::camera::parameter_indices(name).expect("a parameter")) {
        flags[k] = true;
    }
    Model { datum, free: flags, tie_dc_to_pp, ..Model::default() }
}

/// What an adjustment is held against: value, tolerance.
struct Published {
    sigma0_px: Option<(f64, f64)>,
    f_px: Option<(f64, f64)>,
    redundancy: Option<i64>,
}

/// Adjusts in both solvers, prints a row and compares.
fn reproduce(name: &str, what: &str, block: &Block, model: &Model, published: &Published) -> Run {
    let started = Instant::now();
    let run = solve_both(block, model);
    let seconds = started.elapsed().as_secs_f64();
    let sigma0_px = run.sigma0() * block.sigma.tie_px;
    let f_px = run.solution().state.interiors[0][0];
    let (_, _, redundancy) = run.problem.redundancy();
    println!(
        "{name} ({what}): sigma0 {sigma0_px:.6} px (expected {:?}); f {f_px:.3} px (expected {:?}); redundancy {redundancy} (expected {:?}); \
         tie rms {:.4} px; {seconds:.2} s, iterations {:?}",
        published.sigma0_px,
        published.f_px,
        published.redundancy,
        tie_rms_px(block, &run),
        run.solutions.iter().map(|(name, solution)| (*name, solution.iterations)).collect::<Vec<_>>(),
    );
    if let Some(expected) = published.redundancy {
        assert_eq!(redundancy, expected, "{name}, {what}: redundancy");
    }
    for (quantity, found, expected) in [("sigma0", sigma0_px, published.sigma0_px), ("f", f_px, published.f_px)] {
        if let Some((value, tolerance)) = expected {
            assert!(
                (found - value).abs() <= tolerance,
                "{name}, {what}: {quantity} = {found} px, expected {value} +- {tolerance}"
            );
        }
    }
    run
}

/// The forward model of the report has no aspect; a published 0.162168 and an independent 0.162148 px bound the value.
#[test]
fn camcal_forward_model_without_aspect() {
    let Some(block) = real("dbat-camcal") else { return };
    let square = BTreeMap::from([("b1".to_string(), 0.0)]);
    let model = Model {
        camera_values: BTreeMap::from([("cam".to_string(), square)]),
        ..model(Datum::Control, &["f", "pp", "radial", "decentring"], true)
    };
    let published = Published {
        sigma0_px: Some((0.162158, 1.05e-5)),
        // 7.45748 mm at 5.43764 mm = 1704 px, given to 1e-5 mm.
        f_px: Some((7.45748 * 1704.0 / 5.43764, 0.02)),
        redundancy: Some(3726),
    };
    reproduce("dbat-camcal", "forward, no aspect", &block, &model, &published);
}

/// With an affinity, as found independently.
#[test]
fn camcal_forward_model_with_aspect() {
    let Some(block) = real("dbat-camcal") else { return };
    let model = model(Datum::Control, &["f", "pp", "radial", "decentring", "b1"], true);
    let published = Published { sigma0_px: Some((0.154891, 1e-6)), f_px: None, redundancy: Some(3725) };
    reproduce("dbat-camcal", "forward, b1", &block, &model, &published);
}

/// The camera is known and free of distortion, so forward and backward models are the same.
#[test]
fn aerial_block_with_a_known_camera() {
    let Some(block) = real("dbat-sxb") else { return };
    let published = Published { sigma0_px: Some((1.07447, 5e-6)), f_px: None, redundancy: Some(1267) };
    reproduce("dbat-sxb", "camera held", &block, &model(Datum::Control, &[], false), &published);
}

#[test]
fn seneca_with_ten_parameters() {
    let Some(block) = real("uav-seneca") else { return };
    let published = Published { sigma0_px: None, f_px: Some((2552.4, 0.5)), redundancy: None };
    for datum in [Datum::Free, Datum::Gnss] {
        reproduce("uav-seneca", &format!("dc = pp, {datum:?}"), &block, &model(datum, &["all"], true), &published);
    }
}
