//! Real blocks: what was published of them, or found by an independent adjustment, comes out of both solvers.
//! Each test prints one row of a table (`cargo test --release --test solvers real_data:: -- --nocapture`).

use crate::beside;
use crate::common;
use common::{solve_both, tie_rms_px};
use misclosure::adjust::Options;
use misclosure::block::Block;
use misclosure::diagnose::run::diagnose;
use misclosure::diagnose::settings::Settings;
use misclosure::diagnose::verdict::Verdict;
use misclosure::io::block::read_block;
use misclosure::model::{Datum, Model};
use misclosure::run::Run;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// The block of a name; `None`, loudly, where the real data are not at hand.
fn real(name: &str) -> Option<Block> {
    let folder = beside::shared("data")?.join(name);
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
        "{name} ({what}): sigma0 {sigma0_px:.6} px (expected {:?}); f {f_px:.3} px (expected {:?}); redundancy \
         {redundancy} (expected {:?}); tie rms {:.4} px; {seconds:.2} s, iterations {:?}",
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
    let run = reproduce("dbat-camcal", "forward, no aspect", &block, &model, &published);
    // The backward models' f = 7.457 +- 0.00105 mm is the same focal length.
    let f_mm = run.solution().state.interiors[0][0] * 5.43764 / 1704.0;
    assert!((f_mm - 7.457).abs() < 0.00105, "f = {f_mm} mm");
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

/// The numbers of the published report's camera, mm and an upward y axis.
fn published_camera(name: &str) -> impl Fn(&str) -> f64 {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name).join("reference.json");
    let text = std::fs::read_to_string(file).expect("reference.json");
    let reference: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    move |key| reference["published"][0]["camera"][key]["value"].as_f64().unwrap_or_else(|| panic!("no {key}"))
}

/// The report holds the camera in a backward model, which corrects the measured points. Corrected beforehand, they are
/// those of a camera without distortion, and its residuals are the report's.
#[test]
fn prague_with_the_camera_held() {
    let name = "dbat-prague-cam";
    let Some(mut block) = real(name) else { return };
    let report = published_camera(name);
    let scale = report("image_h_px") / report("format_h_mm");
    let (ppx, ppy) = (report("px_mm") * scale, report("py_mm") * scale);
    let (k1, k2) = (report("K1") / scale.powi(2), report("K2") / scale.powi(4));
    // An upward y axis turns the sign of P2.
    let (p1, p2) = (report("P1") / scale, -report("P2") / scale);
    for row in block.ties.iter_mut().chain(&mut block.marks) {
        let (x, y) = (row.x - ppx, row.y - ppy);
        let r2 = x * x + y * y;
        let radial = k1 * r2 + k2 * r2 * r2;
        row.x += x * radial + p1 * (r2 + 2.0 * x * x) + 2.0 * p2 * x * y;
        row.y += y * radial + p2 * (r2 + 2.0 * y * y) + 2.0 * p1 * x * y;
    }
    let f = report("cc_mm") * scale;
    block.cameras[0].interior = [f, ppx, ppy, ppx, ppy, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let published = Published { sigma0_px: Some((0.160984, 1e-6)), f_px: None, redundancy: Some(3734) };
    reproduce(name, "camera held, measurements corrected", &block, &model(Datum::Control, &[], false), &published);
}

/// The reference is a backward model, which measures residuals at the corrected point (up to 0.6 times as long at the
/// corner of this lens) and fits another polynomial: its 0.256 px cannot come out here, its focal length does to a part
/// in a thousand, the redundancy exactly.
#[test]
fn exom_with_a_forward_camera() {
    let Some(block) = real("dbat-camcal-exom") else { return };
    let model = model(Datum::Control, &["f", "pp", "radial", "decentring", "b1"], true);
    let published = Published { sigma0_px: None, f_px: Some((5686.17, 5.7)), redundancy: Some(1126) };
    reproduce("dbat-camcal-exom", "forward, b1", &block, &model, &published);
}

/// Nothing is published; a weak block (nadir, one flight), slow to converge with everything free.
#[test]
fn caliterra_with_everything_free() {
    let Some(block) = real("uav-caliterra") else { return };
    let nothing = Published { sigma0_px: None, f_px: None, redundancy: None };
    let tied = reproduce("uav-caliterra", "dc = pp", &block, &model(Datum::Free, &["all"], true), &nothing);
    let free = reproduce("uav-caliterra", "all free", &block, &model(Datum::Free, &["all"], false), &nothing);
    assert!(free.chi_square() < tied.chi_square(), "a model that contains the other fits no worse");
}

/// The aerial block of `data/ign-borea` with its control in the height system of the rest.
fn in_one_height_system() -> Block {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/ign-borea");
    let mut block = read_block(&folder).unwrap_or_else(|error| panic!("{error}")).block;
    // Its ellipsoidal height less the geoid's undulation there (reference.json): the height of the intersected rays.
    const UNDULATION_M: f64 = 49.349;
    block.surveyed.iter_mut().for_each(|point| point.position.z -= UNDULATION_M);
    block.about_its_centre()
}

#[test]
fn an_aerial_camera_has_a_lens_and_a_pattern_on_its_sensor_and_no_cause_beside() {
    let block = in_one_height_system();
    let settings =
        Settings { plugins: &[], options: Options::default(), significance: 1e-3, snoop: true, tell: &|_| {} };
    let diagnosed = diagnose(&block, &model(Datum::All, &[], false), &settings).expect("a diagnosis");
    let diagnosis = &diagnosed.diagnosis;
    let ledger = &diagnosis.ledger;
    println!("{:?} {:?} {:?}", diagnosis.verdict, diagnosis.recommended, diagnosis.known);
    assert_eq!(diagnosis.verdict, Verdict::Unexplained, "the pattern has no name: {:?}", diagnosis.left);
    // Radial terms and the focal length that goes with them at one height: the lens, and nothing beside.
    let of_camera = |id: &String| id.starts_with("free:");
    assert!(diagnosis.recommended.iter().all(of_camera), "{:?}", diagnosis.recommended);
    assert!(diagnosis.recommended.contains(&"free:radial".to_string()), "{:?}", diagnosis.recommended);
    assert!(!diagnosis.left_shapes.is_empty(), "the pattern of the sensor is a field");
    assert!(ledger.windows(2).all(|pair| pair[1].objective < pair[0].objective));
    assert!(ledger[ledger.len() - 1].heldout_rms_px < ledger[0].heldout_rms_px);
    // The curvature of the Earth and the scale of Lambert-93 are known from its code.
    let known: Vec<&str> = diagnosis.known.iter().map(|known| known.effect.as_str()).collect();
    assert_eq!(known, ["earth-curvature", "map-scale"]);
    let run = solve_both(&diagnosed.block, &diagnosed.improvement.fit.model);
    assert!(run.agreement.is_some_and(|agreement| agreement.agree));
}
